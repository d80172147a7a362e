//! Contours and medial axes of sampled fields.

use truefield::laws::{Random, check_threads};
use truefield::product::contour::Placement;
use truefield::product::medial::{MedialAxis, Where, medial_axis};
use truefield::product::sampled::{SampledContour, contour};
use truefield::{Continuity, DVec3, Distance, Error, Known, Lattice, Run, SampledField};

const PLENTY: u64 = 1 << 30;

fn sampled(lattice: Lattice, truth: impl Fn(DVec3) -> f64) -> SampledField {
    let values = (0..lattice.len()).map(|n| truth(lattice.node(n)) as f32).collect();
    let known = Known::Rounded { band: f64::INFINITY, doubtful: Vec::new() };
    SampledField::new(lattice, values, known, Continuity::Everywhere).expect("a field")
}

fn lattice() -> Lattice {
    Lattice { origin: DVec3::new(-2.0, -1.5, -1.2), spacing: DVec3::new(0.1, 0.13, 0.17), first: [2, -1, 0], shape: [33, 25, 16] }
}

fn ball(p: DVec3) -> f64 {
    (p - DVec3::new(-0.3, 0.1, 0.0)).length() - 0.9
}

/// Signed distance of a box about the origin.
fn block(half: DVec3, p: DVec3) -> f64 {
    let q = p.abs() - half;
    q.max(DVec3::ZERO).length() + q.max_element().min(0.0)
}

#[test]
fn contours_hold_both_guarantees() {
    let field = sampled(lattice(), ball);
    let mut random = Random::new(4);
    for (distance, tolerance, placement) in [
        (0.0, 0.05, Placement::Lattice),
        (-0.4, 0.011, Placement::Lattice),
        (0.3, 0.2, Placement::Lattice),
        (0.0, 0.05, Placement::Projected),
        (-0.7, 0.3, Placement::Projected),
    ] {
        let found = contour(&field, distance, tolerance, placement, PLENTY, &Run::with_threads(2)).expect("a contour");
        assert!(found.points.len() > 20);
        assert_eq!((found.points.len(), found.points.len()), (found.normals.len(), found.bounds.len()));
        let mut projected = 0;
        for ((&p, normal), bounds) in found.points.iter().zip(&found.normals).zip(&found.bounds) {
            let value = field.interpolate(p).expect("inside");
            assert!((value - distance).abs() <= 0.5 * tolerance * (1.0 + 1e-6), "{value} at {p}, not {distance}");
            projected += usize::from((value - distance).abs() <= 2e-6 * tolerance);
            assert!(bounds.contains(ball(p)), "{bounds:?} at {p}");
            assert!((*normal - field.gradient(p).expect("inside")).length() < 1e-6 || on_a_face(p));
        }
        if placement == Placement::Projected {
            // Points may not leave their cell, which a large tolerance would have them do.
            let least = if tolerance < 0.1 { 0.9 } else { 0.5 };
            assert!(projected as f64 > least * found.points.len() as f64, "only {projected} of {} on the contour", found.points.len());
        }
        // Roots of the interpolation along random lines are near a point.
        let reach = if placement == Placement::Projected { tolerance } else { 0.5 * tolerance } * (1.0 + 1e-6);
        assert!(farthest(&field, distance, &found, &mut random) <= reach, "distance {distance}, tolerance {tolerance}");
    }
}

/// How far roots of the interpolation along random lines are from the next point of a contour, at most.
fn farthest(field: &SampledField, distance: f64, found: &SampledContour, random: &mut Random) -> f64 {
    let extent = field.lattice().extent();
    let value = |p: DVec3| field.interpolate(p).expect("inside") - distance;
    let (mut farthest, mut judged) = (0.0f64, 0);
    while judged < 300 {
        let (mut a, mut b) = (random.within(&extent), random.within(&extent));
        if (value(a) < 0.0) == (value(b) < 0.0) {
            continue;
        }
        for _ in 0..60 {
            let middle = (a + b) * 0.5;
            if (value(middle) < 0.0) == (value(a) < 0.0) { a = middle } else { b = middle }
        }
        farthest = farthest.max(found.points.iter().map(|p| (*p - a).length()).fold(f64::INFINITY, f64::min));
        judged += 1;
    }
    farthest
}

/// On a face between cells the gradient is that of either.
fn on_a_face(p: DVec3) -> bool {
    let index = (p - lattice().origin) / lattice().spacing;
    (index - index.round()).abs().min_element() < 1e-6
}

#[test]
fn contours_of_anything_hold_too() {
    // Steep and shallow, far from a distance.
    let mut random = Random::new(9);
    for scale in [0.01, 1.0, 3.0] {
        let lattice = Lattice { origin: DVec3::ZERO, spacing: DVec3::new(1.0, 0.5, 2.0), first: [0; 3], shape: [4, 5, 3] };
        let field = sampled(lattice, |_| 0.0);
        let values = field.values().iter().map(|_| (scale * random.between(-1.0, 1.0)) as f32).collect();
        let field = SampledField::new(lattice, values, Known::Within(f64::INFINITY), Continuity::Everywhere).expect("a field");
        let tolerance = 0.3;
        let found = contour(&field, 0.0, tolerance, Placement::Lattice, PLENTY, &Run::default()).expect("a contour");
        assert!(found.points.iter().all(|&p| field.interpolate(p).expect("inside").abs() <= 0.5 * tolerance * (1.0 + 1e-9)));
        assert!(farthest(&field, 0.0, &found, &mut random) <= 0.5 * tolerance * (1.0 + 1e-9), "scale {scale}");
        assert!(found.bounds.iter().all(|b| b.lower == f64::NEG_INFINITY && b.upper == f64::INFINITY));
        assert_eq!(field.at(DVec3::ZERO).width(), f64::INFINITY);
    }
}

#[test]
fn contours_that_cannot_be_are_refused() {
    let field = sampled(lattice(), ball);
    let run = Run::default();
    for (distance, tolerance) in [(f64::NAN, 0.1), (f64::INFINITY, 0.1), (0.0, 0.0), (0.0, -1.0), (0.0, f64::NAN), (0.0, 1e-9)] {
        assert!(matches!(contour(&field, distance, tolerance, Placement::Lattice, PLENTY, &run), Err(Error::Invalid(_))), "{tolerance}");
    }
    assert!(matches!(contour(&field, 0.0, 0.01, Placement::Lattice, 1000, &run), Err(Error::Memory { .. })));
    let flat = sampled(Lattice { shape: [5, 1, 5], ..lattice() }, ball);
    assert!(matches!(contour(&flat, 0.0, 0.1, Placement::Lattice, PLENTY, &run), Err(Error::Invalid(_))));
    assert!(contour(&field, 50.0, 0.1, Placement::Lattice, PLENTY, &run).expect("nothing").points.is_empty());
}

fn axis(field: &SampledField, side: Where, angle: f64) -> MedialAxis {
    medial_axis(field, side, angle, &Run::with_threads(2)).expect("a medial axis")
}

#[test]
fn the_medial_axis_of_a_box_is_its_roof() {
    let half = DVec3::new(1.0, 0.7, 0.5);
    let spacing = 0.04;
    let lattice = Lattice { origin: DVec3::new(-1.2, -0.9, -0.7), spacing: DVec3::splat(spacing), first: [0; 3], shape: [61, 46, 36] };
    let field = sampled(lattice, |p| block(half, p));
    let found = axis(&field, Where::Inside, 60.0);
    // Off the axis a point is nearer to one face than to all others.
    let slack = |p: DVec3| {
        let mut ways = (half - p.abs()).to_array();
        ways.sort_by(f64::total_cmp);
        ways[1] - ways[0]
    };
    for ((&p, &radius), &angle) in found.points.iter().zip(&found.radii).zip(&found.angles) {
        // Between the two middle faces the middle plane counts, whose ways are those of one face and its opposite.
        let opposite = p.abs().min_element();
        assert!(slack(p) < 1.5 * spacing || opposite < 1.5 * spacing, "{p} is off the axis, {angle} degrees");
        assert!((radius + block(half, p)).abs() < spacing, "radius {radius} at {p}");
    }
    // Every place of the roof, seen at 90 degrees or more, has a point beside it.
    let mut random = Random::new(3);
    for _ in 0..500 {
        let mut p = DVec3::new(random.between(-0.45, 0.45), random.between(-0.15, 0.15), 0.0);
        if random.unit() < 0.5 {
            // The slope between the faces at high y and high z.
            let deep = random.between(0.12, 0.4);
            p = DVec3::new(random.between(-0.5, 0.5), half.y - deep, half.z - deep);
        }
        let nearest = found.points.iter().map(|q| (*q - p).length()).fold(f64::INFINITY, f64::min);
        assert!(nearest < 2.0 * spacing, "{p} has no point within {nearest}");
    }
    // Sharper angles leave the middle plane only.
    let middle = axis(&field, Where::Inside, 150.0);
    assert!(!middle.points.is_empty() && middle.points.iter().all(|p| p.z.abs() < 1.5 * spacing));
    assert!(axis(&field, Where::Outside, 60.0).points.is_empty(), "a box is convex");
}

#[test]
fn the_medial_axis_of_a_ball_is_its_centre() {
    let center = DVec3::new(-0.3, 0.1, 0.0);
    let found = axis(&sampled(lattice(), ball), Where::Inside, 60.0);
    assert!(!found.points.is_empty());
    assert!(found.points.iter().all(|p| (*p - center).length() < 3.0 * lattice().spacing.max_element()), "{:?}", found.points);
    let shell = axis(&sampled(lattice(), |p| -ball(p)), Where::Outside, 60.0);
    assert_eq!(found, shell);
}

#[test]
fn between_two_balls_lies_a_plane() {
    let lattice = Lattice { origin: DVec3::new(-2.0, -1.0, -1.0), spacing: DVec3::splat(0.05), first: [0; 3], shape: [81, 41, 41] };
    let away = |p: DVec3, x: f64| (p - DVec3::new(x, 0.0, 0.0)).length() - 0.5;
    let field = sampled(lattice, |p| away(p, -1.0).min(away(p, 1.0)));
    let found = axis(&field, Where::Outside, 60.0);
    assert!(found.points.len() > 500);
    assert!(found.points.iter().all(|p| p.x.abs() < 0.1), "{:?}", found.points.iter().find(|p| p.x.abs() >= 0.1));
}

#[test]
fn angles_that_cannot_be_are_refused() {
    let field = sampled(lattice(), ball);
    for angle in [0.0, -1.0, 181.0, f64::NAN] {
        assert!(matches!(medial_axis(&field, Where::Inside, angle, &Run::default()), Err(Error::Invalid(_))));
    }
}

#[test]
fn results_do_not_depend_on_threads() {
    let field = sampled(lattice(), ball);
    check_threads("a contour", |run| contour(&field, 0.1, 0.03, Placement::Projected, PLENTY, run)).unwrap_or_else(|b| panic!("{b}"));
    check_threads("a medial axis", |run| medial_axis(&field, Where::Inside, 40.0, run)).unwrap_or_else(|b| panic!("{b}"));
}
