//! How far said slopes may be from true ones: what shapes say of that holds, and bounds made of slopes allow for it.

use std::sync::Arc;

use truefield::laws::Random;
use truefield::source::csg::{Blend, BlendKind, Capsule, Complement, Frustum, Offset, Placed, Placement, Sphere, Union, sweep};
use truefield::source::implicit::{Expression, Implicit, Unary};
use truefield::{Aabb, DVec3, Distance, Interval, Result, Run, Source};

fn cube(half: f64) -> Aabb {
    Aabb::new(DVec3::splat(-half), DVec3::splat(half))
}

fn square(e: &Expression) -> Expression {
    e.unary(Unary::Square)
}

fn ball() -> Expression {
    let [x, y, z] = Expression::axes();
    square(&x) + square(&y) + square(&z) - 1.0
}

fn torus() -> Expression {
    let [x, y, z] = Expression::axes();
    let ring = (square(&x) + square(&y)).unary(Unary::SquareRoot) - 1.0;
    square(&ring) + square(&z) - 0.16
}

fn shape(expression: &Expression, domain: Aabb) -> Implicit {
    Implicit::new(expression, domain, &Run::with_threads(1)).expect("a shape")
}

fn slope(shape: &dyn Source, p: DVec3) -> DVec3 {
    let mut out = [DVec3::ZERO];
    shape.gradients(&[p], &mut out).expect("a slope");
    out[0]
}

#[test]
fn formulas_say_how_good_their_slopes_are() {
    let mut random = Random::new(1);
    let ring = |p: DVec3| {
        let around = DVec3::new(p.x, p.y, 0.0).normalize();
        (p - around).normalize()
    };
    let round: fn(DVec3) -> DVec3 = |p| p.normalize();
    for (expression, half, truth) in [(ball(), 1.5, round), (torus(), 1.7, ring)] {
        let shape = shape(&expression, cube(half));
        let mut tilts = Vec::new();
        for n in 0..400 {
            let mut p = random.within(&cube(half));
            if n % 3 == 0 {
                // Next to the surface, and on it, where slopes are the formula's own.
                let way = truth(p);
                p -= way * (shape.at(p).upper - random.between(-1.0, 1.0) * random.length(1e-16, 1e-5));
            }
            let inside = shape.at(p).upper < 0.0;
            let depth = half - p.abs().max_element();
            // Next to a face of the domain that is the solid's, too, slopes are the face's.
            if !cube(half).contains(p) || inside && depth < -shape.at(p).lower * (1.0 + 1e-9) {
                continue;
            }
            let tilt = shape.tilt(p);
            assert!(
                (slope(&shape, p) - truth(p)).length() <= tilt + 4e-15,
                "{:?} at {p} is not {:?} within {tilt}",
                slope(&shape, p),
                truth(p)
            );
            tilts.push(tilt);
        }
        tilts.sort_by(f64::total_cmp);
        assert!(tilts[tilts.len() / 2] < 1e-6, "half of the slopes are no better than {}", tilts[tilts.len() / 2]);
        // All ways lead to the surface from the middle of the ball, and from the core of the ring.
        assert!(shape.tilt(if half == 1.5 { DVec3::ZERO } else { DVec3::X }).is_infinite());
    }
}

/// Says slopes that are turned, and by how much.
struct Turned {
    shape: Sphere,
    by: f64,
}

impl Distance for Turned {
    fn extent(&self) -> Option<Aabb> {
        self.shape.extent()
    }

    fn at(&self, p: DVec3) -> Interval {
        self.shape.at(p)
    }
}

impl Source for Turned {
    fn values(&self, points: &[DVec3], out: &mut [f64]) -> Result<()> {
        self.shape.values(points, out)
    }

    fn gradients(&self, points: &[DVec3], out: &mut [DVec3]) -> Result<()> {
        self.shape.gradients(points, out)?;
        for out in out {
            *out = (*out + out.any_orthonormal_vector() * self.by).normalize();
        }
        Ok(())
    }

    fn tilt(&self, _: DVec3) -> f64 {
        self.by
    }

    fn bend(&self, cell: &Aabb) -> Interval {
        self.shape.bend(cell)
    }
}

/// No corner of a box, and no place in it, is below what is said; true where the slope says more than the least distance.
fn holds(name: &str, shape: &dyn Source, cell: &Aabb, random: &mut Random) -> bool {
    let below = shape.below(cell);
    for p in (0..8).map(|corner| cell.corner(corner)).chain((0..16).map(|_| random.within(cell))) {
        let (said, known) = (below.value + below.slope.dot(p - cell.center()), shape.at(p));
        assert!(said <= known.upper + 1e-12, "{name}: {said} at {p} of {cell:?}, {known:?}");
    }
    below.slope != DVec3::ZERO
}

#[test]
fn bounds_from_slopes_allow_for_what_these_are_off() {
    let mut random = Random::new(2);
    let sphere = |at: f64| Sphere::new(DVec3::X * at, 1.0).expect("a sphere");
    for by in [1e-5, 1e-3, 0.1, 0.4] {
        let turned = || -> Arc<dyn Source> { Arc::new(Turned { shape: sphere(0.0), by }) };
        let far: Arc<dyn Source> = Arc::new(sphere(40.0));
        let moved = Placement::translate(DVec3::ZERO).expect("a place");
        let shapes: [(&str, Arc<dyn Source>); 5] = [
            ("union", Arc::new(Union::new(vec![turned(), far.clone()]).expect("a union"))),
            ("complement", Arc::new(Complement::new(Arc::new(Complement::new(turned()))))),
            ("offset", Arc::new(Offset::new(&turned(), 0.25).expect("an offset"))),
            ("blend", Arc::new(Blend::new([&turned(), &far], 0.5, BlendKind::Polynomial).expect("a blend"))),
            (
                "placed",
                Arc::new(
                    Union::new(vec![Arc::new(Placed::new(turned(), moved).expect("placed")) as Arc<dyn Source>, far.clone()])
                        .expect("a union"),
                ),
            ),
        ];
        for (name, shape) in &shapes {
            let mut told = 0;
            for _ in 0..200 {
                let center = random.direction() * random.between(1.5, 6.0);
                let half = random.length(1e-3, 0.3);
                told += usize::from(holds(name, &**shape, &Aabb::new(center - half, center + half), &mut random));
            }
            assert!(told > 50 || by > 0.2, "{name}: {told} of 200 boxes are told a slope that is off by {by}");
        }
    }
}

#[test]
fn blends_of_formulas_stay_above_what_is_said() {
    let mut random = Random::new(3);
    let ball: Arc<dyn Source> = Arc::new(shape(&ball(), cube(1.5)));
    let other: Arc<dyn Source> = Arc::new(
        Placed::new(Arc::new(shape(&torus(), cube(1.7))), Placement::translate(DVec3::new(1.2, 0.3, 0.5)).expect("a place"))
            .expect("placed"),
    );
    let blend = Blend::new([&ball, &other], 0.3, BlendKind::Polynomial).expect("a blend");
    let mut told = 0;
    for _ in 0..150 {
        let (center, half) = (random.within(&cube(1.4)), random.length(1e-2, 0.2));
        told += usize::from(holds("blend", &blend, &Aabb::new(center - half, center + half), &mut random));
    }
    assert!(told > 10, "{told} of 150 boxes are told a slope");
}

/// Beside a long straight way slopes have no part along it, but for what is left of looking for the nearest place on it.
#[test]
fn strokes_say_how_good_their_slopes_are() {
    let end = DVec3::new(100.0, 30.0, 10.0);
    let along = end.normalize();
    let tools: [Arc<dyn Source>; 3] = [
        Arc::new(Capsule::new(DVec3::ZERO, DVec3::new(0.3, 0.2, 0.7), 0.4).expect("a capsule")),
        Arc::new(Frustum::cylinder(0.5, 1.0).expect("a cylinder")),
        Arc::new(Sphere::new(DVec3::ZERO, 0.5).expect("a ball")),
    ];
    let mut random = Random::new(31);
    let mut told = 0;
    for tool in &tools {
        let poses = [DVec3::ZERO, end].map(|at| Placement::translate(at).expect("a place"));
        let swept = sweep(tool, &poses).expect("a sweep");
        for _ in 0..400 {
            let p = end * random.between(0.2, 0.8) + random.direction() * random.between(1.5, 8.0);
            let tilt = swept.tilt(p);
            let off = slope(&swept, p).dot(along).abs();
            assert!(off <= tilt, "{p}: {off} along the way, {tilt} said");
            told += usize::from(tilt < 1e-2);
        }
    }
    assert!(told > 1000, "{told}");
}
