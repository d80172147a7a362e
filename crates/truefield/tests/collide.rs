//! Collision: intervals that contain the truth, witnesses where they should be.

mod nasty;
mod shaped;

use std::sync::Arc;

use nasty::shapes;
use shaped::{ball, box_value, cuboid, near, torus, tree};
use truefield::laws::{Random, check_threads};
use truefield::product::collide::{Collision, Contact, collide};
use truefield::source::csg::{Sphere, intersection};
use truefield::{Aabb, DVec3, Distance, Error, Interval, Run, SignChoice, Source, Surface};

const PLENTY: usize = 200_000;

fn found(f: &dyn Distance, g: &dyn Distance, tolerance: f64) -> Collision {
    collide(f, g, tolerance, PLENTY, &Run::with_threads(2)).expect("an answer")
}

#[test]
fn balls_are_apart_touch_or_overlap_as_their_middles_say() {
    let mut random = Random::new(1);
    for _ in 0..200 {
        let (a, b) = (random.direction() * random.between(0.0, 2.0), random.direction() * random.between(0.0, 2.0));
        let (r, s) = (random.between(0.1, 1.0), random.between(0.1, 1.0));
        let apart = (a - b).length();
        // The largest ball in both: as wide as the overlap, or the smaller ball itself.
        let depth = (0.5 * (r + s - apart)).min(r.min(s));
        let truth = if apart > r + s { apart - r - s } else { -depth };
        let c = found(&ball(a, r), &ball(b, s), 1e-3);
        assert!(c.separation.widen(1e-12).contains(truth), "{c:?}: {truth}");
        assert!(c.separation.width() <= 1e-3, "{c:?}");
        let expected = match c.separation {
            Interval { lower, .. } if lower > 0.0 => Contact::Separated,
            Interval { upper, .. } if upper < 0.0 => Contact::Penetrating,
            _ => Contact::Undecided,
        };
        assert_eq!(c.contact, expected);
        if c.contact == Contact::Separated {
            assert!(((c.first - a).length() - r).abs() < 1e-5 && ((c.second - b).length() - s).abs() < 1e-5, "{c:?}");
            assert!((c.first - c.second).length() < truth + 0.1 * (1.0 + truth), "{c:?}: {truth}");
        } else {
            assert!((c.first - a).length() < r + 1e-3 && (c.second - b).length() < s + 1e-3);
        }
    }
}

#[test]
fn boxes_that_lie_side_by_side() {
    for gap in [0.3, 0.02, 0.0, -0.05, -0.4] {
        let f = cuboid(DVec3::ZERO, DVec3::new(1.0, 0.8, 0.9));
        let g = cuboid(DVec3::new(1.0 + gap, 0.1, 0.1), DVec3::new(2.0, 0.7, 0.8));
        let truth = if gap > 0.0 { gap } else { 0.5 * gap };
        let c = found(&f, &g, 0.02);
        assert!(c.separation.widen(1e-12).contains(truth), "{gap}: {c:?}");
        let expected = if gap > 0.01 {
            Contact::Separated
        } else if gap < -0.1 {
            Contact::Penetrating
        } else {
            c.contact
        };
        assert_eq!(c.contact, expected, "{gap}: {c:?}");
        if gap == 0.0 {
            assert_eq!(c.contact, Contact::Undecided);
        }
    }
}

#[test]
fn fields_enclose_what_their_shapes_do() {
    let mut random = Random::new(3);
    let (ring, other) = (torus(0.7, 0.2), cuboid(DVec3::splat(-0.3), DVec3::new(0.2, 0.25, 0.3)));
    let field = tree(&ring, &near(0.01, 6));
    for _ in 0..12 {
        let shift = random.direction() * random.between(0.0, 2.0);
        let (low, high) = (other.extent.min + shift, other.extent.max + shift);
        let moved = shaped::Shape { extent: Aabb::new(low, high), value: Box::new(move |p| box_value(p, low, high)) };
        let exact = found(&ring, &moved, 0.01);
        let stored = collide(&field, &moved, 0.01, 40_000, &Run::with_threads(2)).expect("an answer");
        // Two intervals that both hold the truth.
        assert!(exact.separation.lower <= stored.separation.upper && stored.separation.lower <= exact.separation.upper);
        // Brute force: no point is better than the lower end.
        let around = ring.extent.union(moved.extent);
        for _ in 0..20_000 {
            let p = random.within(&around);
            let (a, b) = ((ring.value)(p), (moved.value)(p));
            let way = if a.max(b) > 0.0 { a.max(0.0) + b.max(0.0) } else { a.max(b) };
            assert!(way >= exact.separation.lower - 1e-12 && way >= stored.separation.lower - 1e-12, "{way} at {p}");
        }
    }
}

#[test]
fn half_spaces_and_small_budgets() {
    struct Floor;
    impl Distance for Floor {
        fn extent(&self) -> Option<Aabb> {
            None
        }
        fn at(&self, p: DVec3) -> Interval {
            Interval::exact(p.z)
        }
    }
    let c = found(&ball(DVec3::new(5.0, 3.0, 20.0), 1.0), &Floor, 1e-2);
    assert!(c.contact == Contact::Separated && c.separation.contains(19.0), "{c:?}");
    assert!(collide(&Floor, &Floor, 0.1, 10, &Run::default()).is_err());
    let mut before = f64::INFINITY;
    for budget in [1, 100, 1000, 10_000] {
        let c = collide(&ball(DVec3::ZERO, 1.0), &ball(DVec3::X * 3.0, 1.0), 1e-9, budget, &Run::default()).expect("an answer");
        assert!(c.separation.contains(1.0) && c.separation.width() <= before && c.boxes < budget + 600, "{c:?}");
        before = c.separation.width();
    }
    for tolerance in [0.0, -1.0, f64::NAN] {
        assert!(matches!(collide(&Floor, &ball(DVec3::ZERO, 1.0), tolerance, 10, &Run::default()), Err(Error::Invalid(_))));
    }
}

#[test]
fn collisions_do_not_depend_on_threads() {
    let (f, g) = (torus(0.7, 0.2), ball(DVec3::new(0.1, 0.2, 0.9), 0.3));
    check_threads("a collision", |run| {
        let c = collide(&f, &g, 1e-3, PLENTY, run)?;
        let bits = |p: DVec3| p.to_array().map(f64::to_bits);
        Ok((c.separation.lower.to_bits(), c.separation.upper.to_bits(), bits(c.first), bits(c.second), c.boxes))
    })
    .unwrap_or_else(|broken| panic!("{broken}"));
}

/// Two balls whose boxes overlap have nothing in common: the search for a way from nothing ends.
#[test]
fn nothing_is_never_met() {
    let balls: [Arc<dyn Source>; 2] =
        [DVec3::ZERO, DVec3::new(1.5, 1.5, 0.0)].map(|center| Arc::new(Sphere::new(center, 1.0).expect("a ball")) as Arc<dyn Source>);
    let nothing = intersection(&balls).expect("boxes that overlap");
    let other = Sphere::new(DVec3::new(5.0, 0.0, 0.0), 1.0).expect("a ball");
    let found = collide(&nothing, &other, 0.1, 20_000, &Run::default()).expect("an answer");
    assert_ne!(found.contact, Contact::Penetrating);
    let found = collide(&other, &nothing, 0.1, 20_000, &Run::default()).expect("an answer");
    assert_ne!(found.contact, Contact::Penetrating);
}

/// What is inside is told by winding numbers: it ends where nothing is drawn, and a way to it may go through an opening.
#[test]
fn open_meshes_are_as_near_as_their_inside() {
    let holed = |soup: Vec<[DVec3; 3]>, keep: &dyn Fn(DVec3) -> bool| -> Vec<[DVec3; 3]> {
        soup.into_iter().filter(|t| keep((t[0] + t[1] + t[2]) / 3.0)).collect()
    };
    let solids = [
        ("a bowl", holed(shapes::icosphere(2), &|p| p.z < 0.3)),
        ("half a ball", holed(shapes::icosphere(2), &|p| p.x < 0.0)),
        ("a box without a lid", holed(shapes::cuboid(DVec3::splat(-1.0), DVec3::ONE), &|p| p.z < 0.99)),
        ("a ring with a gap", holed(shapes::torus(24, 12, 1.0, 0.3), &|p| p.x < 0.8)),
    ];
    let mut random = Random::new(5);
    let (mut apart, mut together) = (0, 0);
    for (what, soup) in solids {
        let mesh = Arc::new(shapes::welded(&soup));
        let surface = Surface::new(mesh.clone(), SignChoice::Auto, &Run::with_threads(2)).expect("a surface");
        let room = mesh.extent().grow(0.2);
        let place = |random: &mut Random| room.min + room.size() * DVec3::new(random.unit(), random.unit(), random.unit());
        let cloud: Vec<DVec3> = (0..60_000).map(|_| place(&mut random)).collect();
        let bounds = surface.bounds(&cloud, &Run::with_threads(2)).expect("bounds");
        let inside: Vec<DVec3> = cloud.iter().zip(&bounds).filter(|(_, b)| b.upper < 0.0).map(|(&p, _)| p).collect();
        assert!(inside.len() > 500, "{what}: {}", inside.len());
        for _ in 0..60 {
            let (center, radius) = (place(&mut random) * random.between(0.2, 2.0), random.between(0.02, 0.5));
            let c = collide(&surface, &ball(center, radius), 0.02, 3000, &Run::with_threads(2)).expect("an answer");
            let nearest = inside.iter().map(|q| (*q - center).length()).fold(f64::INFINITY, f64::min) - radius;
            assert!(c.separation.lower <= nearest.max(0.0), "{what}, ball of {radius} at {center}: {c:?}, {nearest}");
            match c.contact {
                Contact::Separated => {
                    apart += 1;
                    assert!(nearest > 0.0, "{what}, ball of {radius} at {center}: {c:?}");
                }
                Contact::Penetrating => {
                    together += 1;
                    assert!(surface.at(c.first).lower < 0.0 && (c.first - center).length() < radius, "{what}: {c:?}");
                }
                Contact::Undecided => {}
            }
        }
    }
    assert!(apart > 40 && together > 20, "{apart} apart, {together} together");
}
