//! Affine functions below the distance of a mesh: no point of a box is lower, whatever the mesh, and flat and convex
//! surfaces are seen from afar.

mod nasty;

use std::sync::Arc;

use nasty::{Kind, corpus, judge};
use truefield::laws::Random;
use truefield::{Aabb, DVec3, Distance, Run, SignChoice, Surface, TriangleMesh};

/// A box somewhere about the mesh, of any size and shape; often around a point of the surface, or next to it.
fn some_box(mesh: &TriangleMesh, random: &mut Random) -> Aabb {
    let size = mesh.extent().diagonal();
    let start = if random.below(3) == 0 {
        let around = mesh.extent().grow(random.length(1e-3, 2.0) * size);
        random.within(&around)
    } else {
        let [a, b, c] = mesh.corners(random.below(mesh.triangles().len()) as u32);
        let (u, v) = (random.unit(), random.unit());
        let at = if random.below(4) == 0 { a } else { a + (b - a) * u.min(v) + (c - a) * (u - v).abs() };
        at + random.direction() * (size * random.length(1e-6, 0.5))
    };
    let edge = size * random.length(1e-5, 0.7);
    let mut side = || if random.below(6) == 0 { 0.0 } else { edge * random.unit() };
    let low = DVec3::new(side(), side(), side());
    let high = DVec3::new(side(), side(), side());
    Aabb::new(start - low, start + high)
}

#[test]
fn no_point_of_a_box_is_lower_than_said() {
    let mut random = Random::new(1);
    let (mut planes, mut asked) = (0, 0);
    for nasty in corpus() {
        let mesh = Arc::new(nasty.mesh);
        let truth = |p: DVec3| {
            let way = (0..mesh.triangles().len() as u32).map(|t| mesh.facet(t).distance_squared(p)).fold(f64::INFINITY, f64::min).sqrt();
            match nasty.kind {
                Kind::Solid => judge::winding(&mesh, p).map(|winding| if winding == 0 { way } else { -way }),
                _ => None,
            }
        };
        for choice in [SignChoice::Auto, SignChoice::Winding, SignChoice::Pseudonormal, SignChoice::Unsigned] {
            let surface = Surface::new(Arc::clone(&mesh), choice, &Run::default()).expect("a surface");
            let extent = mesh.extent();
            let allowance = 1e-12 * extent.diagonal() + 1e-15 * extent.min.abs().max(extent.max.abs()).max_element();
            for round in 0..120 {
                let cell = some_box(&mesh, &mut random);
                let (below, center) = (surface.below(&cell), cell.center());
                assert!(below.slope.length() <= 1.0 + 1e-12 && below.value.is_finite(), "{} {choice:?} {below:?}", nasty.name);
                planes += usize::from(below.slope != DVec3::ZERO);
                asked += 1;
                let inner: Vec<DVec3> = (0..24).map(|_| random.within(&cell)).collect();
                let feet = inner.iter().take(8).map(|&p| {
                    let nearest = truefield::Closest::nearest(&surface, p, f64::INFINITY).expect("a point");
                    nearest.point.clamp(cell.min, cell.max)
                });
                for (i, p) in (0..8).map(|corner| cell.corner(corner)).chain(feet).chain(inner.iter().copied()).enumerate() {
                    let said = below.value + below.slope.dot(p - center);
                    let known = surface.at(p);
                    // Where the side is open, the lower end may be as wrong as the side.
                    let most = if known.width() == 0.0 { known.lower } else { known.upper };
                    assert!(said <= most + allowance, "{} {choice:?}: {said} at {p:?} of {cell:?}: {known:?}, {below:?}", nasty.name);
                    if round % 8 == 0
                        && i % 7 == 0
                        && matches!(choice, SignChoice::Auto | SignChoice::Winding)
                        && let Some(truth) = truth(p)
                    {
                        assert!(said <= truth + allowance, "{} {choice:?}: {said} at {p:?} of {cell:?}: {truth}", nasty.name);
                    }
                }
            }
        }
    }
    assert!(2 * planes > asked, "only {planes} of {asked} boxes were told a slope");
}

/// Faces and corners that point at a box say their plane exactly, whatever the size of the box and however fine the mesh.
#[test]
fn what_bulges_toward_a_box_is_seen_from_afar() {
    let mut random = Random::new(2);
    for nasty in corpus().into_iter().filter(|nasty| ["cube", "turned cube", "tetrahedron", "sphere"].contains(&nasty.name)) {
        let mesh = Arc::new(nasty.mesh);
        let surface = Surface::new(Arc::clone(&mesh), SignChoice::Auto, &Run::default()).expect("a surface");
        for _ in 0..300 {
            let size = mesh.extent().diagonal();
            let center = mesh.extent().center() + random.direction() * (size * random.between(0.7, 3.0));
            let reach = surface.at(center).lower * random.between(0.1, 1.5);
            let half = DVec3::new(random.unit(), random.unit(), random.unit()) * reach;
            let below = surface.below(&Aabb::new(center - half, center + half));
            let short = surface.at(center).lower - below.value;
            // What it may give away, in boxes that are as large as the way.
            assert!(short <= half.length() / 1000.0 + 1e-12, "{}: {short} of {half:?} at {center:?}", nasty.name);
            assert!((below.slope.length() - 1.0).abs() < 1e-12, "{}: {below:?}", nasty.name);
        }
    }
}
