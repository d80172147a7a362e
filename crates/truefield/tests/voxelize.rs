//! Voxels against clipped triangles, brute force and floods, on every nasty mesh.

mod nasty;

use std::sync::Arc;

use nasty::{Kind, corpus, judge, shapes};
use truefield::build::voxelize::{Rule, Voxels, voxelize};
use truefield::laws::{BruteForce, check_threads};
use truefield::{Aabb, Cancel, DVec3, Distance, Error, Grid, Run, SignChoice, Surface, TriangleMesh};

const PLENTY: u64 = 1 << 32;

fn two() -> Run<'static> {
    Run::with_threads(2)
}

fn surface(mesh: &TriangleMesh) -> Surface {
    Surface::new(Arc::new(mesh.clone()), SignChoice::Auto, &two()).expect("a surface")
}

fn grid(mesh: &TriangleMesh, resolution: u32, margin: f64) -> Grid {
    let extent = mesh.extent();
    Grid { first: [0; 3], ..Grid::over(&extent.grow(margin * extent.diagonal()), resolution).expect("a grid") }
}

fn voxels(surface: &Surface, grid: &Grid, rule: Rule) -> Voxels {
    voxelize(surface, grid, rule, PLENTY, &two()).expect("voxels")
}

fn index(grid: &Grid, voxel: usize) -> [u32; 3] {
    let [_, ny, nz] = grid.shape;
    [voxel as u32 / nz / ny, voxel as u32 / nz % ny, voxel as u32 % nz]
}

/// What is left of a triangle in a box: nothing, if they do not meet.
fn clipped(corners: [DVec3; 3], cell: &Aabb) -> Vec<DVec3> {
    let mut polygon = corners.to_vec();
    for axis in 0..3 {
        for (limit, sign) in [(cell.min[axis], 1.0), (cell.max[axis], -1.0)] {
            let depth = |p: DVec3| (p[axis] - limit) * sign;
            let mut kept = vec![];
            for i in 0..polygon.len() {
                let (a, b) = (polygon[i], polygon[(i + 1) % polygon.len()]);
                if depth(a) >= 0.0 {
                    kept.push(a);
                }
                if (depth(a) < 0.0) != (depth(b) < 0.0) {
                    let mut p = a + (b - a) * (depth(a) / (depth(a) - depth(b)));
                    p[axis] = limit;
                    kept.push(p);
                }
            }
            polygon = kept;
        }
    }
    polygon
}

/// What rounding of positions may hide.
fn unsure(grid: &Grid) -> f64 {
    let extent = grid.extent();
    1e-9 * extent.diagonal() + 1e-14 * extent.max.abs().max(extent.min.abs()).max_element()
}

fn corners(mesh: &TriangleMesh) -> Vec<[DVec3; 3]> {
    (0..mesh.triangles().len() as u32).map(|t| mesh.corners(t)).collect()
}

#[test]
fn touched_voxels_are_those_that_triangles_reach() {
    let mut checked = [0; 2];
    for nasty in corpus() {
        let (surface, triangles, brute) = (surface(&nasty.mesh), corners(&nasty.mesh), BruteForce::new(&nasty.mesh));
        for (resolution, margin) in [(1, 0.1), (6, 0.003), (11, 0.2)] {
            let grid = grid(&nasty.mesh, resolution, margin);
            let found = voxels(&surface, &grid, Rule::Conservative);
            let unsure = unsure(&grid);
            for (voxel, &marked) in found.marks.iter().enumerate() {
                let cell = grid.cell(index(&grid, voxel));
                let near: Vec<_> = triangles.iter().filter(|t| Aabb::around(**t).overlaps(&cell.grow(unsure))).collect();
                let meets = |cell: Aabb| near.iter().any(|t| !clipped(**t, &cell).is_empty());
                if marked {
                    assert!(meets(cell.grow(unsure)), "{}: {voxel} of {grid:?} is not touched", nasty.name);
                } else {
                    assert!(!meets(cell.grow(-unsure)), "{}: {voxel} of {grid:?} is touched", nasty.name);
                }
                checked[usize::from(marked)] += 1;
            }
            near_is_nearest(&found, &brute, unsure, nasty.name);
        }
    }
    assert!(checked[0] > 10_000 && checked[1] > 10_000, "{checked:?}");
}

/// Each marked voxel has its nearest triangle and the distance to it.
fn near_is_nearest(found: &Voxels, brute: &BruteForce, slack: f64, name: &str) {
    let marked: Vec<u64> = (0..).zip(&found.marks).filter(|(_, marked)| **marked).map(|(voxel, _)| voxel).collect();
    assert_eq!(found.near.iter().map(|near| near.voxel).collect::<Vec<_>>(), marked, "{name}");
    for near in &found.near {
        let truth = brute.unsigned(found.grid.cell(index(&found.grid, near.voxel as usize)).center());
        assert!((near.distance - truth).abs() <= slack, "{name}: {near:?}, in truth {truth}");
        assert!(near.distance <= found.grid.spacing * 3.0f64.sqrt() / 2.0 + slack, "{name}: {near:?}");
    }
}

/// The least distance of two segments, by the ends and by the lines' nearest points.
fn between_segments(a: [DVec3; 2], b: [DVec3; 2]) -> f64 {
    let to = |p: DVec3, [q, r]: [DVec3; 2]| {
        let along = ((p - q).dot(r - q) / (r - q).length_squared()).clamp(0.0, 1.0);
        (q + (r - q) * if along.is_nan() { 0.0 } else { along } - p).length()
    };
    let ends = to(a[0], b).min(to(a[1], b)).min(to(b[0], a)).min(to(b[1], a));
    let (u, v, w) = (a[1] - a[0], b[1] - b[0], a[0] - b[0]);
    let normal = u.cross(v);
    let (s, t) = (v.cross(w).dot(normal) / normal.length_squared(), u.cross(w).dot(normal) / normal.length_squared());
    let inside = (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t);
    if inside { ends.min((a[0] + u * s - b[0] - v * t).length()) } else { ends }
}

/// The least distance of a segment and a triangle: 0 where it passes through.
fn segment_to_triangle(segment: [DVec3; 2], t: [DVec3; 3]) -> f64 {
    let normal = (t[1] - t[0]).cross(t[2] - t[0]);
    let depth = segment.map(|p| (p - t[0]).dot(normal));
    if depth[0] * depth[1] < 0.0 {
        let p = segment[0] + (segment[1] - segment[0]) * (depth[0] / (depth[0] - depth[1]));
        if (0..3).all(|i| (t[(i + 1) % 3] - t[i]).cross(p - t[i]).dot(normal) >= 0.0) {
            return 0.0;
        }
    }
    let edges = (0..3).map(|i| between_segments(segment, [t[i], t[(i + 1) % 3]]));
    edges.chain(segment.map(|p| judge::distance(t, p))).fold(f64::INFINITY, f64::min)
}

/// The segments from the centre of a cell to those of its neighbours that share at least `common` coordinates with it.
fn segments(cell: &Aabb, common: usize) -> Vec<[DVec3; 2]> {
    let mut out = vec![];
    for step in (0..27i32).map(|n| [n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1]) {
        if step != [0; 3] && step.iter().filter(|s| **s == 0).count() >= common {
            let half = DVec3::from_array(step.map(f64::from)) * cell.size() * 0.5;
            out.push([cell.center(), cell.center() + half]);
        }
    }
    out
}

#[test]
fn thin_voxels_are_those_whose_segments_meet_the_surface() {
    let mut counts = [0; 3];
    // The judge multiplies lengths that the voxels never do.
    let common = |mesh: &TriangleMesh| mesh.triangles().len() < 400 && (1e-40..1e40).contains(&mesh.extent().diagonal());
    for nasty in corpus().into_iter().filter(|nasty| common(&nasty.mesh)) {
        let (surface, triangles, brute) = (surface(&nasty.mesh), corners(&nasty.mesh), BruteForce::new(&nasty.mesh));
        let grid = grid(&nasty.mesh, 9, 0.07);
        let unsure = unsure(&grid);
        let all = voxels(&surface, &grid, Rule::Conservative);
        let [six, many] = [Rule::Separating6, Rule::Separating26].map(|rule| voxels(&surface, &grid, rule));
        for voxel in 0..grid.len() {
            assert!(six.marks[voxel] <= many.marks[voxel] && many.marks[voxel] <= all.marks[voxel], "{}: {voxel}", nasty.name);
            let cell = grid.cell(index(&grid, voxel));
            let near: Vec<_> = triangles.iter().filter(|t| Aabb::around(**t).overlaps(&cell.grow(unsure))).collect();
            for (found, common) in [(&six, 2), (&many, 0)] {
                let gap = |segment: [DVec3; 2]| near.iter().map(|t| segment_to_triangle(segment, **t)).fold(f64::INFINITY, f64::min);
                let least = if all.marks[voxel] { segments(&cell, common).into_iter().map(gap).fold(f64::INFINITY, f64::min) } else { 1.0 };
                if found.marks[voxel] {
                    assert!(least <= unsure, "{}: {voxel} is {least} from the surface", nasty.name);
                } else {
                    assert!(least > 0.0, "{}: {voxel} is met", nasty.name);
                }
            }
            for (count, found) in counts.iter_mut().zip([&six, &many, &all]) {
                *count += usize::from(found.marks[voxel]);
            }
        }
        for found in [&six, &many] {
            near_is_nearest(found, &brute, unsure, nasty.name);
        }
    }
    assert!(counts[0] * 10 < counts[1] * 9 && counts[1] < counts[2], "{counts:?}");
}

/// The voxels that paths over at least `common` common coordinates reach from `from` without a marked one.
fn flood(found: &Voxels, from: usize, common: usize) -> Vec<bool> {
    let shape = found.grid.shape.map(|n| n as i32);
    let mut seen = vec![false; found.marks.len()];
    let mut stack = vec![from];
    seen[from] = true;
    while let Some(voxel) = stack.pop() {
        let at = index(&found.grid, voxel).map(|i| i as i32);
        for step in (0..27).map(|n| [n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1]) {
            let next = [0, 1, 2].map(|axis| at[axis] + step[axis]);
            if step.iter().filter(|s| **s == 0).count() < common || (0..3).any(|axis| next[axis] < 0 || next[axis] >= shape[axis]) {
                continue;
            }
            let to = ((next[0] * shape[1] + next[1]) * shape[2] + next[2]) as usize;
            if !seen[to] && !found.marks[to] {
                seen[to] = true;
                stack.push(to);
            }
        }
    }
    seen
}

#[test]
fn no_path_of_empty_voxels_leads_inside() {
    let mut inside = 0;
    for nasty in corpus().into_iter().filter(|nasty| nasty.kind == Kind::Solid) {
        let surface = surface(&nasty.mesh);
        for resolution in [8, 21] {
            let grid = grid(&nasty.mesh, resolution, 0.3);
            let solid = voxels(&surface, &grid, Rule::Solid);
            for (rule, common) in [(Rule::Conservative, 0), (Rule::Separating26, 0), (Rule::Separating6, 2)] {
                let found = voxels(&surface, &grid, rule);
                assert!(!found.marks[0]);
                let reached = flood(&found, 0, common);
                for voxel in 0..grid.len() {
                    assert!(!(reached[voxel] && solid.marks[voxel]), "{}: {rule:?} lets a path to {voxel}", nasty.name);
                }
                inside += (0..grid.len()).filter(|&v| solid.marks[v] && !found.marks[v]).count();
            }
        }
    }
    assert!(inside > 1000, "{inside}");
    // The test sees a hole when there is one.
    let grid = grid(&shapes::welded(&shapes::cube()), 8, 0.15);
    let cube = surface(&shapes::welded(&shapes::cube()));
    let mut holed = voxels(&cube, &grid, Rule::Separating6);
    let solid = voxels(&cube, &grid, Rule::Solid);
    let middle = solid.marks.iter().position(|m| *m).expect("an inside");
    let gone = (middle..grid.len()).find(|&v| holed.marks[v]).expect("a wall");
    holed.marks[gone] = false;
    assert!(flood(&holed, 0, 2).iter().zip(&solid.marks).any(|(reached, solid)| *reached && *solid));
}

#[test]
fn solid_voxels_have_their_centre_inside() {
    for nasty in corpus() {
        let surface = surface(&nasty.mesh);
        let grid = grid(&nasty.mesh, 13, 0.1);
        let found = voxels(&surface, &grid, Rule::Solid);
        assert!(found.near.is_empty());
        for (voxel, &marked) in found.marks.iter().enumerate() {
            let at = surface.at(grid.cell(index(&grid, voxel)).center());
            if at.lower == at.upper && at.upper.abs() > 1e-12 * grid.extent().diagonal() {
                assert_eq!(marked, at.upper < 0.0, "{}: {voxel} at {at:?}", nasty.name);
            }
        }
        if nasty.kind == Kind::Solid {
            let center = |voxel: usize| grid.cell(index(&grid, voxel)).center();
            let on_surface = (0..grid.len()).filter(|&v| surface.at(center(v)).upper.abs() <= unsure(&grid)).count();
            assert!(found.doubtful <= on_surface as u64, "{}: {}", nasty.name, found.doubtful);
        }
    }
}

#[test]
fn blocks_of_voxels_are_those_of_the_whole() {
    for nasty in corpus().into_iter().step_by(3) {
        let surface = surface(&nasty.mesh);
        let whole_grid = grid(&nasty.mesh, 41, 0.05);
        let [_, ny, nz] = whole_grid.shape;
        for rule in [Rule::Conservative, Rule::Separating6, Rule::Separating26, Rule::Solid] {
            let whole = voxels(&surface, &whole_grid, rule);
            let first = [1, ny / 3, nz / 2];
            let shape = [0, 1, 2].map(|axis| (whole_grid.shape[axis] - first[axis]).clamp(1, 19));
            let part_grid = Grid { first: first.map(i64::from), shape, ..whole_grid };
            let part = voxels(&surface, &part_grid, rule);
            for (voxel, &marked) in part.marks.iter().enumerate() {
                let at = index(&part_grid, voxel);
                let [i, j, k] = [0, 1, 2].map(|axis| at[axis] + first[axis]);
                assert_eq!(marked, whole.marks[((i * ny + j) * nz + k) as usize], "{}: {rule:?} at {at:?}", nasty.name);
            }
        }
    }
}

#[test]
fn voxels_do_not_depend_on_threads_and_can_be_stopped() {
    let mesh = shapes::welded(&shapes::scan(60, 40, 3));
    let (surface, grid) = (surface(&mesh), grid(&mesh, 70, 0.02));
    for rule in [Rule::Conservative, Rule::Separating26, Rule::Solid] {
        check_threads("voxels", |run| voxelize(&surface, &grid, rule, PLENTY, run)).expect("the same");
        let cancel = Cancel::new();
        cancel.cancel();
        assert_eq!(voxelize(&surface, &grid, rule, PLENTY, &Run { cancel: &cancel, ..two() }), Err(Error::Cancelled));
        let huge = Grid { shape: [1 << 20; 3], ..grid };
        assert!(matches!(voxelize(&surface, &huge, rule, PLENTY, &two()), Err(Error::Memory { .. })));
    }
}
