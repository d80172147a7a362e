//! Answers outside the domain of a field, and contact of fields that lie apart: against the shapes themselves.

mod shaped;

use std::sync::Arc;

use shaped::{ball, cubic, near, torus, tree, tree_in};
use truefield::build::adaptive::{Leaves, Rules, adaptive, adaptive_mesh, root};
use truefield::field::adaptive::{AdaptiveField, Coverage, Division};
use truefield::laws::Random;
use truefield::op::edit::{Operation, edit};
use truefield::op::level_of_detail::{Detail, level_of_detail};
use truefield::product::collide::{Contact, collide};
use truefield::source::csg::{Cuboid, Sphere, difference};
use truefield::source::polygon::{Fill, Polygon};
use truefield::{Aabb, DVec3, Distance, Run, SignChoice, Source, Surface, TriangleMesh};

fn bowl() -> impl Source {
    let slab: Arc<dyn Source> = Arc::new(Cuboid::new(DVec3::ZERO, DVec3::new(4.0, 4.0, 1.0)).expect("a box"));
    let ball: Arc<dyn Source> = Arc::new(Sphere::new(DVec3::Z * 0.5, 1.2).expect("a ball"));
    difference(&slab, &[ball]).expect("a solid")
}

fn built(source: &dyn Source, tolerance: f64) -> AdaptiveField {
    let root = root(source, None, Division::Octree).expect("a domain");
    adaptive(source, root, &Rules::within(tolerance), &Run::default()).expect("a field")
}

fn outside(random: &mut Random, domain: &Aabb, reach: f64) -> DVec3 {
    loop {
        let p = random.within(&domain.grow(reach * domain.diagonal()));
        if !domain.contains(p) {
            return p;
        }
    }
}

/// Points, boxes and affine functions outside hold the truth, points to within `width`.
fn check(field: &AdaptiveField, truth: &dyn Distance, width: f64, seed: u64) {
    let domain = field.extent_box();
    let mut random = Random::new(seed);
    for n in 0..1500 {
        let reach = [0.01, 0.3, 10.0][n % 3];
        let p = outside(&mut random, &domain, reach);
        let (known, exact) = (field.at(p), truth.at(p));
        let slip = 1e-12 * (1.0 + p.length());
        assert!(known.lower <= exact.upper + slip && exact.lower <= known.upper + slip, "{known:?} is not {exact:?} at {p}");
        assert!(known.lower >= 0.0, "{known:?} at {p} is no side");
        assert!(known.width() <= width + 1e-2 * exact.upper, "{known:?}: {exact:?} at {p}");
        let half = random.within(&Aabb::new(DVec3::splat(1e-3), DVec3::splat(0.4 * domain.diagonal())));
        let cell = Aabb::new(p - half, p + half);
        let (over, below) = (field.over(&cell), field.below(&cell));
        for _ in 0..8 {
            let q = random.within(&cell);
            let exact = truth.at(q);
            assert!(over.lower <= exact.upper + slip && exact.lower <= over.upper + slip, "{over:?} is not {exact:?} at {q} of {cell:?}");
            let least = below.value + below.slope.dot(q - cell.center());
            assert!(least <= exact.upper + slip, "{below:?} is above {exact:?} at {q} of {cell:?}");
        }
    }
}

#[test]
fn distances_outside_are_those_of_the_solid() {
    check(&tree(&ball(DVec3::new(0.1, 0.2, -0.3), 0.7), &Rules::within(1e-2)), &ball(DVec3::new(0.1, 0.2, -0.3), 0.7), 0.05, 1);
    check(&tree(&torus(0.7, 0.2), &near(1e-2, 6)), &torus(0.7, 0.2), 0.4, 2);
    check(&tree(&torus(0.7, 0.2), &cubic(&Rules::within(2e-2))), &torus(0.7, 0.2), 0.1, 3);
    check(&built(&bowl(), 2e-2), &bowl(), 0.4, 4);
}

#[test]
fn a_solid_that_fills_its_domain_touches_its_faces() {
    let solid = Cuboid::new(DVec3::ZERO, DVec3::new(2.0, 1.0, 1.5)).expect("a box");
    let domain = solid.extent();
    let field = adaptive(&solid, root(&solid, domain, Division::Octree).expect("a domain"), &Rules::within(0.01), &Run::default());
    let field = field.expect("a field");
    assert_eq!(field.coverage(), Coverage::Whole);
    check(&field, &solid, 0.1, 5);
}

#[test]
fn meshes_with_linear_and_exact_leaves() {
    let vertices = [[0.0, 0.0, 0.0], [2.0, 0.1, 0.0], [0.3, 1.7, 0.2], [0.4, 0.5, 1.3]].map(DVec3::from_array).to_vec();
    let mesh = TriangleMesh::new(vertices, vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]).expect("a mesh");
    let surface = Arc::new(Surface::new(Arc::new(mesh), SignChoice::Auto, &Run::default()).expect("a surface"));
    let root = root(&*surface, None, Division::Octree).expect("a domain");
    for leaves in [Leaves::Linear, Leaves::Exact, Leaves::Mixed] {
        let field = adaptive_mesh(&surface, root, leaves, &Rules::within(0.02), &Run::default()).expect("a field");
        assert_eq!(field.coverage(), Coverage::Whole);
        check(&field, &*surface, 0.1, 6);
        // After an edit the triangles alone do not say it any more.
        let tool = Sphere::new(DVec3::new(0.4, 0.5, 1.1), 0.3).expect("a ball");
        let carved = edit(&field, &tool, Operation::Carve, u64::MAX, &Run::default()).expect("a field");
        assert_eq!(carved.coverage(), Coverage::Whole);
        let shape: Arc<dyn Source> = Arc::clone(&surface) as Arc<dyn Source>;
        let truth = difference(&shape, &[Arc::new(tool)]).expect("a solid");
        let mut random = Random::new(7);
        for _ in 0..1000 {
            let p = outside(&mut random, &carved.extent_box(), 0.5);
            let (known, exact) = (carved.at(p), truth.at(p));
            assert!(known.lower <= exact.upper + 1e-12 && exact.lower <= known.upper + 1e-12, "{known:?} is not {exact:?} at {p}");
        }
    }
}

#[test]
fn columns_are_the_same_at_every_height() {
    let loops = [vec![[0.0, 0.0], [1.0, 0.0], [1.0, 0.5], [0.2, 1.5]]];
    let shape = Polygon::new(&loops, Fill::EvenOdd).expect("a polygon");
    let root = root(&shape, None, Division::Quadtree).expect("a domain");
    let field = adaptive(&shape, root, &Rules::within(1e-2), &Run::default()).expect("a field");
    assert_eq!(field.coverage(), Coverage::Whole);
    let mut random = Random::new(8);
    for _ in 0..2000 {
        let p = random.within(&root.extent.grow(3.0)) * DVec3::new(1.0, 1.0, 20.0);
        let (known, exact) = (field.at(p), shape.at(p));
        assert!(known.lower <= exact.upper + 1e-12 && exact.lower <= known.upper + 1e-12, "{known:?} is not {exact:?} at {p}");
        assert!(known.width() < 0.2, "{known:?} at {p}");
    }
}

#[test]
fn what_a_field_knows_of_its_domain_is_kept_or_lost() {
    let shape = ball(DVec3::ZERO, 1.0);
    let field = tree(&shape, &near(0.05, 5));
    assert_eq!(field.coverage(), Coverage::Whole);
    let part = tree_in(&shape, Some(Aabb::new(DVec3::splat(-0.5), DVec3::splat(2.0))), &near(0.05, 5));
    assert_eq!(part.coverage(), Coverage::Unknown);
    let tool = |x: f64| Sphere::new(DVec3::X * x, 0.3).expect("a ball");
    let edited = |x: f64, operation| edit(&field, &tool(x), operation, u64::MAX, &Run::default()).expect("a field").coverage();
    for (x, inside) in [(0.9, Coverage::Whole), (1.2, Coverage::Unknown)] {
        assert_eq!(edited(x, Operation::Carve), Coverage::Whole);
        assert_eq!(edited(x, Operation::Intersect), Coverage::Whole);
        assert_eq!(edited(x, Operation::Fill), inside);
    }
    // A fillet reaches farther than the tool.
    assert_eq!(edited(0.9, Operation::Blend(0.2)), Coverage::Unknown);
    assert_eq!(edited(0.8, Operation::Blend(0.1)), Coverage::Whole);
    let coarse = level_of_detail(&field, Detail::Depth(3), &Run::default()).expect("a field");
    assert_eq!(coarse.coverage(), Coverage::Whole);
    let mut random = Random::new(9);
    for field in [&coarse, &edit(&field, &tool(1.2), Operation::Fill, u64::MAX, &Run::default()).expect("a field")] {
        for _ in 0..500 {
            let p = outside(&mut random, &field.extent_box(), 0.4);
            let grown = (p - DVec3::X * 1.2).length() - 0.3;
            let exact = if field.coverage() == Coverage::Whole { p.length() - 1.0 } else { (p.length() - 1.0).min(grown) };
            assert!(field.at(p).widen(1e-12).contains(exact), "{:?} is not {exact} at {p}", field.at(p));
        }
    }
    let again = AdaptiveField::from_levels(&part.to_levels(), None, &Run::default()).expect("a field");
    assert_eq!(again.coverage(), Coverage::Unknown);
    let again = AdaptiveField::from_levels(&field.to_levels(), None, &Run::default()).expect("a field");
    assert_eq!(again.coverage(), Coverage::Whole);
}

#[test]
fn fields_apart_touching_overlapping_and_within_each_other() {
    let (shape, tolerance) = (bowl(), 1e-2);
    let field = built(&shape, tolerance);
    // Where a ball lies, and how far it is from the slab with the bowl.
    let rim = |p: DVec3, r: f64| (DVec3::new(p.x, p.y, 0.0).length() - 1.2).hypot(p.z - 0.5) - r;
    let cases = [
        (DVec3::new(0.0, 0.0, 2.5), 0.5, rim(DVec3::new(0.0, 0.0, 2.5), 0.5)),
        (DVec3::new(3.5, 0.3, 0.0), 1.0, 0.5),
        (DVec3::new(50.0, 20.0, 10.0), 1.0, DVec3::new(48.0, 18.0, 9.5).length() - 1.0),
        (DVec3::new(0.1, 0.2, 0.5), 0.5, 0.7 - 0.05_f64.sqrt()),
        (DVec3::new(3.0, 0.3, 0.0), 1.0, 0.0),
        (DVec3::new(2.5, 0.3, 0.0), 1.0, -0.25),
        (DVec3::new(1.6, 0.0, 0.0), 0.15, -0.15),
    ];
    for (center, radius, truth) in cases {
        let ball = Sphere::new(center, radius).expect("a ball");
        let other = built(&ball, tolerance);
        let pairs: [(&dyn Distance, &dyn Distance); 3] = [(&field, &other), (&other, &field), (&field, &ball)];
        for (f, g) in pairs {
            let c = collide(f, g, 0.1, 100_000, &Run::with_threads(2)).expect("an answer");
            assert!(c.separation.widen(1e-12).contains(truth), "{center}: {c:?} is not {truth}");
            assert!(c.separation.width() <= 0.12 && c.boxes < 40_000, "{center}: {c:?}");
            let expected = if truth > 0.0 { Contact::Separated } else { Contact::Penetrating };
            assert!(truth == 0.0 || c.contact == expected, "{center}: {c:?}");
            if c.contact == Contact::Separated {
                let way = (c.first - c.second).length();
                assert!((way - truth).abs() < 0.1, "{center}: a way of {way} for {truth}: {c:?}");
                for (solid, p) in [(f, c.first), (g, c.second)] {
                    let known = solid.at(p);
                    assert!(known.lower <= 0.02 && known.upper >= -0.02, "{p} is off by {known:?}");
                }
            }
        }
    }
}

#[test]
fn faces_that_run_in_parallel_are_seen_from_afar() {
    let slab = Cuboid::new(DVec3::ZERO, DVec3::new(4.0, 4.0, 1.0)).expect("a box");
    let field = built(&slab, 2e-3);
    for gap in [3.0, 0.5, 0.06] {
        let other = Cuboid::new(DVec3::new(0.3, 0.2, 1.0 + gap), DVec3::new(3.0, 3.0, 1.0)).expect("a box");
        let c = collide(&field, &built(&other, 2e-3), 0.02, 100_000, &Run::with_threads(2)).expect("an answer");
        assert!(c.contact == Contact::Separated && c.separation.widen(1e-12).contains(gap), "{gap}: {c:?}");
        assert!(c.separation.width() <= 0.02 && c.boxes < 20_000, "{gap}: {c:?}");
    }
}
