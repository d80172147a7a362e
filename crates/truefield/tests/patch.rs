//! Bezier patches: the closest point against known shapes and dense samples, and the side against the triangles' own.

mod residual;

use residual::residuals;
use truefield::laws::{Random, check_lipschitz, check_threads};
use truefield::source::patch::{Bezier, Patches, Sides};
use truefield::{Aabb, DVec3, Distance, Run, Source};

fn patches(set: &[Bezier], sides: Sides) -> Patches {
    Patches::new(set, sides, &Run::with_threads(2)).expect("patches")
}

fn value(patches: &Patches, p: DVec3) -> f64 {
    let mut out = [0.0];
    patches.values(&[p], &mut out).expect("a value");
    out[0]
}

/// A flat patch between two corners of a parallelogram, its control points evenly spread.
fn flat(corner: DVec3, u: DVec3, v: DVec3) -> Bezier {
    Bezier(std::array::from_fn(|i| std::array::from_fn(|j| corner + u * (i as f64 / 3.0) + v * (j as f64 / 3.0))))
}

/// The six faces of a box, outward.
fn cube(half: f64) -> Vec<Bezier> {
    let edge = 2.0 * half;
    let low = DVec3::splat(-half);
    let [x, y, z] = DVec3::AXES.map(|axis| axis * edge);
    vec![flat(low, y, x), flat(low + z, x, y), flat(low, x, z), flat(low + y, z, x), flat(low, z, y), flat(low + x, y, z)]
}

/// A surface of revolution around z of cubic profiles (r, z), four patches for each, oriented away from the axis where the
/// profile rises.
fn revolved(profiles: &[[(f64, f64); 4]]) -> Vec<Bezier> {
    let k = 4.0 / 3.0 * (2.0_f64.sqrt() - 1.0);
    let circle = [(1.0, 0.0), (1.0, k), (k, 1.0), (0.0, 1.0)];
    let mut set = Vec::new();
    for quarter in 0..4 {
        let turn = |(x, y): (f64, f64)| match quarter {
            0 => (x, y),
            1 => (-y, x),
            2 => (-x, -y),
            _ => (y, -x),
        };
        for profile in profiles {
            set.push(Bezier(std::array::from_fn(|i| {
                let (x, y) = turn(circle[i]);
                profile.map(|(r, z)| DVec3::new(r * x, r * y, z))
            })));
        }
    }
    set
}

/// Nearly a ball of radius 1.
fn ball() -> Vec<Bezier> {
    let k = 4.0 / 3.0 * (2.0_f64.sqrt() - 1.0);
    revolved(&[[(0.0, -1.0), (k, -1.0), (1.0, -k), (1.0, 0.0)], [(1.0, 0.0), (1.0, k), (k, 1.0), (0.0, 1.0)]])
}

fn wavy(random: &mut Random) -> Bezier {
    Bezier(std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            DVec3::new(i as f64 / 3.0, j as f64 / 3.0, 0.0)
                + DVec3::new(random.between(-0.2, 0.2), random.between(-0.2, 0.2), random.between(-0.5, 0.5))
        })
    }))
}

#[test]
fn a_cube_of_patches_has_the_distance_of_a_cube() {
    let shape = patches(&cube(0.7), Sides::Closed);
    let mut random = Random::new(1);
    for _ in 0..2000 {
        let p = DVec3::new(random.between(-1.5, 1.5), random.between(-1.5, 1.5), random.between(-1.5, 1.5));
        let q = p.abs() - 0.7;
        let truth = q.max(DVec3::ZERO).length() + q.max_element().min(0.0);
        let at = shape.at(p);
        assert!(at.widen(1e-15).contains(truth) && at.width() < 1e-10, "{at:?} at {p} is not {truth}");
        assert!((value(&shape, p) - truth).abs() < 1e-10);
    }
    // The middle, and places very near to faces, edges and corners.
    for p in [
        DVec3::ZERO,
        DVec3::new(0.7 + 1e-7, 0.2, 0.1),
        DVec3::new(0.7 - 1e-7, 0.2, 0.1),
        DVec3::splat(0.7 + 1e-8),
        DVec3::splat(0.7 - 1e-8),
    ] {
        let q = p.abs() - 0.7;
        let truth = q.max(DVec3::ZERO).length() + q.max_element().min(0.0);
        assert!((value(&shape, p) - truth).abs() < 1e-10 && shape.at(p).width() < 1e-9, "{p}: {:?}, not {truth}", shape.at(p));
    }
}

#[test]
fn a_ball_of_patches_is_nearly_round() {
    // Four cubics are off a circle by less than 2.8e-4 of its radius, outward; so is the revolved surface.
    let shape = patches(&ball(), Sides::Closed);
    let mut random = Random::new(2);
    for _ in 0..3000 {
        let p = random.direction() * random.length(0.1, 3.0);
        let (at, truth) = (shape.at(p), p.length() - 1.0);
        assert!(at.lower <= truth + 1e-9 && at.upper >= truth - 6e-4, "{at:?} at {p}, {truth}");
        assert!(at.width() < 1e-9, "{at:?} at {p} is wide");
    }
    // The middle is as far from all of it, which no search takes apart; the interval holds.
    let middle = shape.at(DVec3::ZERO);
    assert!(middle.contains(-1.0) && middle.width() < 1e-2, "{middle:?}");
    // Poles, where an edge of each patch is one point.
    for z in [1.5, 1.0 + 1e-6, 1.0 - 1e-6, 0.5, -0.999, -1.1] {
        let at = shape.at(DVec3::new(0.0, 0.0, z));
        assert!(at.widen(1e-9).contains(f64::abs(z) - 1.0), "{at:?} at z = {z}");
    }
    let places: Vec<DVec3> = (0..500).map(|_| random.direction() * random.length(1e-2, 2.0)).collect();
    check_lipschitz(&shape, &places, 1e-12).unwrap_or_else(|broken| panic!("{broken}"));
}

#[test]
fn random_patches_are_as_far_as_their_nearest_sample() {
    let mut random = Random::new(3);
    for _ in 0..12 {
        let set: Vec<Bezier> = (0..3).map(|_| wavy(&mut random)).collect();
        let shape = patches(&set, Sides::Unsigned);
        let steps = 200;
        let samples: Vec<DVec3> = set
            .iter()
            .flat_map(|patch| {
                (0..=steps).flat_map(move |i| {
                    (0..=steps).map(move |j| patch.point(f64::from(i) / f64::from(steps), f64::from(j) / f64::from(steps)))
                })
            })
            .collect();
        let extent = shape.extent().expect("an extent");
        assert!(samples.iter().all(|p| extent.contains(*p)));
        for _ in 0..40 {
            let p = random.within(&Aabb::new(DVec3::splat(-1.0), DVec3::splat(2.0)));
            let nearest = samples.iter().map(|q| (*q - p).length_squared()).fold(f64::INFINITY, f64::min).sqrt();
            let at = shape.at(p);
            assert!(at.width() < 1e-9, "{at:?} is wide");
            assert!(at.lower <= nearest + 1e-12, "{at:?}, but a sample is {nearest} away");
            assert!(at.upper >= nearest - 0.02, "{at:?}, but the nearest sample is {nearest} away");
            let foot = shape.foot(p);
            assert!(((foot - p).length() - at.upper).abs() < 1e-10);
        }
        // Points of the patches are on them.
        for sample in samples.iter().step_by(997) {
            assert!(value(&shape, *sample) < 1e-10, "{sample}");
        }
    }
}

#[test]
fn slack_and_bend_hold() {
    let shape = patches(&ball(), Sides::Closed);
    let mut random = Random::new(4);
    let mut simple = 0;
    for _ in 0..300 {
        let middle = random.direction() * random.length(0.2, 2.0);
        let half = random.length(1e-2, 0.1);
        let cell = Aabb::new(middle - half, middle + half);
        let (bend, slack) = (shape.bend(&cell), shape.slack(&cell));
        for _ in 0..4 {
            let p = random.within(&cell);
            let (at, value) = (shape.at(p), value(&shape, p));
            assert!(slack.contains(at.lower - value) && slack.contains(at.upper - value), "{at:?} and {value} at {p}, {slack:?}");
        }
        simple += usize::from(slack.width() < 1e-8);
        let direction = random.direction();
        let step = 0.3 * half;
        let [a, b, c] = [middle - direction * step, middle, middle + direction * step].map(|p| value(&shape, p));
        let second = (a - 2.0 * b + c) / (step * step);
        assert!(bend.widen(4.0 * shape.noise() / (step * step)).contains(second), "{second} at {middle}, {bend:?}");
    }
    assert!(simple > 100, "only {simple} of 300 cells are simple");
}

#[test]
fn what_is_said_between_samples_holds() {
    let mut random = Random::new(8);
    for set in [ball(), cube(0.7)] {
        let shape = patches(&set, Sides::Closed);
        for n in 0..200 {
            let p = random.direction() * random.length(0.2, 2.0);
            residuals("patches", &shape, p, [0.05, 0.4][n % 2], 2.0 * shape.noise(), &mut random);
        }
    }
}

#[test]
fn what_does_not_close_up_is_refused() {
    let run = Run::with_threads(1);
    let refused = |set: &[Bezier], sides: Sides| Patches::new(set, sides, &run).expect_err("a refusal").to_string();
    assert!(refused(&[], Sides::Unsigned).contains("no patches"));
    let mut broken = cube(1.0);
    broken[2].0[1][1].x = f64::NAN;
    assert!(refused(&broken, Sides::Unsigned).contains("patch 2"));
    assert!(refused(&cube(1.0)[..5], Sides::Closed).contains("unsigned"), "open");
    // Unsigned, an open set answers plain distances.
    let open = patches(&cube(1.0)[..5], Sides::Unsigned);
    assert!(!open.is_closed() && (value(&open, DVec3::ZERO) - 1.0).abs() < 1e-10);
}

#[test]
fn answers_do_not_depend_on_threads() {
    let mut random = Random::new(6);
    let places: Vec<DVec3> = (0..50).map(|_| random.direction() * 1.2).collect();
    check_threads("patches", |run| {
        let shape = Patches::new(&ball(), Sides::Closed, run)?;
        Ok(places.iter().map(|&p| (shape.at(p).lower.to_bits(), shape.at(p).upper.to_bits())).collect::<Vec<_>>())
    })
    .unwrap_or_else(|broken| panic!("{broken}"));
}
