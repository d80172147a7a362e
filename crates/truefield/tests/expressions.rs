//! Formulas: plain values, and intervals that must hold the values of all points of a box, whatever rounding does.

use truefield::laws::Random;
use truefield::source::implicit::{Binary, Expression, Tape, Unary};
use truefield::{Aabb, DVec3, Interval, Run};

const UNARY: [Unary; 11] = [
    Unary::Negative,
    Unary::Absolute,
    Unary::Square,
    Unary::SquareRoot,
    Unary::Sine,
    Unary::Cosine,
    Unary::Tangent,
    Unary::ArcTangent,
    Unary::Exponential,
    Unary::Logarithm,
    Unary::Floor,
];

const BINARY: [Binary; 7] =
    [Binary::Add, Binary::Subtract, Binary::Multiply, Binary::Divide, Binary::Minimum, Binary::Maximum, Binary::ArcTangent2];

fn tape(expression: &Expression) -> Tape {
    Tape::new(expression).expect("a formula")
}

fn value(tape: &Tape, p: DVec3) -> f64 {
    tape.values(&[p], &Run::with_threads(1)).expect("values")[0]
}

/// Numbers of all sizes, whole ones, multiples of a quarter turn, and their neighbours.
fn number(random: &mut Random) -> f64 {
    let sign = if random.below(2) == 0 { 1.0 } else { -1.0 };
    match random.below(9) {
        0 => 0.0,
        1 => sign * random.length(1e-300, 1e300),
        2 => sign * random.length(1e-12, 1e12),
        3 => (random.below(41) as f64) - 20.0,
        4 => ((random.below(81) as f64) - 40.0) * std::f64::consts::FRAC_PI_2,
        5 => (((random.below(81) as f64) - 40.0) * std::f64::consts::FRAC_PI_2).next_up(),
        6 => sign * 5e-324 * random.below(5) as f64,
        _ => random.between(-10.0, 10.0),
    }
}

fn side(random: &mut Random) -> Interval {
    let a = number(random);
    let b = match random.below(4) {
        0 => a,
        1 => a.next_up(),
        2 => a + a.abs() * random.length(1e-16, 1.0),
        _ => number(random),
    };
    Interval { lower: a.min(b), upper: a.max(b) }
}

fn inside(random: &mut Random, side: Interval) -> f64 {
    match random.below(4) {
        0 => side.lower,
        1 => side.upper,
        _ => (side.lower + (side.upper - side.lower) * random.unit()).clamp(side.lower, side.upper),
    }
}

fn cell(random: &mut Random) -> ([Interval; 3], Aabb) {
    let sides = std::array::from_fn(|_| side(random));
    (sides, Aabb::new(DVec3::from_array(sides.map(|s| s.lower)), DVec3::from_array(sides.map(|s| s.upper))))
}

/// Where a value is no number, nothing may be known of it.
fn holds(interval: Interval, value: f64) -> bool {
    if value.is_nan() { interval == Interval::ALL } else { interval.contains(value) }
}

#[test]
fn intervals_of_all_functions_hold_all_values() {
    let [x, y, _] = Expression::axes();
    let mut random = Random::new(1);
    let mut wide = 0;
    for (name, tape) in UNARY
        .iter()
        .map(|&f| (format!("{f:?}"), tape(&x.unary(f))))
        .chain(BINARY.iter().map(|&f| (format!("{f:?}"), tape(&x.binary(f, &y)))))
        .chain([-5, -2, -1, 3, 4, 7].map(|n| (format!("power {n}"), tape(&x.power(n)))))
    {
        for _ in 0..10_000 {
            let (sides, cell) = cell(&mut random);
            let over = tape.over(&cell);
            assert!(over.lower <= over.upper, "{name} over {sides:?} is {over:?}");
            wide += usize::from(over == Interval::ALL);
            for _ in 0..3 {
                let p = DVec3::from_array(sides.map(|s| inside(&mut random, s)));
                let value = value(&tape, p);
                // A whole power in plain numbers is a product with several roundings.
                let near = if name.starts_with("power") { over.widen(1e-14 * value.abs()) } else { over };
                assert!(holds(near, value) || value.is_infinite(), "{name} at {p} is {value:?}, over {sides:?} {over:?}");
            }
        }
    }
    assert!(wide < 24 * 5_000, "{wide} boxes of {} know nothing", 24 * 10_000);
}

#[test]
fn sums_products_quotients_and_roots_are_rounded_outward() {
    // What a fused operation leaves is the exact error of the ends.
    let [x, y, _] = Expression::axes();
    let [sum, product, quotient] = [&x + &y, &x * &y, &x / &y].map(|e| tape(&e));
    let root = tape(&x.unary(Unary::SquareRoot));
    let mut random = Random::new(2);
    for _ in 0..50_000 {
        let (a, b) = (random.between(-10.0, 10.0), random.between(-10.0, 10.0) * random.length(1e-9, 1e9));
        let at = Aabb::new(DVec3::new(a, b, 0.0), DVec3::new(a, b, 0.0));
        let over = product.over(&at);
        assert!(a.mul_add(b, -over.lower) >= 0.0 && a.mul_add(b, -over.upper) <= 0.0, "{a:?} * {b:?} in {over:?}");
        let over = quotient.over(&at);
        let (below, above) = (over.lower.mul_add(b, -a), over.upper.mul_add(b, -a));
        assert!(below * b.signum() <= 0.0 && above * b.signum() >= 0.0, "{a:?} / {b:?} in {over:?}");
        let over = sum.over(&at);
        let rounded = a + b;
        let (big, small) = if a.abs() > b.abs() { (a, b) } else { (b, a) };
        let error = small - (rounded - big);
        assert!(over.lower <= rounded && rounded <= over.upper, "{a:?} + {b:?} in {over:?}");
        assert!(error >= 0.0 || over.lower < rounded, "{a:?} + {b:?} is below {rounded:?}, {over:?}");
        assert!(error <= 0.0 || over.upper > rounded, "{a:?} + {b:?} is above {rounded:?}, {over:?}");
        let over = root.over(&Aabb::new(DVec3::splat(a.abs()), DVec3::splat(a.abs())));
        assert!(over.lower.mul_add(over.lower, -a.abs()) <= 0.0 && over.upper.mul_add(over.upper, -a.abs()) >= 0.0);
        assert!(over.width() <= 4.0 * f64::EPSILON * a.abs().sqrt(), "{over:?} is wide");
    }
}

#[test]
fn what_is_not_defined_is_not_known() {
    let [x, y, _] = Expression::axes();
    let unit = Aabb::new(DVec3::splat(-1.0), DVec3::ONE);
    let undefined = [
        &Expression::constant(1.0) / &x,
        x.unary(Unary::SquareRoot),
        x.unary(Unary::Logarithm),
        x.power(-3),
        (x.clone() * 2.0).unary(Unary::Tangent),
    ];
    for expression in undefined {
        let over = tape(&expression).over(&unit);
        assert_eq!(over, Interval::ALL, "{expression:?}");
        // And what is made of it is not known either.
        for function in [Unary::Absolute, Unary::Square, Unary::Sine, Unary::ArcTangent, Unary::Exponential, Unary::Negative] {
            assert_eq!(tape(&expression.unary(function)).over(&unit), Interval::ALL, "{function:?} of {expression:?}");
        }
        for function in BINARY {
            assert_eq!(tape(&expression.binary(function, &y)).over(&unit), Interval::ALL, "{function:?} of {expression:?}");
        }
    }
    // A root that may not be negative is defined.
    let length = (x.unary(Unary::Square) + y.unary(Unary::Square)).unary(Unary::SquareRoot);
    let over = tape(&length).over(&unit);
    assert!(over.lower == 0.0 && (over.upper - 2.0_f64.sqrt()).abs() < 1e-14, "{over:?}");
}

/// A formula of random operations that is defined nearly everywhere.
fn formula(random: &mut Random, size: usize) -> Expression {
    let mut parts = Expression::axes().to_vec();
    parts.push(Expression::constant(random.between(-2.0, 2.0)));
    for _ in 0..size {
        let pick = |random: &mut Random, parts: &[Expression]| parts[random.below(parts.len())].clone();
        let (a, b) = (pick(random, &parts), pick(random, &parts));
        parts.push(match random.below(4) {
            0 => a.unary(UNARY[random.below(UNARY.len())]),
            1 => a.power([-1, 2, 3, 4][random.below(4)]),
            _ => a.binary(BINARY[random.below(BINARY.len())], &b),
        });
    }
    parts.pop().expect("a part")
}

#[test]
fn random_formulas_are_enclosed_with_their_derivatives() {
    let mut random = Random::new(3);
    let mut judged = [0; 3];
    for _ in 0..2000 {
        let formula = formula(&mut random, 6);
        let tape = tape(&formula);
        let middle = DVec3::new(random.between(-3.0, 3.0), random.between(-3.0, 3.0), random.between(-3.0, 3.0));
        let half = random.length(1e-3, 2.0);
        let cell = Aabb::new(middle - half, middle + half);
        let (over, slopes, bends) = (tape.over(&cell), tape.slopes(&cell), tape.bends(&cell));
        for _ in 0..10 {
            let p = random.within(&cell);
            let value = value(&tape, p);
            assert!(holds(over, value), "{formula:?} at {p} is {value:?}, {over:?} over {cell:?}");
            judged[0] += usize::from(over != Interval::ALL);
            // Means of slopes along the box are values of the derivative, up to the rounding of differences.
            for axis in 0..3 {
                let step = 1e-4 * half;
                let mut q = p;
                q[axis] = (p[axis] + step).min(cell.max[axis]);
                let way = q[axis] - p[axis];
                if !(way > 0.0) || !slopes[axis].width().is_finite() {
                    continue;
                }
                let [here, there] = [p, q].map(|p| self::value(&tape, p));
                if !here.is_finite() || !there.is_finite() {
                    continue;
                }
                let slope = (there - here) / way;
                let rounding = 1e-13 * (over.lower.abs() + over.upper.abs() + 1e3) / way;
                assert!(slopes[axis].widen(rounding).contains(slope), "{formula:?}: slope {slope} of axis {axis} at {p}, {slopes:?}");
                judged[1] += 1;
                if !bends[axis].width().is_finite() {
                    continue;
                }
                let [here, there] = [p, q].map(|p| tape.gradient(p)[axis]);
                let bend = (there - here) / way;
                let rounding = 1e-12 * (slopes[axis].lower.abs() + slopes[axis].upper.abs() + 1e3) / way;
                assert!(bends[axis].widen(rounding).contains(bend), "{formula:?}: bend {bend} of axis {axis} at {p}, {bends:?}");
                judged[2] += 1;
            }
        }
    }
    assert!(judged.iter().all(|&n| n > 5_000), "judged only {judged:?}");
}

#[test]
fn equal_parts_are_computed_once() {
    let [x, y, z] = Expression::axes();
    let length = || x.unary(Unary::Square) + y.unary(Unary::Square);
    let twice = (length() * 2.0) + (&y * &y + &x * &x).unary(Unary::SquareRoot);
    // x, y, 2, two squares, their sum, its root, its double, the sum of both.
    assert_eq!(tape(&twice).len(), 9);
    assert_eq!(tape(&(z.clone() - z)).len(), 2);
}

#[test]
fn a_sum_of_a_million_terms_is_let_go_and_refused() {
    let [x, ..] = Expression::axes();
    let mut sum = x.clone();
    for index in 0..1_100_000 {
        sum = sum + f64::from(index);
    }
    let refusal = Tape::new(&sum).expect_err("too long");
    assert!(refusal.to_string().contains("operations"), "{refusal}");
    let refusal = Tape::new(&(x * f64::NAN)).expect_err("not finite");
    assert!(refusal.to_string().contains("finite"), "{refusal}");
}

#[test]
fn values_do_not_depend_on_threads() {
    let [x, y, z] = Expression::axes();
    let formula = (&x * &y).unary(Unary::Sine) + z.unary(Unary::Exponential);
    let tape = tape(&formula);
    let mut random = Random::new(5);
    let points: Vec<DVec3> = (0..10_001).map(|_| random.direction() * 3.0).collect();
    let alone = tape.values(&points, &Run::with_threads(1)).expect("values");
    assert_eq!(alone, tape.values(&points, &Run::with_threads(3)).expect("values"));
    for (p, found) in points.iter().zip(alone) {
        assert_eq!(found.to_bits(), ((p.x * p.y).sin() + p.z.exp()).to_bits());
    }
}
