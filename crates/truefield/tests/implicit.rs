//! Shapes from formulas: the true distance, against shapes whose distance is known and against brute force.

mod residual;

use std::f64::consts::PI;

use residual::residuals;
use truefield::laws::{Random, check_distance, check_lipschitz, check_threads};
use truefield::source::implicit::{Binary, Expression, Implicit, Unary};
use truefield::{Aabb, Cancel, DVec3, Distance, Interval, Run, Source};

fn axes() -> [Expression; 3] {
    Expression::axes()
}

fn square(e: &Expression) -> Expression {
    e.unary(Unary::Square)
}

fn cube(half: f64) -> Aabb {
    Aabb::new(DVec3::splat(-half), DVec3::splat(half))
}

fn shape(expression: &Expression, domain: Aabb) -> Implicit {
    Implicit::new(expression, domain, &Run::with_threads(2)).expect("a shape")
}

fn value(shape: &Implicit, p: DVec3) -> f64 {
    let mut out = [0.0];
    shape.values(&[p], &mut out).expect("a value");
    out[0]
}

/// A ball of radius 1, whose formula is not its distance.
fn ball() -> Expression {
    let [x, y, z] = axes();
    square(&x) + square(&y) + square(&z) - 1.0
}

fn torus(major: f64, minor: f64) -> Expression {
    let [x, y, z] = axes();
    let ring = (square(&x) + square(&y)).unary(Unary::SquareRoot) - major;
    square(&ring) + square(&z) - minor * minor
}

fn gyroid() -> Expression {
    let [x, y, z] = axes();
    let wave = |a: &Expression, b: &Expression| &a.unary(Unary::Sine) * &b.unary(Unary::Cosine);
    wave(&x, &y) + wave(&y, &z) + wave(&z, &x)
}

fn points(random: &mut Random, within: &Aabb, count: usize) -> Vec<DVec3> {
    (0..count).map(|_| random.within(within)).collect()
}

/// How wide the widest interval is, and whether it and the value are right.
fn compare(shape: &Implicit, judge: impl Fn(DVec3) -> f64, points: &[DVec3]) -> f64 {
    let mut widest = 0.0_f64;
    for &p in points {
        let (at, truth) = (shape.at(p), judge(p));
        let rounding = 1e-14 * (1.0 + p.length());
        assert!(at.widen(rounding).contains(truth), "{at:?} at {p} does not hold {truth:?}");
        let value = value(shape, p);
        assert!(at.widen(rounding).contains(value), "{at:?} at {p} does not hold the value {value:?}");
        assert!((value - truth).abs() <= shape.noise() + rounding, "{value:?} at {p} is not {truth:?}");
        widest = widest.max(at.width());
    }
    widest
}

#[test]
fn a_ball_has_the_distance_of_a_ball() {
    let ball = shape(&ball(), cube(1.5));
    let mut random = Random::new(1);
    let mut places = points(&mut random, &cube(1.5), 3000);
    places.extend(points(&mut random, &cube(40.0), 500));
    places.extend((0..500).map(|_| random.direction() * (1.0 + random.between(-1.0, 1.0) * random.length(1e-16, 1e-1))));
    let judge = |p: DVec3| p.length() - 1.0;
    let widest = compare(&ball, judge, &places);
    assert!(widest < 1e-5, "an interval is {widest} wide");
    check_distance(&ball, judge, &places[..400], 1e-13).unwrap_or_else(|broken| panic!("{broken}"));
    // Off the middle, to rounding.
    assert!(places.iter().filter(|p| p.length() > 0.5).all(|&p| ball.at(p).width() < 1e-9));
    // The middle is as far from everything.
    let middle = ball.at(DVec3::ZERO);
    assert!(middle.contains(-1.0) && middle.width() < 1e-5, "{middle:?}");
    let extent = ball.extent().expect("an extent");
    assert!(extent.contains(DVec3::NEG_ONE) && extent.contains(DVec3::ONE) && extent.size().max_element() < 2.4, "{extent:?}");
}

#[test]
fn a_torus_has_the_distance_of_a_torus() {
    let torus = shape(&torus(1.0, 0.4), cube(1.7));
    let mut random = Random::new(2);
    let judge = |p: DVec3| DVec3::new(p.x.hypot(p.y) - 1.0, p.z, 0.0).length() - 0.4;
    let widest = compare(&torus, judge, &points(&mut random, &cube(1.7), 3000));
    assert!(widest < 1e-5, "an interval is {widest} wide");
}

/// The distance to a surface, by Newton's method from all samples next to it.
struct Samples {
    points: Vec<DVec3>,
    spacing: f64,
}

impl Samples {
    /// Points of the gyroid, with a hundredth between neighbours.
    fn of_gyroid(domain: &Aabb) -> Self {
        let steps = 160;
        let spacing = domain.size().x / f64::from(steps);
        let gradient = |p: DVec3| {
            let (s, c) = (DVec3::new(p.x.sin(), p.y.sin(), p.z.sin()), DVec3::new(p.x.cos(), p.y.cos(), p.z.cos()));
            let value = s.x * c.y + s.y * c.z + s.z * c.x;
            (value, DVec3::new(c.x * c.y - s.z * s.x, c.y * c.z - s.x * s.y, c.z * c.x - s.y * s.z))
        };
        let mut points = Vec::new();
        for i in 0..steps * steps * steps {
            let cell = DVec3::new(f64::from(i % steps), f64::from(i / steps % steps), f64::from(i / steps / steps));
            let mut p = domain.min + (cell + 0.5) * spacing;
            let (value, slope) = gradient(p);
            if value.abs() > slope.length() * spacing {
                continue;
            }
            for _ in 0..6 {
                let (value, slope) = gradient(p);
                p -= slope * (value / slope.length_squared());
            }
            if domain.contains(p) && gradient(p).0.abs() < 1e-13 {
                points.push(p);
            }
        }
        Self { points, spacing }
    }

    fn nearest(&self, p: DVec3) -> f64 {
        self.points.iter().map(|q| (*q - p).length_squared()).fold(f64::INFINITY, f64::min).sqrt()
    }
}

#[test]
fn a_gyroid_is_as_far_as_its_nearest_sample() {
    // Not a whole number of waves, where the surface would run through the corners.
    let domain = cube(3.0);
    let gyroid = shape(&gyroid(), domain);
    let samples = Samples::of_gyroid(&domain);
    let mut random = Random::new(3);
    let mut widest = 0.0_f64;
    for p in points(&mut random, &domain, 400) {
        let at = gyroid.at(p);
        let faces = (p - domain.min).min(domain.max - p).min_element();
        let nearest = samples.nearest(p);
        // Inside, the faces of the domain are surface too.
        let truth = if at.upper < 0.0 { nearest.min(faces) } else { nearest };
        let size = Interval { lower: at.lower.abs().min(at.upper.abs()), upper: at.lower.abs().max(at.upper.abs()) };
        // Samples are no nearer than the surface, and farther by what lies between them.
        assert!(size.lower <= truth + 1e-12, "{at:?} at {p}, but a sample is {truth} away");
        assert!(size.upper >= truth - samples.spacing, "{at:?} at {p}, but the nearest sample is {truth} away");
        widest = widest.max(at.width());
    }
    assert!(widest < 2e-5, "an interval is {widest} wide");
    check_lipschitz(&gyroid, &points(&mut random, &domain.grow(1.0), 1500), 1e-12).unwrap_or_else(|broken| panic!("{broken}"));
}

/// Along the normal these bend much more than their surface does, to either side.
#[test]
fn what_bends_along_the_normal_only_is_as_far_as_it_is() {
    let [x, y, z] = axes();
    let level = |steep: f64| {
        let power = ((square(&x) + square(&y) + square(&z) - 1.0) * steep).unary(Unary::Exponential);
        if steep < 0.0 { Expression::constant(1.0) - power } else { power - 1.0 }
    };
    let mut random = Random::new(12);
    for steep in [-6.0, -2.0, 3.0] {
        let ball = shape(&level(steep), cube(1.5));
        let judge = |p: DVec3| p.length() - 1.0;
        for domain in [cube(1.5), cube(6.0)] {
            let widest = compare(&ball, judge, &points(&mut random, &domain, 1500));
            assert!(widest < 2e-5, "an interval is {widest} wide");
        }
    }
}

#[test]
fn the_domain_bounds_the_solid() {
    // A half space in a box is a smaller box.
    let [x, y, z] = axes();
    let plane = shape(&(x.clone() + 0.0), cube(1.0));
    let half = Aabb::new(DVec3::NEG_ONE, DVec3::new(0.0, 1.0, 1.0));
    let judge = move |p: DVec3| {
        let out = half.distance_squared(p).sqrt();
        if out > 0.0 { out } else { -(p - half.min).min(half.max - p).min_element() }
    };
    let mut random = Random::new(4);
    let widest = compare(&plane, judge, &points(&mut random, &cube(3.0), 3000));
    assert!(widest < 1e-5, "an interval is {widest} wide");
    let extent = plane.extent().expect("an extent");
    assert!(extent.contains(half.min) && extent.contains(half.max));
    // A tilted one meets faces, edges and a corner: the nearest point is often on the rim.
    let tilted = shape(&(&(&x + &y) + &z), cube(1.0));
    let normal = DVec3::ONE / 3.0_f64.sqrt();
    let solid = move |p: DVec3| {
        // Dykstra's alternating projections onto the box and the half space.
        let (mut at, mut box_part, mut plane_part) = (p, DVec3::ZERO, DVec3::ZERO);
        for _ in 0..4000 {
            let before = at;
            let onto = (at + box_part).clamp(DVec3::NEG_ONE, DVec3::ONE);
            box_part = at + box_part - onto;
            let moved = onto + plane_part;
            at = moved - normal * moved.dot(normal).max(0.0);
            plane_part = moved - at;
            if (at - before).length() < 1e-15 && (onto - at).length() < 1e-15 {
                break;
            }
        }
        at
    };
    for p in points(&mut random, &cube(2.5), 600) {
        let inside = cube(1.0).contains(p) && p.dot(normal) < 0.0;
        let truth = if inside { p.dot(normal).max(-(1.0 - p.abs().max_element())) } else { (solid(p) - p).length() };
        let at = tilted.at(p);
        assert!(at.widen(1e-9).contains(truth), "{at:?} at {p} is not {truth}");
        assert!(at.width() < 1e-5, "{at:?} at {p} is wide");
    }
}

#[test]
fn kinks_and_poles_and_cusps_stay_honest() {
    let [x, y, z] = axes();
    let mut random = Random::new(5);
    // A box by maxima: edges and corners.
    let half = |e: &Expression, h: f64| e.unary(Unary::Absolute) - h;
    let max = |a: Expression, b: Expression| a.binary(Binary::Maximum, &b);
    let block = shape(&max(max(half(&x, 0.5), half(&y, 0.3)), half(&z, 0.2)), cube(1.0));
    let judge = |p: DVec3| {
        let q = p.abs() - DVec3::new(0.5, 0.3, 0.2);
        q.max(DVec3::ZERO).length() + q.max_element().min(0.0)
    };
    let widest = compare(&block, judge, &points(&mut random, &cube(1.0), 60));
    assert!(widest <= 2.0 * block.noise(), "an interval is {widest} wide");
    // Signs change through a pole as well: 1 / x is negative on the left.
    let pole = shape(&(&Expression::constant(1.0) / &x), cube(1.0));
    for p in points(&mut random, &cube(0.9), 60) {
        let truth = if p.x > 0.0 { p.x } else { p.x.max(-(1.0 - p.abs().max_element())) };
        let at = pole.at(p);
        assert!(at.contains(truth) && at.width() < 1e-3, "{at:?} at {p} is not {truth}");
    }
    // A sheet that touches zero without crossing cannot be told from none: the interval says so.
    let touching = shape(&(square(&x) * (&x + &y) + 0.0), cube(1.0));
    for p in points(&mut random, &cube(0.9), 20) {
        let at = touching.at(p);
        let (sheet, cross) = (p.x.abs(), ((p.x + p.y) / 2.0_f64.sqrt()).abs());
        assert!(at.lower.abs().min(at.upper.abs()) <= cross + 1e-9 && at.lower <= at.upper, "{at:?} at {p}, {sheet} and {cross}");
    }
}

/// Zeros that the formula only touches are no surface.
#[test]
fn touching_zero_is_no_surface() {
    let run = Run::with_threads(1);
    let [x, y, _] = axes();
    let doubled = square(&ball());
    for formula in [doubled.clone(), ball().unary(Unary::Absolute), square(&x), x.clone() * 0.0, square(&x) * ball().unary(Unary::Absolute)]
    {
        let refusal = Implicit::new(&formula, cube(1.5), &run).expect_err("no inside").to_string();
        assert!(refusal.contains("nowhere negative") && refusal.contains("subtract"), "{refusal}");
    }
    // All is inside but for zeros that are touched from there.
    let inner = shape(&(-doubled), cube(1.5));
    let mut random = Random::new(21);
    let mut places = points(&mut random, &cube(1.4), 100);
    places.extend((0..50).map(|_| random.direction()));
    places.push(DVec3::X);
    for p in places {
        let (at, depth) = (inner.at(p), 1.5 - p.abs().max_element());
        assert!(at.contains(-depth) && at.width() < 1e-9, "{at:?} at {p} is not -{depth}");
    }
    // x^2 (x + y): the plane x = 0 is touched from outside where y > 0, from inside where y < 0.
    let wedge = shape(&(square(&x) * (&x + &y)), cube(1.0));
    for n in 0..60 {
        let mut p = random.within(&cube(0.3));
        if n % 2 == 0 {
            p.x = 0.0;
        }
        let (at, truth) = (wedge.at(p), (p.x + p.y) / 2.0_f64.sqrt());
        assert!(at.widen(1e-14).contains(truth), "{at:?} at {p} is not {truth}");
        assert!(at.width() < 1e-2 && (at.lower < 0.0) == (truth < 0.0), "{at:?} at {p} is not {truth}");
    }
    // Written out, x^2 - x + 1/4 + y^2 + z^2 cannot be told from what is negative somewhere next to (1/2, 0, 0).
    let [x, y, z] = axes();
    let point = shape(&(square(&x) - (x - 0.25) + square(&y) + square(&z)), cube(1.0));
    for p in points(&mut random, &cube(2.0), 100) {
        let at = point.at(p);
        assert!(at.upper == f64::INFINITY && at.lower <= (p - DVec3::X * 0.5).length(), "{at:?} at {p}");
        assert!(at.lower >= (p - DVec3::X * 0.5).length() - 5e-3, "{at:?} at {p}");
    }
}

type Value = fn(DVec3) -> f64;

/// Zeros that fill a room between both signs: the surface is somewhere in it, and no two bounds contradict each other.
#[test]
fn rooms_of_zeros_hide_no_surface() {
    let [x, y, _] = axes();
    let least = |a: Expression, b: Expression| a.binary(Binary::Minimum, &b);
    let most = |a: Expression, b: Expression| a.binary(Binary::Maximum, &b);
    let nothing = || x.clone() * 0.0;
    let formulas: [(Expression, Value); 5] = [
        ((x.clone() - 0.3).unary(Unary::Floor), |p| (p.x - 0.3).floor()),
        (most(ball(), nothing()) + least(ball() + 0.2, nothing()), |p| {
            (p.length_squared() - 1.0).max(0.0) + (p.length_squared() - 0.8).min(0.0)
        }),
        (least(x.clone(), nothing()) + most(x.clone() - 1.0, nothing()), |p| p.x.min(0.0) + (p.x - 1.0).max(0.0)),
        (least(ball(), nothing()), |p| (p.length_squared() - 1.0).min(0.0)),
        // A room of zeros next to the middle of a face only.
        (least(x.clone(), nothing()) * (square(&y) + 1.0) + most(x.clone() + square(&y) - 0.04, nothing()), |p| {
            p.x.min(0.0) * (p.y * p.y + 1.0) + (p.x + p.y * p.y - 0.04).max(0.0)
        }),
    ];
    let (mut random, domain) = (Random::new(23), cube(2.0));
    for (number, (formula, value)) in formulas.iter().enumerate() {
        let shape = shape(formula, domain);
        let places: Vec<DVec3> = points(&mut random, &cube(1.9), 60);
        let values: Vec<f64> = places.iter().map(|&p| value(p)).collect();
        let bounds: Vec<Interval> = places.iter().map(|&p| shape.at(p)).collect();
        for (i, a) in bounds.iter().enumerate() {
            assert!(!(values[i] < 0.0 && a.lower > 0.0 || values[i] > 0.0 && a.upper < 0.0), "{number}: {a:?} at {}", places[i]);
            for (j, b) in bounds.iter().enumerate() {
                let apart = (places[i] - places[j]).length() + 1e-9;
                assert!(b.lower - a.upper <= apart, "{number}: {a:?} at {} and {b:?} at {}", places[i], places[j]);
            }
        }
    }
}

#[test]
fn what_is_no_shape_is_refused() {
    let run = Run::with_threads(1);
    let refused = |e: &Expression, domain: Aabb| Implicit::new(e, domain, &run).expect_err("a refusal").to_string();
    assert!(refused(&(ball() + 5.0), cube(1.0)).contains("positive"), "no inside");
    assert!(refused(&ball(), Aabb::new(DVec3::ZERO, DVec3::new(1.0, 0.0, 1.0))).contains("domain"), "flat");
    assert!(refused(&ball(), Aabb::new(DVec3::ZERO, DVec3::splat(f64::INFINITY))).contains("finite"), "endless");
    assert!(refused(&(ball() + f64::NAN), cube(1.0)).contains("finite"), "not a number");
    // Where a root is not defined, the shape cannot be asked, and says where.
    let [x, ..] = axes();
    let root = shape(&(x.unary(Unary::SquareRoot) - 0.5), cube(1.0));
    let failure = root.values(&[DVec3::new(-0.5, 0.0, 0.0)], &mut [0.0]).expect_err("undefined").to_string();
    assert!(failure.contains("not a number"), "{failure}");
    assert!(root.at(DVec3::new(-0.5, 0.0, 0.0)).contains(0.5), "nothing is promised there");
    // All of the domain is a box.
    let full = shape(&(ball() - 100.0), cube(1.0));
    assert!(full.at(DVec3::ZERO).contains(-1.0) && full.at(DVec3::new(3.0, 0.0, 0.0)).contains(2.0));
}

#[test]
fn bends_hold_second_differences_and_slack_holds_the_rest() {
    let mut random = Random::new(6);
    let domain = cube(1.7);
    let wavy = gyroid();
    let shapes = [(shape(&ball(), cube(1.5)), 1.4), (shape(&torus(1.0, 0.4), domain), 1.6), (shape(&wavy, cube(PI)), 2.8)];
    for (shape, size) in &shapes {
        let (mut finite, mut count) = (0, 0);
        for _ in 0..300 {
            let middle = random.within(&cube(*size));
            let half = random.length(1e-3, 0.1);
            let cell = Aabb::new(middle - half, middle + half);
            let (bend, slack) = (shape.bend(&cell), shape.slack(&cell));
            assert!(bend.lower <= bend.upper);
            count += 1;
            finite += usize::from(bend.width().is_finite());
            for _ in 0..4 {
                let (p, direction) = (random.within(&cell), random.direction());
                let step = 0.2 * half;
                let ends = [p - direction * step, p, p + direction * step];
                let [a, b, c] = ends.map(|q| value(shape, q));
                assert!(slack.widen(1e-15).contains(shape.at(p).lower - b) && slack.widen(1e-15).contains(shape.at(p).upper - b));
                if !ends.iter().all(|&q| cell.contains(q)) {
                    continue;
                }
                let second = (a - 2.0 * b + c) / (step * step);
                let rounding = 4.0 * shape.noise() / (step * step);
                assert!(bend.widen(rounding).contains(second), "{second} at {p} over {cell:?}, {bend:?}");
            }
        }
        assert!(finite * 8 > count, "only {finite} of {count} cells are known to be smooth");
    }
}

/// Places as a tree asks for them: lattices of cells, of which many lie on planes of symmetry.
#[test]
fn what_is_said_between_samples_holds() {
    let mut random = Random::new(16);
    let wall = {
        let [x, y, _] = axes();
        x.binary(Binary::Maximum, &y)
    };
    for (expression, size) in [(ball(), 1.5), (torus(1.0, 0.4), 1.7), (gyroid(), PI), (wall, 1.0)] {
        let shape = shape(&expression, cube(size));
        for n in 0..60 {
            let p = random.within(&cube(size * if n % 4 == 0 { 1.3 } else { 0.9 }));
            // Cells off the surface, where the sides are one, and cells across it.
            let scale = size * [0.02, 0.1, 1.0][n % 3];
            residuals("a formula", &shape, p, scale, 2.0 * shape.noise(), &mut random);
        }
    }
}

fn lattices(random: &mut Random, domain: &Aabb, count: usize) -> Vec<DVec3> {
    let mut places = Vec::new();
    for index in 0..count {
        let size = domain.size().x / f64::from(1 << (1 + index % 6));
        let steps = (domain.size().x / size) as usize;
        let mut place = || size * (random.between(0.0, steps as f64)).floor();
        let low = domain.min + DVec3::new(place(), place(), place());
        places.extend((0..125).map(|k| low + DVec3::new(f64::from(k % 5), f64::from(k / 5 % 5), f64::from(k / 25)) * (size / 4.0)));
    }
    places
}

#[test]
fn points_asked_together_are_answered_as_alone() {
    let mut random = Random::new(8);
    let shapes = [(gyroid(), cube(PI)), (gyroid(), cube(2.5)), (torus(1.0, 0.4), cube(1.7)), (ball(), cube(1.5))];
    for (expression, domain) in &shapes {
        let shape = shape(expression, *domain);
        let mut places = lattices(&mut random, domain, 60);
        places.extend(points(&mut random, &domain.grow(1.0), 200));
        let mut together = vec![0.0; places.len()];
        shape.values(&places, &mut together).expect("values");
        let mut bounds = vec![Interval::ALL; places.len()];
        shape.at_many(&places, &mut bounds);
        for ((&p, &together), &bounds) in places.iter().zip(&together).zip(&bounds) {
            assert_eq!(value(&shape, p).to_bits(), together.to_bits(), "at {p}");
            assert_eq!(shape.at(p), bounds, "at {p}");
            assert!(bounds.width() <= 2.0 * shape.noise(), "{bounds:?} at {p}");
        }
    }
}

#[test]
fn bounds_hold_at_many_places() {
    let mut random = Random::new(9);
    let round: fn(DVec3) -> f64 = |p| p.length() - 1.0;
    let ring: fn(DVec3) -> f64 = |p| DVec3::new(p.x.hypot(p.y) - 1.0, p.z, 0.0).length() - 0.4;
    // A formula that is steep in one place and level in another has the same surface.
    let [x, ..] = axes();
    let uneven = (ball() + 0.0) * (x.unary(Unary::Exponential));
    let judged = [(ball(), cube(1.5), round), (uneven, cube(1.5), round), (torus(1.0, 0.4), cube(1.7), ring)];
    for (expression, domain, judge) in judged {
        let shape = shape(&expression, domain);
        let mut places = points(&mut random, &domain.grow(0.5), 30_000);
        places.extend(lattices(&mut random, &domain, 80));
        let mut bounds = vec![Interval::ALL; places.len()];
        shape.at_many(&places, &mut bounds);
        for (&p, bounds) in places.iter().zip(&bounds) {
            let truth = judge(p);
            assert!(bounds.widen(1e-14 * (1.0 + p.length())).contains(truth), "{bounds:?} at {p} does not hold {truth:?}");
        }
    }
}

#[test]
fn next_to_a_rim_the_surface_is_somewhere() {
    let mut random = Random::new(10);
    for half in [PI, 2.5, 3.0, 1.0] {
        let (domain, gyroid) = (cube(half), shape(&gyroid(), cube(half)));
        for _ in 0..4000 {
            // Next to a face or an edge of the domain, on either side of it.
            let mut p = random.within(&domain);
            for _ in 0..=random.between(0.0, 2.0) as usize {
                let axis = random.between(0.0, 3.0) as usize % 3;
                p[axis] = half.copysign(p[axis]) + random.between(-1.0, 1.0) * random.length(1e-12, 1e-1);
            }
            let at = gyroid.at(p);
            assert!(at.width() <= 2.0 * gyroid.noise(), "{at:?} at {p}");
        }
    }
}

#[test]
fn bends_hold_second_differences_of_many_cells() {
    let mut random = Random::new(11);
    let shapes = [(shape(&ball(), cube(1.5)), 1.4), (shape(&torus(1.0, 0.4), cube(1.7)), 1.6), (shape(&gyroid(), cube(PI)), PI)];
    for (shape, size) in &shapes {
        for _ in 0..2500 {
            let half = random.length(1e-2, 0.25);
            let middle = random.within(&cube(size - half));
            let cell = Aabb::new(middle - half, middle + half);
            let bend = shape.bend(&cell);
            if !(bend.lower > -1e9 || bend.upper < 1e9) {
                continue;
            }
            let (p, direction) = (random.within(&Aabb::new(middle - 0.5 * half, middle + 0.5 * half)), random.direction());
            let step = 0.5 * half;
            let [a, b, c] = [p - direction * step, p, p + direction * step].map(|q| shape.at(q));
            let second = Interval { lower: a.lower - 2.0 * b.upper + c.lower, upper: a.upper - 2.0 * b.lower + c.upper }.widen(1e-14);
            let square = step * step;
            assert!(
                second.upper >= bend.lower * square && second.lower <= bend.upper * square,
                "{second:?} at {p} over {cell:?}, {bend:?}"
            );
        }
    }
}

#[test]
fn building_does_not_depend_on_threads() {
    let mut random = Random::new(7);
    let places = points(&mut random, &cube(3.0), 50);
    check_threads("implicit", |run| {
        let gyroid = Implicit::new(&gyroid(), cube(PI), run)?;
        Ok(places.iter().map(|&p| (gyroid.at(p).lower.to_bits(), gyroid.at(p).upper.to_bits())).collect::<Vec<_>>())
    })
    .unwrap_or_else(|broken| panic!("{broken}"));
}

/// From its middle, all of a ball is as near: bounds meet only after hundreds of thousands of boxes. Values go there, or fail.
#[test]
fn values_are_exact_where_much_of_the_surface_is_as_near() {
    let [x, y, z] = axes();
    let square_of_way = square(&x) + square(&y) + square(&z);
    let ball = shape(&(square_of_way.unary(Unary::SquareRoot) - 1.0), cube(1.5));
    for way in [0.0, 1e-6, 1e-4] {
        let p = DVec3::new(way, 0.5 * way, -way);
        let (truth, at) = (p.length() - 1.0, ball.at(p));
        assert!(at.contains(truth) && (way > 1e-5 || at.width() > 4.0 * ball.noise()), "{at:?} is not wide: it was not cut off");
        let (value, slack) = (value(&ball, p), ball.slack(&Aabb::new(p, p).grow(1e-5)));
        assert!(slack.contains(truth - value) && slack.width() <= 4.0 * ball.noise(), "{value} is not {truth}, {slack:?}");
    }
}

/// Far from the origin, the terms of a ball cancel but for their rounding, which blurs the surface.
#[test]
fn what_rounding_blurs_is_counted() {
    let [x, y, z] = axes();
    for far in [1e3, 1e5, 1e6] {
        let expanded = square(&x) + square(&y) + square(&z) - x.clone() * (2.0 * far) - y.clone() * (4.0 * far) + (5.0 * far * far - 1.0);
        let center = DVec3::new(far, 2.0 * far, 0.0);
        let ball = shape(&expanded, Aabb::new(center - 1.5, center + 1.5));
        let mut random = Random::new(5);
        for _ in 0..500 {
            let p = random.within(&ball.domain());
            let truth = p.distance(center) - 1.0;
            let (at, value, slack) = (ball.at(p), value(&ball, p), ball.slack(&Aabb::new(p, p).grow(1e-5)));
            assert!(at.widen(1e-15 * far).contains(truth), "{truth} is not in {at:?}");
            assert!(slack.widen(1e-15 * far).contains(truth - value), "{value} is not {truth} within {slack:?}");
        }
    }
}

/// A job that is asked to stop does so within one value, and says that it was stopped, whatever that value came to.
#[test]
fn a_long_search_hears_that_its_job_was_cancelled() {
    let [x, y, z] = axes();
    let ball = shape(&((square(&x) + square(&y) + square(&z)).unary(Unary::SquareRoot) - 1.0), cube(1.5));
    let cancel = Cancel::new();
    let run = Run { cancel: &cancel, ..Run::with_threads(1) };
    let stopped = run.blocks("", 1, |_| {
        cancel.cancel();
        ball.values(&[DVec3::ZERO], &mut [0.0])
    });
    assert!(matches!(stopped, Err(truefield::Error::Cancelled)), "{stopped:?}");
    // Nothing of it is left for the next.
    assert!((value(&ball, DVec3::ZERO) + 1.0).abs() <= 2.0 * ball.noise());
}

/// Where a face of the domain touches the surface, leaves leave open how near it is. From the middle of a ball in its cube they
/// are as near as all of it: searches for values end elsewhere than those for bounds, and what is said of values holds of these.
#[test]
fn slack_is_that_of_values_next_to_leaves_that_leave_the_distance_open() {
    let [x, y, z] = axes();
    let square_of_way = square(&x) + square(&y) + square(&z);
    for (half, p) in [(1.0, DVec3::new(1.517e-4, 2.604e-4, 4.926e-4)), (0.9999, DVec3::new(-1.4e-5, 1.3e-5, -2.8e-5))] {
        let ball = shape(&(square_of_way.clone().unary(Unary::SquareRoot) - 1.0), cube(half));
        let truth = (p.length() - 1.0).max(p.abs().max_element() - half);
        let (at, value, slack) = (ball.at(p), value(&ball, p), ball.slack(&Aabb::new(p, p).grow(1e-7)));
        assert!(at.widen(1e-15).contains(truth), "{truth} is not in {at:?}");
        assert!(slack.widen(1e-15).contains(truth - value), "{value} is not {truth} within {slack:?}");
        assert!(at.widen(ball.noise()).contains(value), "{value} is not in {at:?}");
    }
}
