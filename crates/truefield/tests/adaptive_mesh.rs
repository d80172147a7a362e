//! Trees of meshes: bounds against the surface itself, whose answers have the bits of brute force.

mod nasty;

use std::sync::Arc;

use nasty::{corpus, shapes};
use truefield::build::adaptive::{Leaves, Rule, Rules, adaptive, adaptive_mesh, root};
use truefield::field::adaptive::{AdaptiveField, Division, Leaf};
use truefield::laws::{Random, places};
use truefield::{Aabb, DVec3, Distance, Run, SignChoice, Surface, TriangleMesh};

fn surface(mesh: TriangleMesh) -> Arc<Surface> {
    Arc::new(Surface::new(Arc::new(mesh), SignChoice::Auto, &Run::with_threads(2)).expect("a surface"))
}

fn build(surface: &Arc<Surface>, leaves: Leaves, rules: &Rules, threads: usize) -> AdaptiveField {
    let place = root(&**surface, None, Division::Octree).expect("a box");
    adaptive_mesh(surface, place, leaves, rules, &Run::with_threads(threads))
        .unwrap_or_else(|error| panic!("{error} {:?}", surface.mesh().extent()))
}

/// Rules relative to the size of the part.
fn rules(surface: &Surface, tolerance: f64, max_depth: u32, growth: f64, rule: Rule) -> Rules {
    Rules { rule, growth, max_depth, ..Rules::within(tolerance * surface.mesh().extent().diagonal()) }
}

fn holds(name: &str, field: &AdaptiveField, surface: &Surface, rules: &Rules, count: usize) {
    let run = Run::with_threads(2);
    let mut random = Random::new(11);
    let mut points = places(surface.mesh(), count, 5);
    points.extend((0..count).map(|_| random.within(&field.extent_box().grow(0.1 * field.extent_box().size().x))));
    let truth = surface.bounds(&points, &run).expect("answers");
    let found = field.bounds(&points, &run).expect("answers");
    let said = field.distances(&points, &run).expect("answers");
    for (i, &p) in points.iter().enumerate() {
        let (truth, found, said) = (truth[i], found[i], said[i]);
        let inside = found.lower <= truth.lower && truth.upper <= found.upper;
        assert!(inside, "{name}: {truth:?} at {p:?} is not in {found:?}, {rules:?}");
        let Some(leaf) = field.find(p) else { continue };
        assert!(
            leaf.over().lower <= truth.lower && truth.upper <= leaf.over().upper,
            "{name}: {truth:?} at {p:?} is not in {:?}",
            leaf.over()
        );
        if matches!(leaf.leaf(), Leaf::Exact(_)) {
            assert!(found == truth && truth.contains(said), "{name}: {found:?} at {p:?} is not {truth:?}");
        } else if rules.rule == Rule::Verified && leaf.depth() < rules.max_depth && truth.width() == 0.0 {
            let allowed = rules.tolerance + if rules.growth.is_finite() { rules.growth * truth.lower.abs() } else { f64::INFINITY };
            assert!((said - truth.lower).abs() <= allowed * (1.0 + 1e-6), "{name}: {said} at {p:?} is not {truth:?}");
        }
    }
    let mut cell = field.root();
    for _ in 0..2000 {
        let part = Aabb::new(random.within(&field.extent_box()), random.within(&field.extent_box()));
        let part = Aabb::around([part.min, part.max]);
        let p = random.within(&part);
        let (range, truth) = (field.over(&part), surface.at(p));
        assert!(range.lower <= truth.lower && truth.upper <= range.upper, "{name}: {truth:?} at {p:?} is not in {range:?} over {part:?}");
        cell = if cell.is_leaf() { field.root() } else { cell.child(random.below(8)) };
        let p = random.within(&cell.extent());
        let (range, truth) = (cell.over(), surface.at(p));
        assert!(range.lower <= truth.lower && truth.upper <= range.upper, "{name}: {truth:?} at {p:?} is not in {range:?}, an inner cell");
    }
}

#[test]
fn bounds_hold_the_truth_of_every_nasty_mesh() {
    for nasty in corpus() {
        let surface = surface(nasty.mesh.clone());
        if surface.mesh().extent().diagonal() > 1e38 {
            let place = root(&*surface, None, Division::Octree).expect("a box");
            let error = adaptive_mesh(&surface, place, Leaves::Linear, &Rules::within(1.0), &Run::default()).expect_err("too large");
            assert!(error.to_string().contains("scale it down"));
            continue;
        }
        for (leaves, rule, growth) in [
            (Leaves::Linear, Rule::Verified, 0.1),
            (Leaves::Linear, Rule::Samples, f64::INFINITY),
            (Leaves::Exact, Rule::Verified, 0.0),
            (Leaves::Mixed, Rule::Verified, 0.1),
            (Leaves::Mixed, Rule::Samples, 0.0),
        ] {
            let rules = rules(&surface, 0.01, 5, growth, rule);
            holds(nasty.name, &build(&surface, leaves, &rules, 2), &surface, &rules, 4000);
        }
        // The mesh as any shape, which only answers points.
        let rules = rules(&surface, 0.01, 4, 0.1, Rule::Verified);
        let place = root(&*surface, None, Division::Octree).expect("a box");
        let field = adaptive(&*surface, place, &rules, &Run::default()).expect("a field");
        let mut random = Random::new(21);
        for _ in 0..2000 {
            let p = random.within(&field.extent_box());
            let (found, truth) = (field.at(p).widen(1e-12 * surface.mesh().extent().diagonal()), surface.at(p));
            assert!(found.lower <= truth.upper && truth.lower <= found.upper, "{}: {truth:?} at {p} is not in {found:?}", nasty.name);
        }
    }
}

/// Squares of its lengths are no numbers of single precision.
#[test]
fn bounds_hold_in_a_domain_of_any_size() {
    let open = {
        let whole = shapes::welded(&shapes::icosphere(2));
        let triangles = whole.triangles()[5..].to_vec();
        TriangleMesh::new(whole.vertices().to_vec(), triangles).expect("a mesh")
    };
    for mesh in [shapes::welded(&shapes::icosphere(2)), open] {
        let surface = surface(mesh);
        for reach in [1e19, 1e20, 1e30, 9e37] {
            let place = root(&*surface, Some(Aabb::new(DVec3::splat(-reach), DVec3::splat(reach))), Division::Octree).expect("a box");
            for leaves in [Leaves::Linear, Leaves::Exact, Leaves::Mixed] {
                let rules = Rules { max_depth: 4, ..Rules::within(1e-2 * reach) };
                let field = adaptive_mesh(&surface, place, leaves, &rules, &Run::default()).expect("a tree");
                let mut random = Random::new(5);
                for _ in 0..500 {
                    let p = random.within(&place.extent) * random.length(0.3 / reach, 1.0);
                    let (found, truth) = (field.at(p), surface.at(p));
                    assert!(found.lower <= truth.lower && truth.upper <= found.upper, "{truth:?} at {p} is not in {found:?}, {leaves:?}");
                }
            }
        }
    }
}

#[test]
fn bounds_hold_close_to_smooth_sharp_and_rough_surfaces() {
    let parts = [
        ("a ball", shapes::icosphere(4)),
        ("a torus", shapes::torus(60, 30, 1.0, 0.35)),
        ("a rough scan", shapes::scan(60, 60, 3)),
        ("a star", shapes::star(7, 0.5, 0.4)),
    ];
    for (name, soup) in parts {
        let surface = surface(shapes::welded(&soup));
        for (rule, growth) in [(Rule::Verified, 0.0), (Rule::Verified, 0.05), (Rule::Samples, 0.05)] {
            let rules = rules(&surface, 2e-3, 7, growth, rule);
            holds(name, &build(&surface, Leaves::Linear, &rules, 2), &surface, &rules, 60_000);
        }
    }
}

#[test]
fn bounds_hold_where_normals_lean_as_far_as_they_are_relied_on() {
    for steep in [0.2, 1.0, 3.0, 10.0] {
        let stretched = shapes::scan(24, 24, 5).into_iter().map(|triangle| triangle.map(|p| p * DVec3::new(1.0, 1.0, steep)));
        let surface = surface(shapes::welded(&stretched.collect::<Vec<_>>()));
        for (tolerance, max_depth) in [(3e-3, 6), (2e-2, 5)] {
            let rules = rules(&surface, tolerance, max_depth, 0.05, Rule::Verified);
            holds("a stretched scan", &build(&surface, Leaves::Linear, &rules, 2), &surface, &rules, 40_000);
        }
    }
}

#[test]
fn triangles_prove_more_than_the_mesh_as_any_shape() {
    let surface = surface(shapes::welded(&shapes::cube()));
    let rules = rules(&surface, 1e-2, 8, 0.05, Rule::Verified);
    let by_triangles = build(&surface, Leaves::Linear, &rules, 2).statistics().leaves;
    let place = root(&*surface, None, Division::Octree).expect("a box");
    let by_values = adaptive(&*surface, place, &rules, &Run::default()).expect("a field").statistics().leaves;
    assert!(by_triangles < by_values, "{by_triangles} leaves and {by_values}");
}

#[test]
fn far_from_the_origin_no_cell_is_on_the_wrong_side() {
    // Faces run through corners of cells, which rounding puts on either side.
    let (radius, parts) = (0.95, 20);
    for far in [10.1, 1000.7, 1e4 + 0.3, 1e6 + 0.1] {
        let center = DVec3::new(far, -1.1 * far, 0.9 * far);
        let mut soup = Vec::new();
        for octant in 0..8u32 {
            let sign = |axis: usize| if octant >> axis & 1 == 1 { -radius } else { radius };
            let ends = [DVec3::X * sign(0), DVec3::Y * sign(1), DVec3::Z * sign(2)];
            let turned = octant.count_ones() % 2 == 1;
            let at = |i: u32, j: u32| {
                let (s, t) = (f64::from(i) / f64::from(parts), f64::from(j) / f64::from(parts));
                center + ends[0] * (1.0 - s - t) + ends[1] * s + ends[2] * t
            };
            let mut add = |[a, b, c]: [DVec3; 3]| soup.push(if turned { [a, c, b] } else { [a, b, c] });
            for i in 0..parts {
                for j in 0..parts - i {
                    add([at(i, j), at(i + 1, j), at(i, j + 1)]);
                    if i + j + 2 <= parts {
                        add([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
                    }
                }
            }
        }
        let surface = surface(shapes::welded(&soup));
        let place = root(&*surface, Some(Aabb::new(center - 2.0 * radius, center + 2.0 * radius)), Division::Octree).expect("a box");
        for leaves in [Leaves::Linear, Leaves::Exact, Leaves::Mixed] {
            let rules = Rules { max_depth: 8, ..Rules::within(4e-3) };
            let field = adaptive_mesh(&surface, place, leaves, &rules, &Run::with_threads(2)).expect("a tree");
            let (mut random, mut points) = (Random::new(31), Vec::new());
            field.walk(&mut |cell| {
                if cell.is_leaf() {
                    points.push(random.within(&cell.extent()));
                }
                true
            });
            let bounds = field.bounds(&points, &Run::with_threads(2)).expect("answers");
            for (p, bounds) in points.iter().zip(bounds) {
                let outside = (*p - center).abs().element_sum() - radius;
                let wrong = if outside > 0.0 { bounds.upper < 0.0 } else { bounds.lower > 0.0 };
                assert!(!wrong || outside.abs() < 1e-6, "{leaves:?} at {p} of {center}: {bounds:?}, {outside} outside");
            }
        }
    }
}

#[test]
fn trees_are_the_same_for_any_number_of_threads() {
    let surface = surface(shapes::welded(&shapes::scan(30, 30, 3)));
    for leaves in [Leaves::Linear, Leaves::Exact, Leaves::Mixed] {
        let rules = rules(&surface, 5e-3, 7, 0.1, Rule::Verified);
        let one = build(&surface, leaves, &rules, 1).to_levels();
        for threads in [2, 3, 7] {
            assert!(build(&surface, leaves, &rules, threads).to_levels() == one);
        }
    }
}

#[test]
fn too_fine_a_tree_is_refused_and_says_what_to_do() {
    let surface = surface(shapes::welded(&shapes::icosphere(4)));
    let place = root(&*surface, None, Division::Octree).expect("a box");
    let rules = Rules { memory: 4 << 20, ..Rules::within(1e-5) };
    let error = adaptive_mesh(&surface, place, Leaves::Linear, &rules, &Run::default()).expect_err("too fine").to_string();
    assert!(error.contains("MiB") && error.contains("larger tolerance"), "{error}");
}
