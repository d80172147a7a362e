//! `Facet` against an exact judge: slivers, needles, caps, points and segments, at every scale.

mod nasty;

use nasty::judge;
use truefield::DVec3;
use truefield::geom::Facet;
use truefield::laws::Random;

const EPSILON: f64 = f64::EPSILON;

/// What `Facet` promises, as a share of |p - a| and the edge lengths: a few ulp.
const PROMISE: f64 = 4.0 * EPSILON;

/// A triangle of about unit size with a relative height of `height`.
fn triangle(kind: usize, height: f64, random: &mut Random) -> [DVec3; 3] {
    let x = random.direction();
    let y = x.cross(random.direction()).normalize();
    let at = |u: f64, v: f64| x * u + y * v;
    let mut corners = match kind {
        // Needle: one short edge.
        0 => [at(0.0, 0.0), at(1.0, 0.0), at(1.0, height)],
        // Cap: one corner almost on the opposite edge.
        1 => [at(0.0, 0.0), at(1.0, 0.0), at(random.unit(), height)],
        // Cap whose foot is close to a corner.
        2 => [at(0.0, 0.0), at(1.0, 0.0), at(height * random.between(-3.0, 3.0), height)],
        // Two thin angles.
        3 => [at(0.0, 0.0), at(1.0, 0.0), at(random.between(1.0, 3.0), height)],
        // A segment.
        4 => [at(0.0, 0.0), at(1.0, 0.0), at(random.between(-1.0, 2.0), 0.0)],
        // A segment with a double corner.
        5 => [at(0.0, 0.0), at(1.0, 0.0), at(1.0, 0.0)],
        // A point.
        6 => [at(0.3, 0.2); 3],
        // Any.
        _ => [at(random.unit(), random.unit()), at(random.unit(), random.unit()), at(random.unit(), random.unit())],
    };
    let turn = random.below(3);
    corners.rotate_left(turn);
    if random.bits() & 1 == 0 {
        corners.swap(0, 1);
    }
    corners
}

/// Points where something can go wrong: over the inside at every height, at and around corners and edges, far away.
fn point(corners: [DVec3; 3], height: f64, random: &mut Random) -> DVec3 {
    let [a, b, c] = corners;
    let (u, v) = (random.unit(), random.unit());
    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
    let size = (b - a).length().max((c - a).length()).max(f64::MIN_POSITIVE);
    let inside = a + (b - a) * u + (c - a) * v;
    let normal = (b - a).cross(c - a).try_normalize().unwrap_or_else(|| random.direction());
    let any = random.direction() * size;
    match random.below(10) {
        0 => a + any * random.length(1e-3, 3.0),
        1 => inside,
        2 => inside + normal * size * random.length(1e-17, 1e3),
        3 => inside + normal * size * height * random.between(-3.0, 3.0),
        4 => corners[random.below(3)],
        5 => corners[random.below(3)] + any * random.length(1e-18, 1.0),
        6 => a + (b - a) * random.between(-1.0, 2.0),
        7 => b + (c - b) * random.between(-1.0, 2.0) + any * random.length(1e-18, 1e-3),
        8 => inside + any * height * random.between(0.0, 2.0),
        _ => a + any * random.length(1e1, 1e6),
    }
}

/// The largest error as a share of |p - a| + edge lengths, and what had it.
fn worst(seed: u64, count: usize, scale: impl Fn(&mut Random) -> f64, offset: f64) -> (f64, String) {
    let mut random = Random::new(seed);
    let mut worst = (0.0, String::new());
    for round in 0..count {
        let height = random.length(1e-17, 1.0);
        let factor = scale(&mut random);
        let shift = random.direction() * offset;
        let corners = triangle(round % 8, height, &mut random).map(|v| (v + shift) * factor);
        let [a, b, c] = corners;
        let facet = Facet::new(a, b, c);
        for _ in 0..4 {
            let p = point(corners, height, &mut random);
            let truth = judge::distance(corners, p);
            let found = facet.nearest(p);
            let size = (p - a).length() + (b - a).length() + (c - a).length() + (c - b).length();
            assert_eq!(found.distance_squared.to_bits(), facet.distance_squared(p).to_bits());
            let error = (found.distance_squared.sqrt() - truth).abs();
            // The reported point is rounded where it lies, which may be far from the origin.
            let place = ((found.point - p).length() - truth).abs().max(judge::distance(corners, found.point))
                - EPSILON * 2.0 * found.point.length();
            for error in [error, place] {
                assert!(!error.is_nan());
                let share = if error > 0.0 { error / size } else { 0.0 };
                if share > worst.0 {
                    worst = (share, format!("{corners:?} asked at {p:?}: {found:?}, truth {truth:e}"));
                }
            }
        }
    }
    worst
}

fn attack(count: usize, scale: impl Fn(&mut Random) -> f64 + Sync, offset: f64) {
    let results: Vec<(f64, String)> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..2)
            .map(|seed| {
                scope.spawn({
                    let scale = &scale;
                    move || worst(seed, count / 2, scale, offset)
                })
            })
            .collect();
        workers.into_iter().map(|w| w.join().expect("no panic")).collect()
    });
    for (share, what) in results {
        assert!(share <= PROMISE, "off by {share:e} of the lengths involved: {what}");
    }
}

#[test]
fn the_judge_knows_simple_triangles() {
    let corners = [DVec3::ZERO, DVec3::X * 4.0, DVec3::Y * 3.0];
    for (p, truth) in [
        (DVec3::new(1.0, 1.0, -2.0), 2.0),
        (DVec3::new(-3.0, -4.0, 0.0), 5.0),
        (DVec3::new(2.0, -1.0, 0.0), 1.0),
        (DVec3::new(-2.0, 1.0, 0.0), 2.0),
        (DVec3::new(4.0, 3.0, 0.0), 2.4),
        (DVec3::new(7.0, -4.0, 0.0), 5.0),
        (DVec3::new(0.0, 6.0, 4.0), 5.0),
        (DVec3::new(1e-300, 0.0, 0.0), 0.0),
    ] {
        assert_eq!(judge::distance(corners, p), truth, "{p}");
        assert_eq!(judge::distance(corners.map(|v| v * 2f64.powi(-900)), p * 2f64.powi(-900)), truth * 2f64.powi(-900), "{p}");
        let [a, b, c] = corners;
        assert_eq!(judge::distance([c, a, b], p), truth, "{p}");
    }
    // 0.1 is not a tenth: the exact distance between neighbouring doubles.
    assert_eq!(judge::distance([DVec3::splat(0.1); 3], DVec3::new(0.1f64.next_up(), 0.1, 0.1)), 0.1f64.next_up() - 0.1);
    // A segment and a point.
    assert_eq!(judge::distance([DVec3::ZERO, DVec3::X, DVec3::X * 3.0], DVec3::new(2.0, 2.0, 0.0)), 2.0);
    assert_eq!(judge::distance([DVec3::ONE; 3], DVec3::new(1.0, 4.0, 5.0)), 5.0);
}

#[test]
fn slivers_needles_caps_and_degenerate_triangles() {
    attack(200_000, |_| 1.0, 0.0);
}

#[test]
fn far_from_the_origin() {
    attack(40_000, |_| 1.0, 1e6);
}

#[test]
fn from_the_smallest_to_the_largest_scale() {
    attack(80_000, |random| random.length(1e-90, 1e90), 0.0);
}
