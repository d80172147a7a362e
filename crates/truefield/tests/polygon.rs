//! Polygons: distances by brute force, bends by second differences, trees of columns.

mod residual;

use residual::residuals;
use truefield::build::adaptive::{Rules, adaptive, root};
use truefield::field::adaptive::Division;
use truefield::laws::Random;
use truefield::op::edit::{Operation, edit};
use truefield::source::csg::Sphere;
use truefield::source::polygon::{Fill, Polygon};
use truefield::{Aabb, DVec3, Distance, Run, Source};

type Loops = Vec<Vec<[f64; 2]>>;

fn rectangle(low: [f64; 2], high: [f64; 2]) -> Vec<[f64; 2]> {
    vec![low, [high[0], low[1]], high, [low[0], high[1]]]
}

fn shapes() -> Vec<(Loops, Fill)> {
    let star =
        (0..10).map(|n| (f64::from(n) * 0.628, if n % 2 == 0 { 1.0 } else { 0.4 })).map(|(t, r)| [r * t.cos(), r * t.sin()]).collect();
    let crossing: Vec<[f64; 2]> = (0..5).map(|n| f64::from(n) * 2.513).map(|t| [t.cos(), t.sin()]).collect();
    vec![
        (vec![rectangle([-1.0, -0.5], [1.0, 0.5])], Fill::EvenOdd),
        (
            vec![rectangle([-1.0, -0.9], [1.0, 0.9]), rectangle([-0.5, -0.5], [0.3, 0.6]), rectangle([-0.2, -0.2], [0.1, 0.1])],
            Fill::EvenOdd,
        ),
        (vec![star], Fill::Winding),
        (vec![crossing.clone()], Fill::EvenOdd),
        (vec![crossing], Fill::Winding),
        (vec![rectangle([-1.0, -1.0], [0.2, 0.2]), rectangle([-0.2, -0.2], [1.0, 1.0])], Fill::Winding),
    ]
}

/// The distance to all edges, and the turn of the angle around the loops.
fn brute(loops: &Loops, fill: Fill, p: DVec3) -> f64 {
    let (mut best, mut turn) = (f64::INFINITY, 0.0);
    for corners in loops {
        for (n, &[ax, ay]) in corners.iter().enumerate() {
            let [bx, by] = corners[(n + 1) % corners.len()];
            let (ux, uy, wx, wy) = (bx - ax, by - ay, p.x - ax, p.y - ay);
            let t = ((wx * ux + wy * uy) / (ux * ux + uy * uy)).clamp(0.0, 1.0);
            best = best.min((wx - t * ux).hypot(wy - t * uy));
            let (vx, vy) = (p.x - bx, p.y - by);
            turn += (wx * vy - wy * vx).atan2(wx * vx + wy * vy);
        }
    }
    let turns = (turn / std::f64::consts::TAU).round() as i64;
    let inside = if fill == Fill::EvenOdd { turns % 2 != 0 } else { turns != 0 };
    if inside { -best } else { best }
}

#[test]
fn distances_are_those_of_all_edges() {
    let mut random = Random::new(2);
    for (loops, fill) in shapes() {
        let polygon = Polygon::new(&loops, fill).expect("a polygon");
        for _ in 0..20_000 {
            let p = random.within(&Aabb::new(DVec3::splat(-2.0), DVec3::splat(2.0)));
            let found = polygon.at(p).lower;
            assert!((found - brute(&loops, fill, p)).abs() < 1e-12, "{found} at {p}");
        }
    }
}

#[test]
fn bends_hold_second_differences() {
    let mut random = Random::new(3);
    for (loops, fill) in shapes() {
        let polygon = Polygon::new(&loops, fill).expect("a polygon");
        let value = |p: DVec3| polygon.at(p).lower;
        for _ in 0..30_000 {
            let low = random.within(&Aabb::new(DVec3::splat(-1.6), DVec3::splat(1.5)));
            let cell = Aabb::new(low, low + random.length(0.01, 0.5));
            let bend = polygon.bend(&cell);
            let step = 0.2 * cell.size().x * random.between(0.05, 1.0);
            let way = random.within(&Aabb::new(DVec3::splat(-1.0), DVec3::ONE)).with_z(0.0).normalize_or(DVec3::X) * step;
            let inner = cell.grow(-step.min(0.49 * cell.size().x));
            let p = random.within(&inner);
            let second = (value(p - way) - 2.0 * value(p) + value(p + way)) / (step * step);
            assert!(bend.widen(1e-12 / (step * step)).contains(second), "{second} not in {bend:?} over {cell:?} of {loops:?} {fill:?}");
            assert!(polygon.over(&cell).contains(value(p)));
        }
    }
}

#[test]
fn what_is_said_between_samples_holds() {
    let mut random = Random::new(12);
    for (loops, fill) in shapes() {
        let polygon = Polygon::new(&loops, fill).expect("a polygon");
        for n in 0..1000 {
            let p = random.within(&Aabb::new(DVec3::splat(-1.6), DVec3::splat(1.6)));
            residuals("a polygon", &polygon, p, [0.1, 1.0][n % 2], 1e-13, &mut random);
        }
    }
}

#[test]
fn polygons_make_quadtrees_that_can_be_edited() {
    let run = Run::default();
    let mut random = Random::new(4);
    for (loops, fill) in shapes() {
        let polygon = Polygon::new(&loops, fill).expect("a polygon");
        let domain = Aabb::new(DVec3::splat(-1.5), DVec3::splat(1.5));
        let field = adaptive(&polygon, root(&polygon, Some(domain), Division::Quadtree).expect("a box"), &Rules::within(0.01), &run)
            .expect("a field");
        let (inner, plain) = (rectangle([0.1, -0.3], [0.9, 0.2]), Rules::within(0.01));
        let tool = Polygon::new(std::slice::from_ref(&inner), Fill::EvenOdd).expect("a polygon");
        let carved = edit(&field, &tool, Operation::Carve, 1 << 30, &run).expect("a field");
        assert!(field.statistics().cells > 50 && carved.to_levels() != field.to_levels());
        for _ in 0..20_000 {
            let p = random.within(&domain);
            let (old, cut) = (polygon.at(p).lower, tool.at(p).lower);
            assert!(field.at(p).contains(old));
            let said = field.interpolate(p).expect("inside");
            assert!((said - old).abs() <= plain.tolerance + plain.growth * old.abs() + 1e-9);
            let (said, value) = (carved.interpolate(p).expect("inside"), old.max(-cut));
            assert!(value.abs() > 0.1 || (said - value).abs() < 0.03, "{said} is not {value} at {p}");
            let found = carved.at(p);
            assert!(if value > 0.0 { found.upper >= value - 1e-9 } else { found.contains(value) }, "{value} at {p} is not in {found:?}");
            assert_eq!(carved.interpolate(p), carved.interpolate(p.with_z(-0.3)));
        }
        let ball = Sphere::new(DVec3::ZERO, 0.3).expect("a ball");
        assert!(edit(&field, &ball, Operation::Carve, 1 << 30, &run).expect_err("refused").to_string().contains("polygon"));
    }
}

#[test]
fn what_is_no_polygon_is_refused() {
    for loops in [
        vec![],
        vec![vec![]],
        vec![vec![[0.0, 0.0], [1.0, 0.0]]],
        vec![vec![[0.0, 0.0]; 5]],
        vec![vec![[0.0, 0.0], [1.0, f64::NAN], [2.0, 1.0]]],
    ] {
        assert!(Polygon::new(&loops, Fill::EvenOdd).is_err(), "{loops:?}");
    }
}
