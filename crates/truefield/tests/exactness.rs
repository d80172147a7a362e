//! Surfaces against brute force over every triangle of every nasty mesh: the same bits.

mod nasty;

use std::sync::Arc;

use nasty::{Kind, Nasty, corpus, judge, judged, shapes};
use truefield::laws::{
    BruteForce, check_closest, check_extent, check_lipschitz, check_many, check_normal, check_range, check_threads, check_truth, places,
};
use truefield::{Closest, DVec3, Distance, Interval, Run, SignChoice, Surface};

/// Distances in units of which rounding and doubt about the side are measured.
fn diagonal(nasty: &Nasty) -> f64 {
    nasty.mesh.extent().diagonal()
}

fn surface(nasty: &Nasty, sign: SignChoice) -> Surface {
    Surface::new(Arc::new(nasty.mesh.clone()), sign, &Run::with_threads(2)).unwrap_or_else(|error| panic!("{}: {error}", nasty.name))
}

/// The true signed distance of a watertight mesh.
fn signed(nasty: &Nasty, brute: &BruteForce, p: DVec3) -> f64 {
    let distance = brute.unsigned(p);
    if judge::winding(&nasty.mesh, p).is_some_and(|w| w > 0) { -distance } else { distance }
}

#[test]
fn distance_and_triangle_have_the_bits_of_brute_force() {
    for nasty in corpus() {
        let count = (6_000_000 / nasty.mesh.triangles().len()).clamp(10_000, 40_000);
        let points = places(&nasty.mesh, count, 1);
        let brute = BruteForce::new(&nasty.mesh);
        let truth = judged(&points, |p| brute.nearest(p));
        let surface = surface(&nasty, SignChoice::Unsigned);
        let nearest = surface.nearest_many(&points, &Run::with_threads(2)).expect("answers");
        let distances = surface.distances(&points, &Run::with_threads(2)).expect("answers");
        for (i, &(squared, triangle)) in truth.iter().enumerate() {
            let (p, name) = (points[i], nasty.name);
            assert_eq!(
                distances[i].to_bits(),
                squared.sqrt().to_bits(),
                "{name}: distance {} at {p:?}, truth {}",
                distances[i],
                squared.sqrt()
            );
            assert_eq!(
                nearest[i].distance.to_bits(),
                squared.sqrt().to_bits(),
                "{name}: {:?} at {p:?}, truth {}",
                nearest[i],
                squared.sqrt()
            );
            assert_eq!(nearest[i].element, triangle, "{name}: {:?} at {p:?}", nearest[i]);
            if i % 16 == 0 {
                assert_eq!(surface.at(p), Interval::exact(squared.sqrt()), "{name} at {p:?}");
                assert_eq!(surface.nearest(p, f64::INFINITY), Some(nearest[i]), "{name} at {p:?}");
            }
        }
    }
}

#[test]
fn large_meshes_have_the_bits_of_brute_force() {
    let meshes = [
        shapes::welded(&shapes::scan(120, 80, 9)),
        shapes::welded(&shapes::rod(4000, 1.0, 30.0)),
        shapes::loose(&shapes::random_soup(20_000, 0.02, 10)),
        shapes::loose(&shapes::slivers(5_000, 11)),
        shapes::welded(&shapes::torus(300, 8, 1.0, 0.001)),
    ];
    for (which, mesh) in meshes.into_iter().enumerate() {
        let points = places(&mesh, 3_000, 3);
        let brute = BruteForce::new(&mesh);
        let truth = judged(&points, |p| brute.nearest(p));
        let surface = Surface::new(Arc::new(mesh), SignChoice::Unsigned, &Run::with_threads(2)).expect("a surface");
        let nearest = surface.nearest_many(&points, &Run::with_threads(2)).expect("answers");
        for ((p, found), (squared, triangle)) in points.iter().zip(&nearest).zip(truth) {
            assert_eq!((found.distance, found.element), (squared.sqrt(), triangle), "mesh {which} at {p:?}");
        }
    }
}

#[test]
fn surfaces_obey_the_laws_of_closest() {
    for nasty in corpus() {
        let points = places(&nasty.mesh, (200_000 / nasty.mesh.triangles().len()).clamp(600, 3_000), 2);
        let brute = BruteForce::new(&nasty.mesh);
        for sign in [SignChoice::Auto, SignChoice::Unsigned] {
            let surface = surface(&nasty, sign);
            check_closest(&surface, &brute, &points, 1e-15 * diagonal(&nasty))
                .unwrap_or_else(|broken| panic!("{} ({sign:?}): {broken}", nasty.name));
        }
    }
}

#[test]
fn surfaces_obey_the_laws_of_distance() {
    for nasty in corpus() {
        let points = places(&nasty.mesh, 600, 4);
        let brute = BruteForce::new(&nasty.mesh);
        let surface = surface(&nasty, SignChoice::Auto);
        // Beside the surface a side is as good as rounding lets it be.
        let allowance = 1e-12 * diagonal(&nasty);
        let fail = |broken| panic!("{} ({:?}): {broken}", nasty.name, surface.sign_rule());
        check_many(&surface, &points).unwrap_or_else(fail);
        check_extent(&surface, |p| brute.unsigned(p), &points, allowance).unwrap_or_else(fail);
        if nasty.kind == Kind::Open {
            // Nobody knows the side; but what is said must hold together.
            check_truth(&surface, |p| at_side_of(&surface, p, brute.unsigned(p)), &points, allowance).unwrap_or_else(fail);
            check_range(&surface, |p| at_side_of(&surface, p, brute.unsigned(p)), &points, allowance).unwrap_or_else(fail);
        } else {
            check_truth(&surface, |p| signed(&nasty, &brute, p), &points, allowance).unwrap_or_else(fail);
            check_range(&surface, |p| signed(&nasty, &brute, p), &points, allowance).unwrap_or_else(fail);
            check_lipschitz(&surface, &points, allowance).unwrap_or_else(fail);
        }
    }
}

/// The plain distance with the side that `surface` says.
fn at_side_of(surface: &Surface, p: DVec3, distance: f64) -> f64 {
    let at = surface.at(p);
    if at.lower + at.upper < 0.0 { -distance } else { distance }
}

#[test]
fn sides_are_right_and_seldom_in_doubt_where_an_inside_exists() {
    for nasty in corpus().into_iter().filter(|nasty| nasty.kind != Kind::Open) {
        let points = places(&nasty.mesh, (600_000 / nasty.mesh.triangles().len()).min(10_000), 5);
        let brute = BruteForce::new(&nasty.mesh);
        let truth = judged(&points, |p| (brute.unsigned(p), judge::winding(&nasty.mesh, p)));
        for choice in [SignChoice::Auto, SignChoice::Winding] {
            let surface = surface(&nasty, choice);
            let bounds = surface.bounds(&points, &Run::with_threads(2)).expect("answers");
            let mut doubtful = 0;
            for ((&p, &found), &(distance, winding)) in points.iter().zip(&bounds).zip(&truth) {
                let truth = if winding.is_some_and(|w| w > 0) { -distance } else { distance };
                // On the surface, to the rounding of its coordinates, there is no side.
                if winding.is_none() || distance <= 4.0 * f64::EPSILON * (p.length() + diagonal(&nasty)) {
                    assert!(found.contains(distance) || found.contains(-distance), "{}: {found:?} at {p:?}", nasty.name);
                    continue;
                }
                assert!(
                    found.contains(truth),
                    "{} ({:?}): {found:?} at {p:?}, truth {truth:?}, winding number {winding:?}",
                    nasty.name,
                    surface.sign_rule()
                );
                doubtful += usize::from(found.width() > 0.0 && distance > 1e-7 * diagonal(&nasty));
            }
            assert!(
                doubtful * 1000 <= points.len(),
                "{} ({:?}): {doubtful} doubtful sides of {}",
                nasty.name,
                surface.sign_rule(),
                points.len()
            );
        }
    }
}

#[test]
fn the_judge_of_sides_knows_a_cube() {
    let cube = shapes::welded(&shapes::cube());
    let twice = shapes::welded(&[shapes::cube(), shapes::moved(&shapes::cube(), |v| v * 2.0 - 0.25)].concat());
    for (p, once, both) in [
        (DVec3::splat(0.5), Some(1), Some(2)),
        (DVec3::new(0.5, 0.25, 0.75), Some(1), Some(2)),
        (DVec3::new(0.5, 0.5, f64::MIN_POSITIVE), Some(1), Some(2)),
        (DVec3::new(0.5, 0.5, -f64::MIN_POSITIVE), Some(0), Some(1)),
        (DVec3::new(0.5, 0.5, 1.0f64.next_up()), Some(0), Some(1)),
        (DVec3::new(3.0, 0.0, 0.0), Some(0), Some(0)),
        (DVec3::new(0.5, 0.5, 0.0), None, None),
        (DVec3::ONE, None, None),
    ] {
        assert_eq!((judge::winding(&cube, p), judge::winding(&twice, p)), (once, both), "{p:?}");
    }
}

#[test]
fn normals_are_gradients() {
    for nasty in corpus().into_iter().filter(|nasty| nasty.kind == Kind::Solid) {
        let size = diagonal(&nasty);
        // Differences need digits: not where coordinates have none to spare.
        if nasty.mesh.extent().center().length() > 1e3 * size {
            continue;
        }
        let points: Vec<DVec3> = places(&nasty.mesh, 1_100, 6);
        let surface = surface(&nasty, SignChoice::Auto);
        let judged = check_normal(&surface, &points, 1e-6 * size).unwrap_or_else(|broken| panic!("{}: {broken}", nasty.name));
        assert!(judged > points.len() / 5, "{}: only {judged} points were judged", nasty.name);
    }
}

#[test]
fn threads_do_not_matter() {
    for nasty in corpus().into_iter().step_by(3) {
        let points = places(&nasty.mesh, 5_000, 7);
        let bits = |x: f64| x.to_bits();
        check_threads(nasty.name, |run| {
            let surface = Surface::new(Arc::new(nasty.mesh.clone()), SignChoice::Auto, run)?;
            let distances: Vec<u64> = surface.distances(&points, run)?.into_iter().map(bits).collect();
            let bounds: Vec<[u64; 2]> = surface.bounds(&points, run)?.into_iter().map(|b| [bits(b.lower), bits(b.upper)]).collect();
            let nearest: Vec<_> = surface.nearest_many(&points, run)?;
            let nearest: Vec<_> = nearest
                .iter()
                .map(|n| (n.point.to_array().map(bits), n.normal.to_array().map(bits), bits(n.distance), n.element, n.feature))
                .collect();
            Ok((distances, bounds, nearest))
        })
        .unwrap_or_else(|broken| panic!("{broken}"));
    }
}
