//! Surfaces of adaptive fields: closed, oriented and manifold whatever the field, and where they should be.

mod shaped;

use std::collections::BTreeMap;

use shaped::{Shape, ball, ball_value, box_value, cubic, cuboid, near, random_tree, torus, tree, tree_in};
use truefield::build::adaptive::Rules;
use truefield::field::adaptive::{AdaptiveField, Division};
use truefield::laws::{Random, check_threads};
use truefield::product::dual::surface;
use truefield::{Aabb, DVec3, Distance, Error, Run, TriangleMesh};

const PLENTY: u64 = 1 << 32;

fn made(field: &AdaptiveField, distance: f64) -> TriangleMesh {
    surface(field, distance, None, PLENTY, &Run::with_threads(2)).expect("a surface")
}

/// Closed, oriented, two triangles on each edge and one fan around each vertex; every vertex used.
fn check_manifold(mesh: &TriangleMesh, name: &str) {
    let mut sides: BTreeMap<(u32, u32), u32> = BTreeMap::new();
    for t in mesh.triangles() {
        for i in 0..3 {
            assert_ne!(t[i], t[(i + 1) % 3], "{name}: a triangle with one corner twice");
            let before = sides.insert((t[i], t[(i + 1) % 3]), t[(i + 2) % 3]);
            assert_eq!(before, None, "{name}: side {} {} occurs twice", t[i], t[(i + 1) % 3]);
        }
    }
    let mut degree = vec![0usize; mesh.vertices().len()];
    for &(a, b) in sides.keys() {
        assert!(sides.contains_key(&(b, a)), "{name}: side {a} {b} has no other");
        degree[a as usize] += 1;
    }
    for t in mesh.triangles() {
        // Once around the first corner.
        let (v, mut at, mut count) = (t[0], t[1], 0);
        loop {
            at = sides[&(v, at)];
            count += 1;
            if at == t[1] {
                break;
            }
        }
        assert_eq!(count, degree[v as usize], "{name}: more than one fan around vertex {v}");
    }
    assert!(degree.iter().all(|&d| d > 2), "{name}: a vertex without triangles");
}

fn volume(mesh: &TriangleMesh) -> f64 {
    let each = (0..mesh.triangles().len()).map(|t| {
        let [a, b, c] = mesh.corners(t as u32);
        a.dot(b.cross(c)) / 6.0
    });
    each.sum()
}

#[test]
fn random_trees_of_random_values_have_manifold_surfaces() {
    let mut random = Random::new(1);
    let (mut made, mut crowded) = (0, 0);
    for round in 0..600u64 {
        let division = if round % 4 == 3 { Division::Quadtree } else { Division::Octree };
        let depth = if division == Division::Quadtree { 2 + random.below(5) as u32 } else { 1 + random.below(4) as u32 };
        let bias = random.between(-0.7, 0.7);
        let value = |at: [u32; 3]| {
            let key = u64::from(at[0]) | u64::from(at[1]) << 16 | u64::from(at[2]) << 32 | round << 48;
            (Random::new(key).between(-1.0, 1.0) + bias) as f32
        };
        let field = random_tree(&mut random, Aabb::new(DVec3::new(0.3, -1.0, 2.0), DVec3::new(1.3, 0.0, 3.0)), division, depth, value);
        let Ok(mesh) = surface(&field, 0.0, None, PLENTY, &Run::with_threads(2)) else { continue };
        check_manifold(&mesh, &format!("tree {round}"));
        assert!(volume(&mesh) > -1e-9, "tree {round}");
        let extent = field.extent_box();
        assert!(mesh.vertices().iter().all(|&v| extent.contains(v)));
        made += 1;
        crowded += usize::from(mesh.triangles().len() > 500);
    }
    assert!(made > 500 && crowded > 100, "{made} surfaces, {crowded} of them large");
}

/// Largest distance of the mesh's vertices and points of its triangles from a surface.
fn farthest(mesh: &TriangleMesh, value: impl Fn(DVec3) -> f64) -> f64 {
    let mut random = Random::new(3);
    let mut most = 0.0_f64;
    for t in 0..mesh.triangles().len() as u32 {
        let [a, b, c] = mesh.corners(t);
        for _ in 0..3 {
            let (u, v) = (random.unit(), random.unit());
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            most = most.max(value(a + (b - a) * u + (c - a) * v).abs());
        }
        most = most.max(value(a).abs());
    }
    most
}

/// Genus of a closed mesh of one piece.
fn genus(mesh: &TriangleMesh) -> i64 {
    let (vertices, triangles) = (mesh.vertices().len() as i64, mesh.triangles().len() as i64);
    (2 - (vertices - triangles / 2)) / 2
}

#[test]
fn balls_boxes_and_rings_at_any_distance() {
    let tolerance = 0.02;
    let shapes: [(&str, Shape, i64); 3] = [
        ("ball", ball(DVec3::new(0.1, 0.2, -0.3), 0.8), 0),
        ("box", cuboid(DVec3::new(-0.5, -0.61, -0.72), DVec3::new(0.513, 0.4, 0.31)), 0),
        ("ring", torus(0.7, 0.2), 1),
    ];
    for (name, shape, holes) in &shapes {
        for rules in [Rules::within(tolerance), cubic(&Rules::within(tolerance)), near(tolerance, 7)] {
            let field = tree(shape, &rules);
            for distance in [0.0, 0.05, -0.1] {
                let name = format!("{name} at {distance}");
                let mesh = made(&field, distance);
                check_manifold(&mesh, &name);
                assert_eq!(genus(&mesh), *holes, "{name}");
                // What the cells may be off there, and as much again for the way from vertex to vertex.
                let allowed = tolerance + 0.05 * f64::abs(distance);
                let away = farthest(&mesh, |p| (shape.value)(p) - distance);
                assert!(away < 2.0 * allowed, "{name}: {away}");
                // The other way: no place of the contour is far from the mesh.
                let surface = truefield::Surface::new(mesh.into(), truefield::SignChoice::Auto, &Run::default()).expect("a surface");
                let mut random = Random::new(5);
                for _ in 0..3000 {
                    let p = random.within(&shape.extent.grow(0.1));
                    let truth = (shape.value)(p) - distance;
                    let found = surface.at(p);
                    assert!(found.lower == found.upper, "{name}: the side is not known");
                    // Where the shape's formula is no distance there is nothing to compare.
                    if truth.abs() < 0.3 && truth * distance >= 0.0 {
                        assert!((found.lower - truth).abs() < 3.0 * allowed, "{name}: {} is {truth} at {p}", found.lower);
                    }
                }
            }
        }
    }
}

#[test]
fn edges_and_corners_are_kept_where_the_shape_is_asked() {
    let (low, high) = (DVec3::new(-0.5, -0.61, -0.72), DVec3::new(0.513, 0.4, 0.31));
    let shape = cuboid(low, high);
    let field = tree(&shape, &near(0.001, 6));
    let mesh = surface(&field, 0.0, Some(&shape), PLENTY, &Run::default()).expect("a surface");
    check_manifold(&mesh, "box");
    let size = high - low;
    assert!((volume(&mesh) / (size.x * size.y * size.z) - 1.0).abs() < 1e-6, "{}", volume(&mesh));
    assert!(farthest(&mesh, |p| (shape.value)(p)) < 1e-6);
    for corner in 0..8 {
        let at = Aabb::new(low, high).corner(corner);
        let nearest = mesh.vertices().iter().map(|v| v.distance(at)).fold(f64::INFINITY, f64::min);
        assert!(nearest < 1e-6, "corner {corner}: {nearest}");
    }
    // Without, they are rounded within a cell.
    let mesh = made(&field, 0.0);
    assert!((volume(&mesh) / (size.x * size.y * size.z) - 1.0).abs() < 0.01);
}

#[test]
fn nasty_solids_have_manifold_surfaces() {
    let o = DVec3::ZERO;
    let v = DVec3::new;
    let shapes: Vec<(&str, Shape)> = vec![
        (
            "two balls that touch",
            Shape::new([-1.0; 3], [1.0; 3], move |p| ball_value(p, v(-0.5, 0.0, 0.0), 0.5).min(ball_value(p, v(0.5, 0.0, 0.0), 0.5))),
        ),
        (
            "two balls that nearly touch",
            Shape::new([-1.0; 3], [1.0; 3], move |p| ball_value(p, v(-0.5, 0.01, 0.0), 0.497).min(ball_value(p, v(0.5, 0.0, 0.02), 0.497))),
        ),
        (
            "boxes that share an edge",
            Shape::new([-1.0; 3], [1.0; 3], move |p| {
                box_value(p, o, v(0.9, 0.8, 0.7)).min(box_value(p, v(-0.7, -0.8, 0.0), v(0.0, 0.0, 0.7)))
            }),
        ),
        (
            "boxes that share a corner",
            Shape::new([-1.0; 3], [1.0; 3], move |p| box_value(p, o, v(0.9, 0.8, 0.7)).min(box_value(p, v(-0.7, -0.8, -0.6), o))),
        ),
        (
            "a thin wall",
            Shape::new([-1.0; 3], [1.0; 3], move |p| ball_value(p, o, 0.9).max(-ball_value(p, v(0.0, 0.05, 0.0), 0.88)).max(p.z)),
        ),
        (
            "a sharp wedge",
            Shape::new([-1.0; 3], [1.0; 3], move |p| {
                box_value(p, v(-0.9, -0.9, -0.9), v(0.9, 0.9, 0.9)).max((p.z + 0.1 * p.x) / 1.005).max((-p.z + 0.1 * p.x - 0.1) / 1.005)
            }),
        ),
        (
            "a grid of holes",
            Shape::new([-1.0; 3], [1.0; 3], move |p| {
                let hole = |x: f64, y: f64| ((x * 4.0).fract().abs() - 0.5).hypot((y * 4.0).fract().abs() - 0.5) / 4.0 - 0.08;
                box_value(p, v(-0.8, -0.8, -0.8), v(0.8, 0.8, 0.8)).max(-hole(p.x, p.y)).max(-hole(p.y, p.z)).max(-hole(p.z, p.x))
            }),
        ),
    ];
    for (name, shape) in &shapes {
        for depth in [4, 5, 6] {
            let field = tree(shape, &near(0.004, depth));
            for distance in [0.0, 0.02, -0.01, -0.03] {
                for asked in [None, Some(shape as &dyn truefield::Source)] {
                    let name = format!("{name} to depth {depth} at {distance}");
                    let Ok(mesh) = surface(&field, distance, asked, PLENTY, &Run::with_threads(2)) else { continue };
                    check_manifold(&mesh, &name);
                    assert!(volume(&mesh) > 0.0, "{name}");
                    for &vertex in mesh.vertices() {
                        let cell = field.extent_box().size().x / f64::from(1 << 3);
                        assert!(((shape.value)(vertex) - distance).abs() < cell, "{name}: {vertex}");
                    }
                }
            }
        }
    }
}

#[test]
fn surfaces_are_closed_where_the_domain_ends() {
    let shape = ball(DVec3::ZERO, 1.0);
    let domain = Aabb::new(DVec3::splat(-0.8), DVec3::splat(0.8));
    let field = tree_in(&shape, Some(domain), &near(0.005, 6));
    let mesh = made(&field, 0.0);
    check_manifold(&mesh, "a ball cut by a box");
    assert_eq!(genus(&mesh), 0);
    // The ball without six caps.
    let (pi, h) = (std::f64::consts::PI, 0.2);
    let expected = 4.0 / 3.0 * pi - 6.0 * pi * h * h * (3.0 - h) / 3.0;
    assert!((volume(&mesh) / expected - 1.0).abs() < 0.01, "{} of {expected}", volume(&mesh));
    assert_eq!((mesh.extent().min, mesh.extent().max), (domain.min, domain.max));
    // All of the domain.
    let mesh = made(&tree_in(&ball(DVec3::ZERO, 10.0), Some(domain), &Rules { growth: 0.0, max_depth: 3, ..Rules::within(1e-9) }), 0.0);
    check_manifold(&mesh, "a box");
    assert!((volume(&mesh) - 1.6_f64.powi(3)).abs() < 1e-9, "{}", volume(&mesh));
}

#[test]
fn columns_have_straight_walls_and_flat_ends() {
    let mut random = Random::new(9);
    // A disc on a lattice of 64 x 64.
    let value = |at: [u32; 3]| ((f64::from(at[0]) / 64.0 - 0.5).hypot(f64::from(at[1]) / 64.0 - 0.5) - 0.3) as f32;
    let extent = Aabb::new(DVec3::ZERO, DVec3::new(1.0, 1.0, 0.25));
    let field = random_tree(&mut random, extent, Division::Quadtree, 6, value);
    let mesh = made(&field, 0.0);
    check_manifold(&mesh, "a disc");
    assert_eq!((mesh.extent().min.z, mesh.extent().max.z), (0.0, 0.25));
    for v in mesh.vertices() {
        assert!(v.z.min(0.25 - v.z) < 1e-6, "{v}");
    }
    assert!((volume(&mesh) / (std::f64::consts::PI * 0.09 * 0.25) - 1.0).abs() < 0.1, "{}", volume(&mesh));
}

#[test]
fn surfaces_do_not_depend_on_threads() {
    let shape = torus(0.7, 0.2);
    let field = tree(&shape, &near(0.003, 7));
    check_threads("a surface", |run| {
        let mesh = surface(&field, 0.01, Some(&shape), PLENTY, run)?;
        Ok((mesh.vertices().iter().map(|v| v.to_array().map(f64::to_bits)).collect::<Vec<_>>(), mesh.triangles().to_vec()))
    })
    .unwrap_or_else(|broken| panic!("{broken}"));
}

#[test]
fn surfaces_that_cannot_be_are_refused() {
    let field = tree(&torus(0.7, 0.2), &near(0.05, 5));
    let run = Run::default();
    for distance in [f64::NAN, f64::INFINITY, -0.5] {
        assert!(matches!(surface(&field, distance, None, PLENTY, &run), Err(Error::Invalid(_))), "{distance}");
    }
    assert!(matches!(surface(&field, 0.0, None, 1000, &run), Err(Error::Memory { .. })));
}
