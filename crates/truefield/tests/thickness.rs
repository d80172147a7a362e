//! Depth, heavy sections and wall thickness against solids whose answers are known.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use truefield::product::thickness::{Options, greatest_depth, heavy_sections, thickness, wall_thickness};
use truefield::{Cancel, DVec3, Distance, Error, Run, SignChoice, Surface, TriangleMesh};

/// The union of the filled boxes of a rectilinear grid, as a closed mesh of their outer faces.
fn blocks(steps: [&[f64]; 3], filled: impl Fn([usize; 3]) -> bool) -> TriangleMesh {
    let counts = steps.map(|s| s.len() - 1);
    let [nx, ny, nz] = steps.map(<[f64]>::len);
    let vertices = (0..nx * ny * nz).map(|i| DVec3::new(steps[0][i % nx], steps[1][i / nx % ny], steps[2][i / nx / ny])).collect();
    let vertex = |i: [usize; 3]| (i[0] + nx * (i[1] + ny * i[2])) as u32;
    let mut triangles = Vec::new();
    for cell in 0..counts.iter().product() {
        let at = [cell % counts[0], cell / counts[0] % counts[1], cell / counts[0] / counts[1]];
        if !filled(at) {
            continue;
        }
        for axis in 0..3 {
            for high in [false, true] {
                let mut other = at;
                other[axis] = other[axis].wrapping_add(if high { 1 } else { usize::MAX });
                if other[axis] < counts[axis] && filled(other) {
                    continue;
                }
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                let corner = |du: usize, dv: usize| {
                    let mut i = at;
                    i[axis] += usize::from(high);
                    i[u] += du;
                    i[v] += dv;
                    vertex(i)
                };
                let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                triangles.extend(if high { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] });
            }
        }
    }
    TriangleMesh::new(vertices, triangles).expect("blocks")
}

fn cuboid(size: DVec3) -> TriangleMesh {
    blocks([&[0.0, size.x], &[0.0, size.y], &[0.0, size.z]], |_| true)
}

/// A closed profile `(radius, height)`, counter-clockwise seen with radius to the right, turned about z.
fn lathe(profile: &[(f64, f64)], steps: usize) -> TriangleMesh {
    let mut vertices = Vec::new();
    let mut ring = Vec::new();
    for &(r, z) in profile {
        ring.push(vertices.len());
        let count = if r == 0.0 { 1 } else { steps };
        vertices.extend((0..count).map(|i| {
            let (sin, cos) = (i as f64 / steps as f64 * TAU).sin_cos();
            DVec3::new(r * cos, r * sin, z)
        }));
    }
    let vertex = |p: usize, i: usize| (ring[p] + if profile[p].0 == 0.0 { 0 } else { i % steps }) as u32;
    let mut triangles = Vec::new();
    for p in 0..profile.len() {
        let q = (p + 1) % profile.len();
        for i in 0..steps {
            let [a, b, c, d] = [vertex(p, i), vertex(p, i + 1), vertex(q, i + 1), vertex(q, i)];
            triangles.extend([[a, b, c], [a, c, d]].into_iter().filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]));
        }
    }
    TriangleMesh::new(vertices, triangles).expect("a lathe part")
}

fn circle(center: (f64, f64), radius: f64, from: f64, to: f64, steps: usize) -> Vec<(f64, f64)> {
    (0..=steps)
        .map(|i| {
            let (sin, cos) = (from + (to - from) * i as f64 / steps as f64).sin_cos();
            let r = center.0 + radius * cos;
            (if r.abs() < 1e-12 { 0.0 } else { r }, center.1 + radius * sin)
        })
        .collect()
}

fn sphere(radius: f64, steps: usize) -> TriangleMesh {
    lathe(&circle((0.0, 0.0), radius, -PI / 2.0, PI / 2.0, steps / 2), steps)
}

fn cylinder(radius: f64, height: f64, steps: usize) -> TriangleMesh {
    lathe(&[(0.0, 0.0), (radius, 0.0), (radius, height), (0.0, height)], steps)
}

fn torus(major: f64, minor: f64, steps: usize) -> TriangleMesh {
    let mut profile = circle((major, 0.0), minor, 0.0, TAU, steps / 2);
    profile.pop();
    lathe(&profile, steps)
}

/// Turned about an odd axis and moved.
fn moved(mesh: &TriangleMesh, by: DVec3) -> TriangleMesh {
    let axis = DVec3::new(0.3, -0.5, 0.81).normalize();
    let (sin, cos) = 0.77f64.sin_cos();
    let turn = |v: DVec3| v * cos + axis.cross(v) * sin + axis * axis.dot(v) * (1.0 - cos);
    TriangleMesh::new(mesh.vertices().iter().map(|&v| turn(v) + by).collect(), mesh.triangles().to_vec()).expect("a moved mesh")
}

fn surface(mesh: TriangleMesh) -> Surface {
    Surface::new(Arc::new(mesh), SignChoice::Auto, &Run::default()).expect("a surface")
}

#[test]
fn greatest_depth_of_boxes_anywhere() {
    for size in [DVec3::new(3.0, 7.0, 11.0), DVec3::splat(4.0), DVec3::new(100.0, 80.0, 2.0), DVec3::new(1e-3, 5e-3, 2e-3)] {
        for by in [DVec3::ZERO, DVec3::new(12.3, -45.6, 7.8), DVec3::splat(1e5)] {
            for part in [cuboid(size), moved(&cuboid(size), by * size.max_element())] {
                let tolerance = 0.003 * size.min_element();
                let solid = surface(part);
                let found = greatest_depth(&solid, tolerance, &Run::default()).expect("a depth");
                let truth = 0.5 * size.min_element();
                let rounding = 1e-14 * (by.length() + 1.0) * size.length();
                assert!(found.depth.lower - rounding <= truth && truth <= found.depth.upper + rounding, "{size} {by}: {found:?}");
                assert!(found.depth.width() <= tolerance);
                assert!(-solid.at(found.point).upper >= found.depth.lower);
            }
        }
    }
}
#[test]
fn greatest_depth_of_round_solids() {
    // The facets lie inside the round solid, by at most the sagitta of a chord.
    let run = Run::default();
    let sagitta = |radius: f64, steps: u32| radius * (1.0 - (PI / f64::from(steps)).cos());
    for by in [DVec3::ZERO, DVec3::new(300.0, -20.0, 5.0)] {
        for (part, radius, steps) in [
            (sphere(5.0, 48), 5.0f64, 48),
            (torus(10.0, 3.0, 64), 3.0, 32),
            (cylinder(4.0, 30.0, 40), 4.0, 40),
            (cylinder(4.0, 2.0, 40), 1.0, 40),
        ] {
            let solid = surface(moved(&part, by));
            let depth = greatest_depth(&solid, 0.01, &run).expect("a depth").depth;
            let least = radius - 2.2 * sagitta(radius.max(4.0), steps);
            assert!(depth.width() <= 0.01 && depth.upper >= least && depth.lower <= radius + 1e-12, "{radius}: {depth:?}");
        }
    }
    let ring = greatest_depth(&surface(torus(10.0, 3.0, 64)), 0.01, &run).expect("a depth").point;
    assert!((ring.truncate().length() - 10.0).abs() < 0.2 && ring.z.abs() < 0.2, "{ring} is not on the torus's circle");
}

/// Boxes from `low` to `high` on a plate; the plate is thinner than the limits used.
fn bosses() -> TriangleMesh {
    blocks([&[0.0, 10.0, 30.0, 50.0, 72.0, 100.0], &[0.0, 20.0, 40.0, 60.0], &[0.0, 4.0, 24.0]], |[i, j, k]| {
        k == 0 || (j == 1 && (i == 1 || i == 3))
    })
}

#[test]
fn two_bosses_are_two_sections_of_known_volume() {
    for by in [None, Some(DVec3::new(10.0, 2000.0, -30.0))] {
        let mesh = by.map_or_else(bosses, |by| moved(&bosses(), by));
        let found = heavy_sections(&surface(mesh), 10.0, 0.05, &Run::default()).expect("sections");
        assert_eq!(found.depth, 5.0);
        assert!(found.joined >= 4.95 && found.joined <= 5.0, "{}", found.joined);
        // Deeper than 5 in a box of a x b, 24 high, on the ground: (a - 10) (b - 10) (24 - 10).
        let truth = [(10.0, 12.0 * 10.0 * 14.0, [61.0, 30.0, 12.0]), (10.0, 10.0 * 10.0 * 14.0, [20.0, 30.0, 12.0])];
        assert_eq!(found.sections.len(), 2);
        let mut sections = found.sections.clone();
        sections.sort_by(|a, b| b.volume.lower.total_cmp(&a.volume.lower));
        for (section, (depth, volume, centroid)) in sections.iter().zip(truth) {
            assert!(section.certain);
            assert!(section.volume.lower <= volume && volume <= section.volume.upper, "{:?} does not hold {volume}", section.volume);
            assert!(section.volume.width() <= 0.01 * volume);
            assert!(section.depth.lower <= depth + 1e-9 && depth - 1e-9 <= section.depth.upper, "{:?}", section.depth);
            assert!(section.depth.width() <= 0.05);
            if by.is_none() {
                assert!(section.centroid.distance(DVec3::from(centroid)) < 0.05, "{}", section.centroid);
                let half = if volume > 1500.0 { DVec3::new(6.0, 5.0, 7.0) } else { DVec3::new(5.0, 5.0, 7.0) };
                let middle = DVec3::from(centroid);
                for (corner, sign) in [(section.bounds.min, -1.0), (section.bounds.max, 1.0)] {
                    let beyond = (corner - middle) * sign - half;
                    assert!(beyond.min_element() > -1e-9 && beyond.max_element() < found.resolution, "{:?}", section.bounds);
                }
            }
        }
    }
}

#[test]
fn sections_join_through_a_deep_neck_and_part_at_a_shallow_one() {
    // A dumb-bell of square bars: two 20 mm cubes and a square neck between them.
    let bell = |neck: f64| {
        let (low, high) = (10.0 - neck / 2.0, 10.0 + neck / 2.0);
        blocks([&[0.0, 20.0, 40.0, 60.0], &[0.0, low, high, 20.0], &[0.0, low, high, 20.0]], |[i, j, k]| i != 1 || (j == 1 && k == 1))
    };
    // In the middle of the neck the depth is half its width.
    for (neck, count) in [(8.0, 2), (9.8, 2), (10.2, 1), (14.0, 1)] {
        let found = heavy_sections(&surface(bell(neck)), 10.0, 0.05, &Run::default()).expect("sections");
        assert_eq!(found.sections.len(), count, "neck {neck}");
        if count == 2 {
            let volume = found.sections[0].volume;
            assert!(volume.lower >= 1000.0 - 10.0, "the cube alone holds 10^3: {volume:?}");
        }
    }
}

#[test]
fn sections_are_sorted_and_every_deep_place_is_in_one() {
    let sizes = [12.0, 20.0, 14.0, 26.0, 17.0];
    let mut xs = vec![0.0];
    for size in sizes {
        let last = xs[xs.len() - 1];
        xs.extend([last + 6.0, last + 6.0 + size]);
    }
    xs.push(xs[xs.len() - 1] + 6.0);
    let bar = blocks([&xs, &[0.0, 30.0], &[0.0, 3.0, 33.0]], |[i, _, k]| k == 0 || i % 2 == 1);
    let solid = surface(bar);
    let found = heavy_sections(&solid, 10.0, 0.05, &Run::default()).expect("sections");
    let depths: Vec<f64> = found.sections.iter().map(|s| s.depth.lower).collect();
    let expected = [13.0, 10.0, 8.5, 7.0, 6.0];
    assert_eq!(depths.len(), 5, "{depths:?}");
    for (depth, expected) in depths.iter().zip(expected) {
        assert!((depth - expected).abs() <= 0.05, "{depths:?}");
    }
    let mut state = 11u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let extent = solid.mesh().extent();
    for _ in 0..20_000 {
        let p = extent.min + DVec3::new(random(), random(), random()) * extent.size();
        if -solid.at(p).lower > 5.0 {
            assert!(found.sections.iter().any(|s| s.bounds.contains(p)), "{p} is deep and in no section");
        }
    }
}

#[test]
fn a_sheet_just_above_the_limit_is_found_and_one_just_below_is_not() {
    let plate = moved(&cuboid(DVec3::new(40.0, 30.0, 10.0)), DVec3::new(1.0, 2.0, 3.0));
    let solid = surface(plate);
    let found = heavy_sections(&solid, 9.99, 0.05, &Run::default()).expect("sections");
    assert_eq!(found.sections.len(), 1);
    let section = &found.sections[0];
    let truth = 30.01 * 20.01 * 0.01;
    assert!(section.certain && section.volume.lower <= truth && truth <= section.volume.upper, "{section:?}");
    let none = heavy_sections(&solid, 10.01, 0.05, &Run::default()).expect("sections");
    assert!(none.sections.is_empty());
    // At the limit itself rounding decides; a section of hardly any depth must not be called certain.
    let at = heavy_sections(&solid, 10.0, 0.05, &Run::default()).expect("sections");
    assert!(at.sections.iter().all(|s| s.depth.lower < 5.0 + 1e-12), "{:?}", at.sections);
}

fn options() -> Options {
    Options { tolerance: 0.05, above: Some(5.0), below: Some(2.0), spacing: None }
}

#[test]
fn a_slab_is_as_thick_as_it_is() {
    let solid = surface(moved(&cuboid(DVec3::new(50.0, 40.0, 3.0)), DVec3::new(-40.0, 900.0, 0.5)));
    let walls = wall_thickness(&solid, &options(), &Run::default()).expect("walls");
    let sphere = walls.sphere.expect("walls that oppose each other");
    for value in [sphere.minimum.thickness, sphere.maximum.thickness, sphere.mean, sphere.median].into_iter().chain(sphere.percentiles) {
        assert!((value - 3.0).abs() < 1e-9, "{sphere:?}");
    }
    assert_eq!((sphere.share_above, sphere.share_below), (Some(0.0), Some(0.0)));
    for extreme in [sphere.minimum, sphere.maximum] {
        assert!((extreme.point.distance(extreme.opposite) - 3.0).abs() < 1e-9);
        assert_ne!(extreme.triangle, extreme.opposite_triangle);
        let across = solid.mesh().facet(extreme.opposite_triangle).nearest(extreme.opposite).distance_squared;
        assert!(across.sqrt() < 1e-9, "the other end lies on its triangle");
    }
    // Rays across the plate's faces, along it from its sides.
    let ray = walls.ray.expect("hits");
    let sides = 2.0 * 3.0 * (50.0 + 40.0);
    let mean = (2.0 * 50.0 * 40.0 * 3.0 + 2.0 * 3.0 * 50.0 * 40.0 + 2.0 * 3.0 * 40.0 * 50.0) / (2.0 * 50.0 * 40.0 + sides);
    assert!((ray.mean - mean).abs() < 1e-9, "{} {mean}", ray.mean);
    assert!((ray.maximum.thickness - 50.0).abs() < 1e-9 && (ray.minimum.thickness - 3.0).abs() < 1e-9);
    let share = sides / walls.area;
    assert!((ray.share_above.expect("a limit was given") - share).abs() < 1e-9);
    assert!((walls.area - (4000.0 + sides)).abs() < 1e-9 * walls.area);
    assert_eq!((walls.missed, walls.inner.0, walls.slack), (0, 0, 0.0));
    // Near the edges the ball is held by the side, not by the other face: within 1.5 of all of them.
    let near = 4000.0 - 2.0 * (50.0 - 3.0) * (40.0 - 3.0) + sides;
    assert!((walls.edge.1 - near).abs() < 0.05 * near, "{:?} {near}", walls.edge);
}

#[test]
fn limits_are_strict() {
    let solid = surface(cuboid(DVec3::new(64.0, 64.0, 4.0)));
    let walls = |above, below| {
        let options = Options { above: Some(above), below: Some(below), ..options() };
        let sphere = wall_thickness(&solid, &options, &Run::default()).expect("walls").sphere.expect("a wall");
        (sphere.share_above.expect("above"), sphere.share_below.expect("below"))
    };
    assert_eq!(walls(4.0 - 1e-9, 4.0 + 1e-9), (1.0, 1.0));
    assert_eq!(walls(4.0 + 1e-9, 4.0 - 1e-9), (0.0, 0.0));
    assert_eq!(walls(4.0, 4.0), (0.0, 0.0));
}

#[test]
fn a_hollow_sphere_has_the_same_wall_everywhere() {
    let outer = circle((0.0, 0.0), 20.0, -PI / 2.0, PI / 2.0, 48);
    let inner = circle((0.0, 0.0), 18.0, PI / 2.0, -PI / 2.0, 48);
    let solid = surface(moved(&lathe(&[outer, inner].concat(), 96), DVec3::new(7.0, 7.0, 7.0)));
    let walls = wall_thickness(&solid, &options(), &Run::default()).expect("walls");
    // Facets of both spheres lie inside by at most the sagitta of 3.75 degrees, on the poles' side of a chord.
    let sagitta = 20.0 * (1.0 - (PI / 96.0).cos());
    let error = 2.0 * sagitta + 2.0 * walls.slack;
    for statistics in [walls.sphere.expect("walls"), walls.ray.expect("hits")] {
        assert!((statistics.minimum.thickness - 2.0).abs() <= error, "{statistics:?}");
        assert!((statistics.maximum.thickness - 2.0).abs() <= error, "{statistics:?}");
        assert!((statistics.mean - 2.0).abs() <= sagitta);
        assert!((statistics.maximum.point.distance(statistics.maximum.opposite) - 2.0).abs() < 0.2);
    }
    assert_eq!((walls.edge.0, walls.inner.0, walls.missed), (0, 0, 0));
}

#[test]
fn facets_of_a_curved_wall_do_not_count_as_edges() {
    let walls = wall_thickness(&surface(cylinder(5.0, 30.0, 40)), &options(), &Run::default()).expect("walls");
    let sphere = walls.sphere.expect("walls");
    assert!((sphere.median - 10.0).abs() < 0.1 && (sphere.percentiles[0] - 10.0).abs() < 0.7, "{sphere:?}");
    // A coarse bar of eight sides is what it is: flat faces with sharp edges.
    let bar = wall_thickness(&surface(cylinder(5.0, 30.0, 8)), &options(), &Run::default()).expect("walls");
    assert!(bar.edge.1 > 0.9 * bar.area && bar.slack == 0.0, "{:?} of {}, {}", bar.edge, bar.area, bar.slack);
    assert!((bar.ray.expect("hits").minimum.thickness - 10.0 * (PI / 8.0).cos()).abs() < 1e-9);
}

#[test]
fn every_ball_is_inscribed_and_every_sample_lies_on_its_triangle() {
    let solid = surface(moved(&bosses(), DVec3::new(0.1, 0.2, 0.3)));
    let found = thickness(&solid, &options(), &Run::default()).expect("a report");
    assert!(found.walls.samples.len() >= solid.mesh().triangles().len());
    let mut seen = vec![false; solid.mesh().triangles().len()];
    let mut area = 0.0;
    for sample in &found.walls.samples {
        seen[sample.triangle as usize] = true;
        area += sample.area;
        assert!(solid.mesh().facet(sample.triangle).distance_squared(sample.point).sqrt() < 1e-12);
        let sphere = sample.sphere.expect("a closed part has no inner faces");
        assert!(sphere.thickness <= 2.0 * found.greatest.depth.upper);
        let center = sample.point - sample.normal * (0.5 * sphere.thickness);
        let depth = -solid.at(center).upper;
        assert!((depth - 0.5 * sphere.thickness).abs() < 1e-9, "the ball at {} is not inscribed: {depth} {sphere:?}", sample.point);
        assert!((sphere.opposite.distance(center) - depth).abs() < 1e-9, "it touches where it says");
        let ray = sample.ray.expect("a closed part is hit");
        assert!(ray.thickness >= sphere.thickness * (1.0 - 1e-9));
        assert!(solid.mesh().facet(ray.triangle).distance_squared(ray.opposite).sqrt() < 1e-9);
    }
    assert!(seen.iter().all(|&s| s));
    assert!((area - found.walls.area).abs() < 1e-9 * area);
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let solid = surface(moved(&bosses(), DVec3::new(3.0, 1.0, -2.0)));
    let text = |threads| format!("{:?}", thickness(&solid, &options(), &Run::with_threads(threads)).expect("a report"));
    let one = text(1);
    assert!(one == text(2) && one == text(7));
}

#[test]
fn walls_between_shells_inside_out_meshes_and_flipped_triangles() {
    // Inside out: still a solid to the sign rule, so the walls are the same.
    let part = cuboid(DVec3::new(30.0, 20.0, 3.0));
    let turned =
        TriangleMesh::new(part.vertices().to_vec(), part.triangles().iter().map(|&[a, b, c]| [a, c, b]).collect()).expect("a mesh");
    let walls = wall_thickness(&surface(turned), &options(), &Run::default()).expect("walls");
    assert!((walls.sphere.expect("walls").mean - 3.0).abs() < 1e-9);
    assert_eq!(walls.inner.0, 0);
}

#[test]
fn an_open_box_is_as_deep_as_its_winding_number_says() {
    // Without its lid the box has no inside near the opening, but it has one near its floor.
    let part = cuboid(DVec3::new(20.0, 20.0, 20.0));
    let lid = |t: &[u32; 3]| t.iter().all(|&v| part.vertices()[v as usize].z == 20.0);
    let open = TriangleMesh::new(part.vertices().to_vec(), part.triangles().iter().copied().filter(|t| !lid(t)).collect()).expect("a mesh");
    let solid = surface(open);
    let found = greatest_depth(&solid, 0.1, &Run::default()).expect("a depth");
    let at = solid.at(found.point);
    assert!(at.upper < 0.0 && -at.upper >= found.depth.lower, "{found:?} {at:?}");
    // No inside point that a lattice finds is deeper than certified.
    for i in 0..40 * 40 * 40 {
        let p = DVec3::new(f64::from(i % 40), f64::from(i / 40 % 40), f64::from(i / 1600)) * 0.6 - 2.0;
        assert!(-solid.at(p).upper <= found.depth.upper, "{p}");
    }
}

#[test]
fn bad_arguments_are_refused_with_a_sentence() {
    let solid = surface(cuboid(DVec3::new(3.0, 4.0, 5.0)));
    let run = Run::default();
    for tolerance in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-18] {
        let error = greatest_depth(&solid, tolerance, &run).expect_err("a bad tolerance");
        assert!(error.to_string().contains("tolerance"), "{error}");
        assert!(heavy_sections(&solid, 1.0, tolerance, &run).is_err());
    }
    for limit in [0.0, -2.0, f64::NAN, f64::INFINITY] {
        let error = heavy_sections(&solid, limit, 0.1, &run).expect_err("a bad limit");
        assert!(error.to_string().contains("above"), "{error}");
        let error = thickness(&solid, &Options { below: Some(limit), ..options() }, &run).expect_err("a bad limit");
        assert!(error.to_string().contains("below"), "{error}");
    }
    for spacing in [0.0, -1.0, f64::NAN, 1e-9] {
        let error = thickness(&solid, &Options { spacing: Some(spacing), ..options() }, &run).expect_err("a bad spacing");
        assert!(error.to_string().contains("spacing"), "{error}");
    }
    let unsigned = Surface::new(Arc::clone(solid.mesh()), SignChoice::Unsigned, &run).expect("a surface");
    let error = greatest_depth(&unsigned, 0.1, &run).expect_err("no inside");
    assert!(error.to_string().contains("no inside"), "{error}");
    let open = TriangleMesh::new(solid.mesh().vertices().to_vec(), vec![solid.mesh().triangles()[0]]).expect("a triangle");
    assert!(greatest_depth(&surface(open), 0.1, &run).is_err());
    // A limit deeper than the part is no error.
    assert!(heavy_sections(&solid, 100.0, 0.1, &run).expect("no sections").sections.is_empty());
}

#[test]
fn a_cancelled_job_stops() {
    let cancel = Cancel::new();
    cancel.cancel();
    let run = Run { cancel: &cancel, ..Run::default() };
    assert_eq!(thickness(&surface(bosses()), &options(), &run).err(), Some(Error::Cancelled));
}
