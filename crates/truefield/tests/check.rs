//! What is wrong with a mesh: one fault at a time, each named and nothing else reported.

use truefield::{Check, DVec3, Run, TriangleMesh};

fn cube() -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let corners = (0..8u32).map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2 & 1))).collect();
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    (corners, quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect())
}

/// Two meshes in one.
fn both(first: (Vec<DVec3>, Vec<[u32; 3]>), second: (Vec<DVec3>, Vec<[u32; 3]>)) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let shift = first.0.len() as u32;
    let (mut vertices, mut triangles) = first;
    vertices.extend(second.0);
    triangles.extend(second.1.into_iter().map(|t| t.map(|v| v + shift)));
    (vertices, triangles)
}

fn placed(scale: f64, offset: DVec3) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let (vertices, triangles) = cube();
    (vertices.into_iter().map(|v| v * scale + offset).collect(), triangles)
}

fn inverted((vertices, triangles): (Vec<DVec3>, Vec<[u32; 3]>)) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    (vertices, triangles.into_iter().map(|[a, b, c]| [a, c, b]).collect())
}

fn check((vertices, triangles): (Vec<DVec3>, Vec<[u32; 3]>)) -> Check {
    let mesh = TriangleMesh::new(vertices, triangles).expect("a mesh");
    let check = Check::of(&mesh, &Run::with_threads(1)).expect("a check");
    for threads in [2, 7] {
        let again = Check::of(&mesh, &Run::with_threads(threads)).expect("a check");
        assert_eq!(format!("{check:?}"), format!("{again:?}"), "{threads} threads");
    }
    check
}

/// Numbers of faults, in the order of the fields.
fn faults(c: &Check) -> [usize; 12] {
    [
        c.open_edges.count,
        c.non_manifold_edges.count,
        c.inconsistent_edges.count,
        c.pinched_vertices.count,
        c.duplicate_triangles.count,
        c.opposite_triangles.count,
        c.zero_area_triangles.count,
        c.unreferenced_vertices.count,
        c.inside_out_shells.count,
        c.nested_shells.count,
        c.uncertain_shells.count,
        c.self_intersections.count,
    ]
}

#[test]
fn nothing_is_wrong() {
    for (scale, offset) in [
        (1.0, DVec3::ZERO),
        (1e-9, DVec3::ZERO),
        (1e-60, DVec3::ZERO),
        (1e9, DVec3::X * 1e9),
        (1e80, DVec3::ZERO),
        (1.0, DVec3::splat(1e6)),
    ] {
        let c = check(placed(scale, offset));
        assert_eq!(faults(&c), [0; 12], "{scale}: {c:?}");
        assert!(c.watertight && c.consistent && c.self_intersections_complete);
        assert_eq!((c.vertices, c.positions, c.triangles, c.shells), (8, 8, 12, 1));
        assert!((c.volume / scale.powi(3) - 1.0).abs() < 1e-9 && (c.area / scale.powi(2) - 6.0).abs() < 1e-9, "{c:?}");
    }
    // Every triangle with vertices of its own, and zeros of either sign.
    let (vertices, triangles) = cube();
    let soup = triangles
        .iter()
        .enumerate()
        .flat_map(|(i, t)| t.map(|v| if i % 2 == 0 { -(-vertices[v as usize]) } else { vertices[v as usize] * -1.0 * -1.0 }));
    let soup: Vec<DVec3> =
        soup.enumerate().map(|(i, v)| if i % 3 == 0 { DVec3::new(if v.x == 0.0 { -0.0 } else { v.x }, v.y, v.z) } else { v }).collect();
    let c = check((soup, (0..12).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect()));
    assert_eq!(faults(&c), [0; 12]);
    assert_eq!((c.vertices, c.positions), (36, 8));
}

/// Of a long thin rod the volume drowns in rounding, and must not tell its sides.
#[test]
fn thin_rods_are_not_told_by_their_volume() {
    let mut random = truefield::laws::Random::new(3);
    for _ in 0..6 {
        let along = random.direction();
        let u = along.any_orthonormal_vector();
        let (u, w) = (u * 1e-9, along.cross(u) * 1e-9);
        let cuts = 2000u32;
        let ring = |k: u32| [u + w, w - u, -u - w, u - w].map(|corner| along * (f64::from(k) / f64::from(cuts)) + corner);
        let vertices: Vec<DVec3> = (0..=cuts).flat_map(ring).collect();
        let last = 4 * cuts;
        let mut triangles = vec![[0, 2, 1], [0, 3, 2], [last, last + 1, last + 2], [last, last + 2, last + 3]];
        for (k, side) in (0..cuts).flat_map(|k| (0..4).map(move |side| (k, side))) {
            let [a, b] = [4 * k + side, 4 * k + (side + 1) % 4];
            triangles.extend([[a, b, b + 4], [a, b + 4, a + 4]]);
        }
        let flipped = triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
        assert_eq!(check((vertices.clone(), triangles)).inside_out_shells.count, 0);
        let c = check((vertices, flipped));
        assert!(c.inside_out_shells.count + c.uncertain_shells.count + c.self_intersections.count > 0, "{c:?}");
    }
}

#[test]
fn one_fault_at_a_time() {
    let (vertices, mut triangles) = cube();
    triangles.pop();
    let c = check((vertices, triangles));
    assert_eq!(faults(&c), [3, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(c.open_edges.first, [[4, 6], [4, 7], [6, 7]]);
    assert!(!c.watertight && !c.consistent);

    let (vertices, mut triangles) = cube();
    triangles[5].swap(0, 1);
    let c = check((vertices, triangles));
    assert_eq!(faults(&c), [0, 0, 3, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
    assert!(c.watertight && !c.consistent);

    let (mut vertices, triangles) = cube();
    vertices.push(DVec3::ONE * 9.0);
    let c = check((vertices, triangles));
    assert_eq!(faults(&c), [0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0]);
    assert_eq!(c.unreferenced_vertices.first, [8]);

    let (vertices, mut triangles) = cube();
    triangles.push([3, 3, 5]);
    let c = check((vertices, triangles));
    assert_eq!(faults(&c), [0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0]);
    assert_eq!((c.collapsed_triangles, c.zero_area_triangles.first.as_slice()), (1, [12].as_slice()));

    let c = check(inverted(cube()));
    assert_eq!(faults(&c), [0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0]);
    assert!((c.volume + 1.0).abs() < 1e-12);
}

#[test]
fn duplicates_and_walls() {
    let (vertices, mut triangles) = cube();
    triangles.push([4, 6, 0]);
    triangles.push([0, 6, 4]);
    let c = check((vertices, triangles));
    assert_eq!((c.duplicate_triangles.count, c.opposite_triangles.count, c.non_manifold_edges.count), (1, 1, 3));
    assert_eq!((c.duplicate_triangles.first[0], c.opposite_triangles.first[0]), ([0, 12], [0, 13]));
    assert_eq!(c.self_intersections.count, 0);

    // Two cubes that share a wall, cut along the same diagonal.
    let c = check(both(cube(), placed(1.0, DVec3::X)));
    assert_eq!(faults(&c), [0, 5, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0]);
    assert_eq!(c.shells, 1);
}

#[test]
fn shells_that_touch_nest_or_cross() {
    // Touching at a corner.
    let c = check(both(cube(), placed(1.0, DVec3::ONE)));
    assert_eq!(faults(&c), [0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(c.shells, 2);
    // A cavity is as it should be; the same cube facing outward is nested; a cavity outside is inside out.
    let inner = || placed(0.5, DVec3::splat(0.25));
    assert_eq!(faults(&check(both(cube(), inverted(inner())))), [0; 12]);
    assert_eq!(faults(&check(both(cube(), inner()))), [0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0]);
    assert_eq!(faults(&check(both(cube(), inverted(placed(1.0, DVec3::X * 3.0))))), [0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0]);
    // Crossing, touching from outside at a face, an edge, a corner in a face; and the nearest miss.
    for (offset, meets) in [
        (DVec3::new(0.5, 0.4, 0.3), true),
        (DVec3::new(1.0, 0.5, 0.3), true),
        (DVec3::new(1.0, 1.0, 0.3), true),
        (DVec3::new(1.0 + 1e-15, 0.5, 0.3), true),
        (DVec3::new(1.0 + 1e-9, 0.5, 0.3), false),
    ] {
        let c = check(both(cube(), placed(1.0, offset)));
        assert_eq!(c.self_intersections.count > 0, meets, "{offset}: {c:?}");
        assert_eq!(c.shells, 2);
    }
}

#[test]
fn a_fold_onto_itself() {
    // Two triangles over one edge, the second laid onto the first, then opened by a hair and by an angle.
    for (angle, meets) in [(0.0f64, true), (1e-12, true), (1e-3, false), (1.0, false), (3.0, false)] {
        let apex = DVec3::new(0.4, angle.cos(), angle.sin());
        let c = check((vec![DVec3::ZERO, DVec3::X, DVec3::new(0.3, 1.0, 0.0), apex], vec![[0, 1, 2], [1, 0, 3]]));
        assert_eq!(c.self_intersections.count, usize::from(meets), "{angle}");
    }
    // Fans around a corner: only the one that comes back over the first triangle meets it.
    let at = |degrees: f64| DVec3::new(degrees.to_radians().cos(), degrees.to_radians().sin(), 0.0);
    for (start, end, meets) in [
        (60.0, 100.0, false),
        (180.0, 240.0, false),
        (230.0, 300.0, false),
        (300.0, 359.0, false),
        (300.0, 365.0, true),
        (10.0, 40.0, true),
    ] {
        let c = check((vec![DVec3::ZERO, at(0.0), at(50.0), at(start), at(end)], vec![[0, 1, 2], [0, 3, 4]]));
        assert_eq!(c.self_intersections.count, usize::from(meets), "{start} to {end}");
    }
}
