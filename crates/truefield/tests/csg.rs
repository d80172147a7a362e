//! Solids put together: every shape against the laws and against judges that know the surface by points.

mod residual;

use std::sync::Arc;

use residual::residuals;

use truefield::laws::{Random, check_distance, check_lipschitz, check_many};
use truefield::source::csg::{
    Blend, BlendKind, Capsule, Complement, Cuboid, Ellipsoid, Frustum, HalfSpace, Molecule, Offset, Placed, Placement, Sphere, Sponge,
    Torus, Union, difference, intersection, shell, sweep, tube,
};
use truefield::source::implicit::{Expression, Implicit, Unary};
use truefield::{Aabb, DVec3, Distance, Interval, Run, Source};

type Shape = Arc<dyn Source>;

fn arc(shape: truefield::Result<impl Source + 'static>) -> Shape {
    Arc::new(shape.expect("a shape"))
}

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

fn value(shape: &dyn Source, p: DVec3) -> f64 {
    let mut out = [f64::NAN];
    shape.values(&[p], &mut out).expect("a value");
    out[0]
}

fn gradient(shape: &dyn Source, p: DVec3) -> DVec3 {
    let mut out = [DVec3::NAN];
    shape.gradients(&[p], &mut out).expect("a gradient");
    out[0]
}

/// Points of every kind around a box: in it, near it, far away, on planes through its middle, in the middle.
fn around(extent: Aabb, count: usize, seed: u64) -> Vec<DVec3> {
    let (mut random, size) = (Random::new(seed), extent.diagonal());
    (0..count)
        .map(|i| match i % 8 {
            0..=3 => random.within(&extent.grow(0.2 * size)),
            4 => random.within(&extent.grow(2.0 * size)),
            5 => {
                let mut p = random.within(&extent.grow(0.3 * size));
                p[random.below(3)] = extent.center()[random.below(3)];
                p
            }
            6 => {
                let mut p = extent.center();
                p[random.below(3)] += random.between(-0.7, 0.7) * size;
                p
            }
            _ => extent.center() + random.direction() * random.length(1e-9, 1e3) * size,
        })
        .collect()
}

/// A point where the value is zero, on a line from `a`, inside, to `b`, outside.
fn crossing(shape: &dyn Source, mut a: DVec3, mut b: DVec3) -> DVec3 {
    for _ in 0..80 {
        let middle = a * 0.5 + b * 0.5;
        if value(shape, middle) < 0.0 { a = middle } else { b = middle }
    }
    a * 0.5 + b * 0.5
}

/// Points of the surface, found by bisection between points of both sides.
fn surface(shape: &dyn Source, extent: Aabb, count: usize, seed: u64) -> Vec<DVec3> {
    let mut random = Random::new(seed);
    let around = extent.grow(0.3 * extent.diagonal());
    let points: Vec<DVec3> = (0..8 * count).map(|_| random.within(&around)).collect();
    let (inside, outside): (Vec<DVec3>, Vec<DVec3>) = points.into_iter().partition(|&p| value(shape, p) < 0.0);
    assert!(!inside.is_empty() && !outside.is_empty(), "no points on both sides of the surface");
    (0..count).map(|_| crossing(shape, inside[random.below(inside.len())], outside[random.below(outside.len())])).collect()
}

/// What holds of every source: values change by no more than one moves, have the sign of the distance, which is no nearer
/// to zero; samples of the surface are no nearer than the interval says; gradients are slopes; slack and bend enclose.
fn attack(name: &str, shape: &dyn Source, extent: Aabb, count: usize) {
    let (size, mut random) = (extent.diagonal(), Random::new(7));
    let round = 1e-11 * (size + extent.center().length()) + shape.noise();
    let points = around(extent, count, 1);
    check_many(shape, &points[..count.min(500)]).unwrap_or_else(|broken| panic!("{name}: {broken:?}"));
    check_lipschitz(shape, &points, round).unwrap_or_else(|broken| panic!("{name}: {broken:?}"));
    let on = surface(shape, extent, 1500, 5);
    for (i, &p) in points.iter().enumerate() {
        let round = round + 1e-12 * p.length();
        let (here, at) = (value(shape, p), shape.at(p));
        assert!(at.lower <= at.upper && !here.is_nan(), "{name} at {p}: {at:?} {here}");
        assert!(at.lower - round <= here && here <= at.upper + round, "{name} at {p}: {at:?} without the value {here}");
        // The surface is as near as its samples, or nearer; and the distance as far from zero as the value.
        let sampled = on.iter().map(|q| q.distance(p)).fold(f64::INFINITY, f64::min);
        let nearest = if here < 0.0 { -at.upper } else { at.lower };
        assert!(nearest <= sampled + round, "{name} at {p}: {at:?}, but a point of the surface is {sampled} away");
        let q = p + random.direction() * random.length(1e-7, 1.0) * size;
        let there = value(shape, q);
        assert!((here - there).abs() <= p.distance(q) + round, "{name}: {here} at {p}, {there} at {q}");
        let range = shape.over(&Aabb::around([p, q]));
        for share in [0.0, 0.3, 1.0] {
            let at = shape.at(p.lerp(q, share));
            assert!(
                range.lower - round <= at.upper && at.lower <= range.upper + round,
                "{name}: {range:?} over {p}..{q}, {at:?} at {share}"
            );
        }
        if i % 4 == 0 {
            cells(name, shape, p, size, round, &mut random);
            residuals(name, shape, p, size, round, &mut random);
        }
    }
}

/// Slack and bend over random cells around a point, by samples and second differences.
fn cells(name: &str, shape: &dyn Source, p: DVec3, size: f64, round: f64, random: &mut Random) {
    let edge = random.length(1e-4, 0.5) * size;
    let cell =
        Aabb::new(p - v(random.unit(), random.unit(), random.unit()) * edge, p + v(random.unit(), random.unit(), random.unit()) * edge);
    let (slack, bend) = (shape.slack(&cell), shape.bend(&cell));
    assert!(slack.lower <= slack.upper && bend.lower <= bend.upper, "{name}: {slack:?}, {bend:?} over {cell:?}");
    for _ in 0..6 {
        let (a, b) = (random.within(&cell), random.within(&cell));
        let (at, here) = (shape.at(a), value(shape, a));
        // Whatever the distance is there, it has to be allowed.
        assert!(
            at.lower - here <= slack.upper + round && slack.lower - round <= at.upper - here,
            "{name}: {slack:?} over {cell:?}, {at:?} and {here} at {a}"
        );
        let step = 0.5 * a.distance(b);
        let second = (value(shape, a) + value(shape, b) - 2.0 * value(shape, a * 0.5 + b * 0.5)) / (step * step);
        let rounding = 8.0 * round / (step * step);
        assert!(
            bend.lower - rounding <= second * (1.0 + 1e-6) + 1e-9 / size && second <= bend.upper * (1.0 + 1e-6) + rounding + 1e-9 / size,
            "{name}: {bend:?} over {cell:?}, {second} from {a} to {b}"
        );
    }
    let (below, half) = (shape.below(&cell), 0.5 * cell.size());
    for i in 0..14 {
        let q = if i < 8 { cell.corner(i) } else { random.within(&cell) };
        let said = below.value + below.slope.dot(q - cell.center());
        let most = shape.at(q).upper;
        assert!(
            said <= most + round && said.abs() <= below.value.abs() + half.length(),
            "{name}: {said} at {q} of {cell:?}, {below:?}, {most}"
        );
    }
    let (slope, step) = (gradient(shape, p), 1e-6 * size);
    let direction = random.direction();
    let curve = shape.bend(&Aabb::new(p, p).grow(step));
    let most = curve.upper.max(-curve.lower);
    if most.is_finite() {
        let difference = (value(shape, p + direction * step) - value(shape, p - direction * step)) / (2.0 * step);
        let allowed = most * step + 2e-9 + 4.0 * round / step;
        assert!(
            (difference - slope.dot(direction)).abs() <= allowed,
            "{name} at {p}: slope {difference} along {direction}, gradient {slope}"
        );
    }
}

fn primitives() -> Vec<(&'static str, Shape)> {
    vec![
        ("sphere", arc(Sphere::new(v(0.3, -1.0, 2.0), 0.7))),
        ("box", arc(Cuboid::new(v(1.0, 0.0, 0.0), v(2.0, 1.0, 0.3)))),
        ("rounded box", arc(Cuboid::rounded(v(0.0, 2.0, 0.0), v(2.0, 1.0, 0.6), 0.2))),
        ("round box", arc(Cuboid::rounded(v(0.0, 2.0, 0.0), v(2.0, 1.0, 0.6), 0.3))),
        ("cylinder", arc(Frustum::cylinder(0.7, 2.0))),
        ("disc", arc(Frustum::cylinder(3.0, 0.1))),
        ("cone", arc(Frustum::new(1.0, 0.0, 1.5))),
        ("flat cone", arc(Frustum::new(2.0, 0.0, 0.2))),
        ("truncated cone", arc(Frustum::new(0.5, 1.0, 1.0))),
        ("capsule", arc(Capsule::new(v(-1.0, 0.0, 0.2), v(1.0, 1.0, 0.0), 0.4))),
        ("torus", arc(Torus::new(1.0, 0.3))),
        ("thick torus", arc(Torus::new(1.0, 0.95))),
        ("ellipsoid", arc(Ellipsoid::new(v(2.0, 1.0, 0.5)))),
        ("needle", arc(Ellipsoid::new(v(0.05, 3.0, 0.05)))),
        ("lens", arc(Ellipsoid::new(v(2.0, 0.1, 2.0)))),
        ("ball", arc(Ellipsoid::new(v(1.0, 1.0, 1.0)))),
        ("sponge 0", arc(Sponge::new(0, 2.0))),
        ("sponge 1", arc(Sponge::new(1, 2.0))),
        ("sponge 3", arc(Sponge::new(3, 2.0))),
    ]
}

#[test]
fn primitives_keep_the_laws() {
    for (name, shape) in primitives() {
        attack(name, &*shape, shape.extent().expect("an end"), 2000);
    }
}

/// Distances of primitives are exact: the way along the gradient leads to the surface, and no sample of the surface is
/// nearer; there is nothing between.
#[test]
fn primitives_are_exact() {
    for (name, shape) in primitives() {
        let extent = shape.extent().expect("an end");
        let size = extent.diagonal();
        for p in around(extent, 20_000, 3) {
            let (here, at, slope) = (value(&*shape, p), shape.at(p), gradient(&*shape, p));
            assert_eq!(at, Interval::exact(here), "{name} at {p}");
            let foot = p - slope * here;
            let left = value(&*shape, foot);
            assert!(left.abs() <= 1e-14 * (size + p.length()) * 40.0, "{name} at {p}: value {here}, and {left} at {foot}, its foot");
        }
    }
}

/// Boxes around places where slopes are lost: middles, axes, rings.
#[test]
fn no_plane_rises_above_a_shape_from_where_its_slope_is_lost() {
    let mut random = Random::new(23);
    let mut shapes = primitives();
    for _ in 0..300 {
        let [a, b] = [random.direction() * random.length(0.1, 1.0), random.direction() * random.length(0.1, 1.0)];
        shapes.push(("capsule", arc(Capsule::new(a, b, random.length(0.01, 0.5)))));
    }
    for (name, shape) in shapes {
        let Some(hull) = shape.extent() else { continue };
        let size = hull.diagonal();
        for round in 0..40 {
            let mut center = hull.center();
            if round > 0 {
                center[random.below(3)] += random.between(-0.5, 0.5) * size;
            }
            if round % 3 == 1 {
                center += random.direction() * random.length(1e-17, 1e-9) * size;
            }
            let half = if round == 0 { 0.5 * hull.size() } else { DVec3::splat(random.length(1e-3, 1.0) * size) };
            let cell = Aabb::new(center - half, center + half);
            let below = shape.below(&cell);
            for _ in 0..40 {
                let q = random.within(&cell);
                let said = below.value + below.slope.dot(q - cell.center());
                assert!(said <= shape.at(q).upper + 1e-12 * size, "{name}: {said} at {q} of {cell:?}, {below:?}");
            }
        }
    }
}

/// The laws of `Distance` against judges that know better: dense samples of the surface, of known density.
#[test]
fn ellipsoids_agree_with_their_surface() {
    for axes in [v(2.0, 1.0, 0.5), v(1.0, 1.0, 0.2), v(0.3, 0.3, 2.0), v(1.0, 1e-3, 0.5), v(1e6, 1.0, 3.0)] {
        let ellipsoid = Ellipsoid::new(axes).expect("an ellipsoid");
        let mut random = Random::new(4);
        for _ in 0..20_000 {
            // From a point of the surface out, and in as far as the least radius of curvature: the way back is the shortest.
            let mut on = random.direction();
            if random.below(4) == 0 {
                on[random.below(3)] = 0.0;
                on = on.normalize();
            }
            let foot = on * axes;
            let normal = (on / axes).normalize();
            let least = axes.min_element().powi(2) / axes.max_element();
            let way = if random.below(2) == 0 { random.length(1e-6, 1e3) * axes.max_element() } else { -random.unit() * least };
            let p = foot + normal * way;
            let found = value(&ellipsoid, p);
            let allowed = 1e-14 * 8.0 * (axes.max_element() + way.abs());
            assert!((found - way).abs() <= allowed, "{axes} at {p}: {found}, not {way}, {:e} off", (found - way).abs());
        }
    }
}

#[test]
fn simple_shapes_agree_with_other_formulas() {
    let mut random = Random::new(9);
    for _ in 0..200_000 {
        let p = random.direction() * random.length(1e-3, 30.0);
        // A sphere as an ellipsoid; a capsule without length; a box as what is in six half-spaces, inside.
        let sphere = Sphere::new(DVec3::ZERO, 1.5).expect("a sphere");
        let ball = Ellipsoid::new(DVec3::splat(1.5)).expect("a ball");
        let point = Capsule::new(DVec3::ZERO, DVec3::ZERO, 1.5).expect("a capsule");
        let truth = p.length() - 1.5;
        for found in [value(&sphere, p), value(&ball, p), value(&point, p)] {
            assert!((found - truth).abs() < 1e-13, "{p}: {found} {truth}");
        }
        let half = v(1.0, 2.0, 0.5);
        let cuboid = Cuboid::new(DVec3::ZERO, 2.0 * half).expect("a box");
        let nearest = p.clamp(-half, half);
        let walls = (0..3).map(|axis| half[axis] - p[axis].abs()).fold(f64::INFINITY, f64::min);
        let truth = if walls > 0.0 { -walls } else { p.distance(nearest) };
        assert!((value(&cuboid, p) - truth).abs() < 1e-13, "{p}");
        // A cylinder in its plane is a box.
        let cylinder = Frustum::cylinder(1.0, 3.0).expect("a cylinder");
        let plane = v(p.x.hypot(p.y), p.z, 0.0);
        let flat = Cuboid::new(DVec3::ZERO, v(2.0, 3.0, 100.0)).expect("a box");
        assert!((value(&cylinder, p) - value(&flat, plane)).abs() < 1e-13, "{p}");
    }
}

/// The sponge against all the cubes it is made of, and all that was removed.
#[test]
fn sponges_agree_with_their_cubes() {
    for level in 0..=3u32 {
        let sponge = Sponge::new(level, 3.0).expect("a sponge");
        let count = 3i32.pow(level);
        let edge = 3.0 / f64::from(count);
        let kept = |i: i32, j: i32, k: i32| {
            let (mut i, mut j, mut k) = (i, j, k);
            (0..level).all(|_| {
                let middles = [i % 3, j % 3, k % 3].iter().filter(|&&digit| digit == 1).count();
                (i, j, k) = (i / 3, j / 3, k / 3);
                middles < 2
            })
        };
        let mut cubes = [Vec::new(), Vec::new()];
        for i in -1..=count {
            for j in -1..=count {
                for k in -1..=count {
                    let within = [i, j, k].iter().all(|index| (0..count).contains(index));
                    let low = v(f64::from(i), f64::from(j), f64::from(k)) * edge - 1.5;
                    cubes[usize::from(within && kept(i, j, k))].push(Aabb::new(low, low + edge));
                }
            }
        }
        let mut random = Random::new(11);
        for _ in 0..4000 {
            let p = random.within(&Aabb::new(DVec3::splat(-1.9), DVec3::splat(1.9)));
            let [removed, solid] =
                [0, 1].map(|side: usize| cubes[side].iter().map(|cube| cube.distance_squared(p)).fold(f64::INFINITY, f64::min).sqrt());
            let truth = if solid > 0.0 { solid } else { -removed };
            let found = value(&sponge, p);
            assert!((found - truth).abs() < 1e-13, "level {level} at {p}: {found}, not {truth}");
        }
    }
    // Deep levels: parts look like the whole.
    let (deep, whole) = (Sponge::new(10, 3.0).expect("a sponge"), Sponge::new(9, 1.0).expect("a sponge"));
    let mut random = Random::new(12);
    for _ in 0..2000 {
        // In a corner, near it rather than near its neighbours.
        let p = random.within(&Aabb::new(DVec3::splat(0.1), DVec3::splat(0.7)));
        let (large, small) = (value(&deep, p + 1.0), value(&whole, p));
        if small > 0.0 {
            assert!((large - small).abs() < 1e-13, "{p}: {large} {small}");
        }
    }
}

/// Flat parts of the sponge bend nothing: what makes its trees small.
#[test]
fn the_walls_of_a_sponge_are_flat() {
    let sponge = Sponge::new(2, 9.0).expect("a sponge");
    let over = |center: DVec3, edge: f64| sponge.bend(&Aabb::new(center, center).grow(edge));
    for center in [v(4.5, 3.0, 3.9), v(1.5, 0.0, 2.0), v(0.2, 1.7, 3.9), v(4.4, 2.1, -2.0)] {
        let near = gradient(&sponge, center);
        assert_eq!(over(center, 0.02), Interval::exact(0.0), "{center}, {near}, {}", value(&sponge, center));
    }
    assert_ne!(over(v(4.5, 4.5, 3.9), 0.02), Interval::exact(0.0));
}

fn combined() -> Vec<(&'static str, Shape)> {
    let sphere = |x: f64, r: f64| arc(Sphere::new(v(x, 0.0, 0.0), r));
    let block = || arc(Cuboid::new(DVec3::ZERO, v(4.0, 4.0, 1.0)));
    let turned = |shape: Shape| {
        let turned = arc(Placed::new(shape, Placement::rotate(v(1.0, 2.0, 3.0), 40.0).expect("a turn")));
        arc(Placed::new(turned, Placement::translate(v(0.2, -0.1, 0.3)).expect("a shift")))
    };
    let mut random = Random::new(2);
    let many: Vec<Shape> =
        (0..60).map(|_| arc(Sphere::new(random.within(&Aabb::new(DVec3::splat(-2.0), DVec3::splat(2.0))), 0.6))).collect();
    let boxes: Vec<Shape> = (0..12).map(|i| arc(Cuboid::new(v(f64::from(i % 4), f64::from(i / 4), 0.0), v(1.0, 1.0, 0.5)))).collect();
    let path: Vec<DVec3> = (0..30).map(|i| f64::from(i) * 0.3).map(|t| v(t.cos() * 2.0, t.sin() * 2.0, 0.15 * t)).collect();
    let atoms: Vec<DVec3> = (0..20).map(f64::from).map(|i| v((0.7 * i).cos() * 2.0, (0.7 * i).sin() * 2.0, 0.2 * i)).collect();
    let radii = (0..20).map(|i| 0.5 + 0.02 * f64::from(i)).collect();
    let chisel = turned(arc(Cuboid::new(DVec3::ZERO, v(0.5, 0.2, 0.8))));
    let stops: Vec<Placement> = path[..6].iter().map(|&p| Placement::translate(p).expect("a shift")).collect();
    let turns: Vec<Placement> = (0..4)
        .map(|i| {
            let (sin, cos) = (0.4 * f64::from(i)).sin_cos();
            Placement::rigid([v(cos, sin, 0.0), v(-sin, cos, 0.0), DVec3::Z], v(f64::from(i) * 0.8, 0.1 * f64::from(i * i), 0.0))
                .expect("a pose")
        })
        .collect();
    vec![
        ("turned box", turned(block())),
        ("scaled cone", arc(Placed::new(arc(Frustum::new(1.0, 0.2, 1.0)), Placement::scale(7.0).expect("a factor")))),
        ("lens", arc(intersection(&[sphere(-0.5, 1.0), sphere(0.5, 1.0)]))),
        ("two balls", arc(Union::new(vec![sphere(-0.5, 1.0), sphere(0.5, 1.0)]))),
        ("balls apart", arc(Union::new(vec![sphere(-2.0, 1.0), sphere(2.0, 1.0)]))),
        ("stacked boxes", arc(Union::new(boxes))),
        ("many balls", arc(Union::new(many.clone()))),
        ("bowl", arc(difference(&block(), &[arc(Sphere::new(v(0.0, 0.0, 0.5), 1.2))]))),
        ("cheese", arc(difference(&block(), &many))),
        ("turned cut", arc(difference(&turned(block()), &[arc(Frustum::cylinder(0.4, 5.0)), turned(arc(Torus::new(1.0, 0.3)))]))),
        ("union of cuts", arc(Union::new(vec![arc(difference(&block(), &many[..3])), sphere(2.0, 1.0)]))),
        ("grown box", arc(Offset::new(&block(), 0.4))),
        ("shrunk box", arc(Offset::new(&block(), -0.3))),
        ("grown bowl", arc(Offset::new(&arc(difference(&block(), &[arc(Sphere::new(v(0.0, 0.0, 0.5), 1.2))])), 0.2))),
        ("shell", arc(shell(&turned(block()), 0.1))),
        ("round blend", arc(Blend::new([&block(), &arc(Frustum::cylinder(0.7, 4.0))], 0.5, BlendKind::Circular))),
        ("blend", arc(Blend::new([&sphere(-0.8, 1.0), &sphere(0.8, 1.0)], 0.4, BlendKind::Polynomial))),
        ("blended cut", arc(Blend::new([&arc(difference(&block(), &many[..3])), &sphere(2.0, 1.0)], 0.5, BlendKind::Circular))),
        ("tube", arc(tube(&path, 0.3))),
        ("one point", arc(tube(&path[..1], 0.3))),
        ("chiselled", arc(sweep(&chisel, &stops))),
        ("turned chisel", arc(sweep(&chisel, &turns))),
        ("swept ellipsoid", arc(sweep(&arc(Ellipsoid::new(v(0.2, 0.5, 0.3))), &turns))),
        ("molecule", arc(Molecule::new(atoms.clone(), radii, 4.0))),
        ("one atom", arc(Molecule::new(atoms[..1].to_vec(), vec![1.0], 2.0))),
    ]
}

#[test]
fn what_is_put_together_keeps_the_laws() {
    for (name, shape) in combined() {
        attack(name, &*shape, shape.extent().expect("an end"), 600);
    }
}

/// The upper ends, too: from the far end of the interval there is always a point on the other side.
#[test]
fn bounds_hold_the_surface() {
    for (name, shape) in combined() {
        let extent = shape.extent().expect("an end");
        let on = surface(&*shape, extent, 6000, 17);
        let points = around(extent, 400, 19);
        for &p in &points {
            let at = shape.at(p);
            // A ball that is free of samples, by more than they are apart, is free of surface.
            let sampled = on.iter().map(|q| q.distance(p)).fold(f64::INFINITY, f64::min);
            let farthest = at.upper.max(-at.lower);
            assert!(farthest.is_finite(), "{name} at {p}: {at:?}");
            assert!(farthest >= sampled - 0.1 * extent.diagonal(), "{name} at {p}: {at:?}, but the surface is about {sampled} away");
        }
    }
}

/// The truth of two balls is known: inside, the nearest point may lie on the circle where they meet.
#[test]
fn two_balls_and_their_lens_are_known() {
    let balls: Vec<Shape> = vec![arc(Sphere::new(v(-0.5, 0.0, 0.0), 1.0)), arc(Sphere::new(v(0.5, 0.0, 0.0), 1.0))];
    let rim = 0.75f64.sqrt();
    // Of the outside of the union, or the inside of the lens: the nearest point of a ball's surface, or of the circle.
    let to_rim = |p: DVec3| (p.y.hypot(p.z) - rim).hypot(p.x);
    let union_truth = |p: DVec3| {
        let ways = [-0.5, 0.5].map(|x| (p - v(x, 0.0, 0.0)).length() - 1.0);
        if ways[0].min(ways[1]) >= 0.0 {
            return ways[0].min(ways[1]);
        }
        let mut nearest = to_rim(p);
        for (x, way) in [-0.5, 0.5].into_iter().zip(ways) {
            let foot = p - (p - v(x, 0.0, 0.0)).normalize_or(v(x, 0.0, 0.0)) * way;
            if foot.x * x >= 0.0 {
                nearest = nearest.min(way.abs());
            }
        }
        -nearest
    };
    let lens_truth = |p: DVec3| {
        let ways = [-0.5, 0.5].map(|x| (p - v(x, 0.0, 0.0)).length() - 1.0);
        if ways[0].max(ways[1]) <= 0.0 {
            return ways[0].max(ways[1]);
        }
        let mut nearest = to_rim(p);
        for (x, way) in [-0.5, 0.5].into_iter().zip(ways) {
            let foot = p - (p - v(x, 0.0, 0.0)).normalize_or(v(x, 0.0, 0.0)) * way;
            if foot.x * x <= 0.0 && way > 0.0 {
                nearest = nearest.min(way);
            }
        }
        nearest
    };
    let extent = Aabb::new(DVec3::splat(-1.6), DVec3::splat(1.6));
    let points = around(extent, 20_000, 23);
    check_distance(&Union::new(balls.clone()).expect("a union"), union_truth, &points, 1e-11).expect("the union");
    check_distance(&intersection(&balls).expect("a lens"), lens_truth, &points, 1e-11).expect("the lens");
    // And the other end is near: ways out find the circle.
    let union = Union::new(balls).expect("a union");
    for &p in &points {
        let off = union_truth(p) - union.at(p).lower;
        assert!(off < 0.06, "the lower end is {off} too low at {p}: {:?}", union.at(p));
    }
}

/// Slack against the truth of stacked boxes: one block, whatever the parts.
#[test]
fn stacked_boxes_are_one_block() {
    let halves: Vec<Shape> =
        vec![arc(Cuboid::new(v(-1.0, 0.0, 0.0), v(2.0, 2.0, 2.0))), arc(Cuboid::new(v(1.0, 0.0, 0.0), v(2.0, 2.0, 2.0)))];
    let stacked = Union::new(halves).expect("a union");
    let block = Cuboid::new(DVec3::ZERO, v(4.0, 2.0, 2.0)).expect("a box");
    let mut random = Random::new(31);
    let extent = block.extent().expect("an end").grow(0.5);
    for _ in 0..20_000 {
        let p = random.within(&extent);
        let (at, truth) = (stacked.at(p), value(&block, p));
        assert!(at.lower - 1e-12 <= truth && truth <= at.upper + 1e-12, "{p}: {at:?} {truth}");
        let cell = Aabb::new(p, p).grow(random.length(1e-3, 0.5));
        let slack = stacked.slack(&cell);
        for _ in 0..4 {
            let q = random.within(&cell);
            let off = value(&block, q) - value(&stacked, q);
            assert!(slack.lower - 1e-12 <= off && off <= slack.upper + 1e-12, "{cell:?}: {slack:?}, {off} at {q}");
        }
    }
}

/// Growing a box, and shrinking it again where it was convex, is known.
#[test]
fn offsets_agree_with_rounded_boxes() {
    let block: Shape = arc(Cuboid::new(DVec3::ZERO, v(4.0, 2.0, 1.0)));
    let grown = Offset::new(&block, 0.25).expect("grown");
    let rounded = Cuboid::rounded(DVec3::ZERO, v(4.5, 2.5, 1.5), 0.25).expect("rounded");
    let points = around(block.extent().expect("an end"), 5000, 37);
    check_distance(&grown, |p| value(&rounded, p), &points, 1e-11).expect("a rounded box");
    for &p in &points {
        let (found, truth) = (grown.at(p), rounded.at(p));
        assert!((found.lower - truth.lower).abs() < 1e-11 && (found.upper - truth.upper).abs() < 1e-11, "{p}: {found:?} {truth:?}");
    }
    let (shrunk, small) = (Offset::new(&block, -0.25).expect("shrunk"), Cuboid::new(DVec3::ZERO, v(3.5, 1.5, 0.5)).expect("a box"));
    check_distance(&shrunk, |p| value(&small, p), &points, 1e-11).expect("a small box");
}

/// A box moved straight is a longer box; a ball moved straight a capsule.
#[test]
fn straight_sweeps_are_known() {
    let stops = [0.0, 1.0, 2.5].map(|x| Placement::translate(v(x, 0.0, 0.0)).expect("a shift"));
    let swept = sweep(&arc(Cuboid::new(DVec3::ZERO, v(1.0, 0.6, 0.4))), &stops).expect("a sweep");
    let long = Cuboid::new(v(1.25, 0.0, 0.0), v(3.5, 0.6, 0.4)).expect("a box");
    let points = around(long.extent().expect("an end"), 4000, 41);
    check_distance(&swept, |p| value(&long, p), &points, 1e-10).expect("a longer box");
    let ball = sweep(&arc(Sphere::new(DVec3::ZERO, 0.3)), &stops).expect("a sweep");
    let capsule = Capsule::new(DVec3::ZERO, v(2.5, 0.0, 0.0), 0.3).expect("a capsule");
    for &p in &points {
        assert!((value(&ball, p) - value(&capsule, p)).abs() < 1e-10, "{p}");
    }
    check_distance(&ball, |p| value(&capsule, p), &points, 1e-10).expect("a capsule");
}

/// What turns is checked against thousands of poses.
#[test]
fn turning_sweeps_agree_with_many_poses() {
    let tool: Shape = arc(Cuboid::new(v(0.3, 0.0, 0.0), v(1.0, 0.2, 0.4)));
    let pose = |share: f64| {
        let (sin, cos) = (1.2 * share).sin_cos();
        Placement::rigid([v(cos, sin, 0.0), v(-sin, cos, 0.0), DVec3::Z], v(2.0 * share, 0.0, 0.5 * share)).expect("a pose")
    };
    let swept = sweep(&tool, &[pose(0.0), pose(1.0)]).expect("a sweep");
    let poses: Vec<Placed> = (0..=2000).map(|i| Placed::new(Arc::clone(&tool), pose(f64::from(i) / 2000.0)).expect("a pose")).collect();
    for p in around(swept.extent().expect("an end"), 300, 43) {
        let sampled = poses.iter().map(|pose| value(pose, p)).fold(f64::INFINITY, f64::min);
        let found = value(&swept, p);
        assert!(found <= sampled + swept.noise() && found >= sampled - 2e-3, "{p}: {found}, by poses {sampled}");
    }
}

/// Sizes from atoms to planets, and places far from the origin.
#[test]
fn any_scale_and_place() {
    for scale in [1e-9, 1e-3, 1e6] {
        for place in [DVec3::ZERO, v(1e3, -2e3, 5e2) * scale] {
            let block: Shape = arc(Cuboid::new(place, v(4.0, 4.0, 1.0) * scale));
            let ball: Shape = arc(Sphere::new(place + v(0.0, 0.0, 0.5) * scale, 1.2 * scale));
            let ring: Shape = arc(Placed::new(arc(Torus::new(1.5 * scale, 0.3 * scale)), Placement::translate(place).expect("a shift")));
            let bowl: Shape = arc(difference(&block, &[ball]));
            let both = Union::new(vec![bowl, ring]).expect("a union");
            attack("scaled", &both, both.extent().expect("an end"), 300);
        }
    }
}

#[test]
fn half_spaces_and_complements_have_no_end() {
    let half = HalfSpace::new(v(0.0, 0.0, 1.0), v(0.0, 0.0, 7.0)).expect("a half-space");
    assert_eq!((half.extent(), value(&half, v(3.0, 4.0, 3.0))), (None, 2.0));
    let block: Shape = arc(Cuboid::new(DVec3::ZERO, DVec3::splat(2.0)));
    let outside = Complement::new(Arc::clone(&block));
    assert_eq!((outside.extent(), outside.at(DVec3::ZERO)), (None, Interval::exact(1.0)));
    let cut = intersection(&[block, Arc::new(half)]).expect("a cut");
    attack("cut", &cut, cut.extent().expect("an end"), 1000);
}

#[test]
fn what_is_no_shape_is_refused() {
    let block: Shape = arc(Cuboid::new(DVec3::ZERO, DVec3::splat(1.0)));
    let far: Shape = arc(Sphere::new(v(9.0, 0.0, 0.0), 1.0));
    let ring: Shape = arc(Torus::new(1.0, 0.3));
    let half: Shape = arc(HalfSpace::new(DVec3::ZERO, DVec3::X));
    let here = [Placement::IDENTITY];
    let sentences = [
        Sphere::new(DVec3::ZERO, 0.0).err(),
        Sphere::new(v(f64::NAN, 0.0, 0.0), 1.0).err(),
        Cuboid::new(DVec3::ZERO, v(1.0, -1.0, 1.0)).err(),
        Cuboid::rounded(DVec3::ZERO, v(1.0, 1.0, 1.0), 0.6).err(),
        Frustum::new(0.0, 0.0, 1.0).err(),
        Frustum::cylinder(1.0, f64::INFINITY).err(),
        Torus::new(1.0, 1.0).err(),
        Ellipsoid::new(v(1.0, 0.0, 1.0)).err(),
        HalfSpace::new(DVec3::ZERO, DVec3::ZERO).err(),
        Sponge::new(17, 1.0).err(),
        Molecule::new(vec![], vec![], 4.0).err(),
        Molecule::new(vec![DVec3::ZERO], vec![-1.0], 4.0).err(),
        Placement::scale(-1.0).err(),
        Placement::rotate(DVec3::ZERO, 3.0).err(),
        Placement::rigid([DVec3::X, DVec3::Y, DVec3::X], DVec3::ZERO).err(),
        Union::new(vec![]).err(),
        intersection(&[Arc::clone(&block), far]).err(),
        Offset::new(&block, -0.5).err(),
        Offset::new(&block, f64::NAN).err(),
        shell(&block, -1.0).err(),
        Blend::new([&block, &ring], 0.0, BlendKind::Circular).err(),
        tube(&[], 1.0).err(),
        sweep(&block, &[]).err(),
        sweep(&ring, &here).err(),
        sweep(&half, &here).err(),
    ];
    for (i, sentence) in sentences.into_iter().enumerate() {
        let sentence = sentence.unwrap_or_else(|| panic!("number {i} was taken")).to_string();
        assert!(sentence.len() > 20, "{i}: {sentence}");
    }
}

/// Many points together are answered where each alone is, though the formula is no number in their middle.
#[test]
fn the_middle_of_points_need_not_have_an_answer() {
    let [x, y, z] = Expression::axes();
    let square = |e: &Expression| e.unary(Unary::Square);
    let radius = square(&x) + square(&y) + square(&z);
    let formula = radius.clone() - 0.25 + radius.unary(Unary::Logarithm) * 0.0;
    let domain = Aabb::new(DVec3::splat(-1.0), DVec3::ONE);
    let holed = Implicit::new(&formula, domain, &Run::with_threads(1)).expect("a shape");
    let ball = Sphere::new(DVec3::X * 3.0, 0.3).expect("a ball");
    let union = Union::new(vec![Arc::new(holed), Arc::new(ball)]).expect("a union");
    for count in [2, 4, 16, 20, 40] {
        let places: Vec<DVec3> =
            (0..count / 2).flat_map(|n| [1.0, -1.0].map(|s| DVec3::new(0.1, 0.2, 0.3 + 0.01 * f64::from(n)) * s)).collect();
        let mut together = vec![0.0; places.len()];
        union.values(&places, &mut together).expect("values");
        for (p, together) in places.iter().zip(together) {
            let mut alone = [0.0];
            union.values(&[*p], &mut alone).expect("a value");
            assert_eq!(alone[0].to_bits(), together.to_bits(), "{p}");
        }
    }
}
