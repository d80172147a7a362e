//! Fields against brute force and against the surface they were built from, on every nasty mesh.

mod nasty;

use std::sync::Arc;

use nasty::{Kind, Nasty, corpus, judge, judged, shapes};
use truefield::build::complete::complete;
use truefield::build::sampled::sample;
use truefield::field::complete::Region;
use truefield::laws::{BruteForce, Random, check_closest, check_many, check_range, check_threads, check_truth, places};
use truefield::{
    Aabb, Closest, CompleteField, DVec3, Distance, Error, Grid, Interval, Lattice, Run, SampledField, SignChoice, Surface, TriangleMesh,
};

const PLENTY: u64 = 1 << 32;

fn two() -> Run<'static> {
    Run::with_threads(2)
}

fn surface(mesh: &TriangleMesh, sign: SignChoice) -> Arc<Surface> {
    Arc::new(Surface::new(Arc::new(mesh.clone()), sign, &two()).expect("a surface"))
}

/// Hard points for a field: those of the mesh, and the corners and faces of its cells to the last bit.
fn cell_places(mesh: &TriangleMesh, grid: &Grid, count: usize, seed: u64) -> Vec<DVec3> {
    let mut random = Random::new(seed);
    let mut out = places(mesh, count, seed);
    for index in 0..count / 2 {
        let node: [f64; 3] = std::array::from_fn(|axis| (grid.first[axis] + random.below(grid.shape[axis] as usize + 1) as i64) as f64);
        let inside = DVec3::from_array(node.map(|i| i + if index % 3 == 0 { 0.0 } else { random.unit() }));
        let mut p = grid.point(inside);
        let axis = random.below(3);
        p[axis] = grid.point(DVec3::from_array(node))[axis];
        match index % 5 {
            0 => p[axis] = p[axis].next_up(),
            1 => p[axis] = p[axis].next_down(),
            _ => {}
        }
        out.push(p);
    }
    out
}

fn resolutions(nasty: &Nasty) -> [u32; 3] {
    if nasty.mesh.triangles().len() < 100 { [1, 9, 40] } else { [2, 17, 24] }
}

/// The field says what the surface says, only more certainly.
fn same(name: &str, field: &CompleteField, surface: &Surface, points: &[DVec3], what: &str) {
    let expected = surface.nearest_many(points, &two()).expect("answers");
    let bounds = surface.bounds(points, &two()).expect("answers");
    let found = field.nearest_many(points, &two()).expect("answers");
    let distances = field.distances(points, &two()).expect("answers");
    let field_bounds = field.bounds(points, &two()).expect("answers");
    for (i, &p) in points.iter().enumerate() {
        let (expected, found) = (&expected[i], &found[i]);
        assert_eq!(
            found.distance.abs().to_bits(),
            expected.distance.abs().to_bits(),
            "{name}, {what}: {found:?} at {p:?}, surface {expected:?}"
        );
        assert_eq!(
            (found.element, found.feature, found.point),
            (expected.element, expected.feature, expected.point),
            "{name}, {what} at {p:?}"
        );
        assert_eq!(distances[i].abs().to_bits(), found.distance.abs().to_bits(), "{name}, {what} at {p:?}");
        let (ours, theirs) = (field_bounds[i], bounds[i]);
        assert!(theirs.lower <= ours.lower && ours.upper <= theirs.upper, "{name}, {what}: {ours:?} at {p:?}, surface {theirs:?}");
        assert!(ours.contains(distances[i]), "{name}, {what}: {} but {ours:?} at {p:?}", distances[i]);
        assert!(ours.contains(found.distance), "{name}, {what}: {found:?} but {ours:?} at {p:?}");
    }
}

#[test]
fn complete_fields_equal_their_surface_everywhere() {
    for nasty in corpus() {
        let surface = surface(&nasty.mesh, SignChoice::Auto);
        for (round, resolution) in resolutions(&nasty).into_iter().enumerate() {
            let extent = nasty.mesh.extent();
            let margin = [0.0, 0.1, 0.5][round] * extent.diagonal();
            let grid = Grid::over(&extent.grow(margin), resolution).expect("a grid");
            let points = cell_places(&nasty.mesh, &grid, 800, u64::from(resolution));
            for region in [Region::Everywhere, Region::Inside] {
                let field = complete(&surface, &grid, region, PLENTY, &two()).unwrap_or_else(|error| panic!("{}: {error}", nasty.name));
                same(nasty.name, &field, &surface, &points, &format!("{resolution} cells, {region:?}"));
            }
        }
    }
}

#[test]
fn a_small_budget_costs_time_and_nothing_else() {
    for nasty in corpus().into_iter().filter(|nasty| nasty.mesh.triangles().len() > 100) {
        let surface = surface(&nasty.mesh, SignChoice::Auto);
        let grid = Grid::over(&nasty.mesh.extent().grow(0.2 * nasty.mesh.extent().diagonal()), 20).expect("a grid");
        let points = cell_places(&nasty.mesh, &grid, 500, 8);
        let full = complete(&surface, &grid, Region::Everywhere, PLENTY, &two()).expect("a field").statistics().bytes;
        for share in [0.9, 0.5, 0.2, 0.01] {
            let budget = (full as f64 * share) as u64;
            match complete(&surface, &grid, Region::Everywhere, budget, &two()) {
                Ok(field) => {
                    assert!(field.statistics().bytes <= budget, "{}: {} bytes of {budget}", nasty.name, field.statistics().bytes);
                    same(nasty.name, &field, &surface, &points, &format!("{share} of the memory"));
                }
                Err(Error::Memory { needed, allowed, .. }) => {
                    assert!(allowed == budget && needed > allowed && share < 0.9, "{}: {share}", nasty.name);
                }
                Err(error) => panic!("{}: {error}", nasty.name),
            }
        }
    }
}

#[test]
fn complete_fields_obey_the_laws() {
    for nasty in corpus() {
        let (brute, size) = (BruteForce::new(&nasty.mesh), nasty.mesh.extent().diagonal());
        let surface = surface(&nasty.mesh, SignChoice::Auto);
        let grid = Grid::over(&nasty.mesh.extent().grow(0.1 * size), 12).expect("a grid");
        let points = cell_places(&nasty.mesh, &grid, 300, 9);
        let field = complete(&surface, &grid, Region::Everywhere, PLENTY, &two()).expect("a field");
        let fail = |broken| panic!("{}: {broken}", nasty.name);
        check_closest(&field, &brute, &points, 1e-15 * size).unwrap_or_else(fail);
        check_many(&field, &points).unwrap_or_else(fail);
        if nasty.kind != Kind::Open {
            let truth =
                |p: DVec3| if judge::winding(&nasty.mesh, p).is_some_and(|w| w > 0) { -brute.unsigned(p) } else { brute.unsigned(p) };
            check_truth(&field, truth, &points, 1e-12 * size).unwrap_or_else(fail);
            check_range(&field, truth, &points, 1e-12 * size).unwrap_or_else(fail);
        }
    }
}

#[test]
fn complete_fields_of_large_meshes_equal_their_surface() {
    for (mesh, resolution) in [(shapes::welded(&shapes::scan(150, 90, 3)), 48), (shapes::welded(&shapes::rod(2000, 1.0, 3.0)), 40)] {
        let surface = surface(&mesh, SignChoice::Auto);
        let grid = Grid::over(&mesh.extent().grow(0.02 * mesh.extent().diagonal()), resolution).expect("a grid");
        let field = complete(&surface, &grid, Region::Everywhere, PLENTY, &two()).expect("a field");
        same("a large mesh", &field, &surface, &cell_places(&mesh, &grid, 20_000, 4), "everywhere");
    }
}

#[test]
fn complete_fields_do_not_depend_on_threads() {
    for nasty in corpus().into_iter().step_by(4) {
        let surface = surface(&nasty.mesh, SignChoice::Auto);
        let grid = Grid::over(&nasty.mesh.extent().grow(0.1 * nasty.mesh.extent().diagonal()), 40).expect("a grid");
        let points = cell_places(&nasty.mesh, &grid, 1_000, 10);
        check_threads(nasty.name, |run| {
            let field = complete(&surface, &grid, Region::Everywhere, PLENTY, run)?;
            let bits: Vec<[u64; 2]> = field.bounds(&points, run)?.iter().map(|b| [b.lower.to_bits(), b.upper.to_bits()]).collect();
            Ok((bits, field.statistics()))
        })
        .unwrap_or_else(|broken| panic!("{broken}"));
    }
}

/// The sample points in the order of the values.
fn nodes(lattice: &Lattice) -> Vec<DVec3> {
    (0..lattice.len()).map(|n| lattice.node(n)).collect()
}

fn enclosed(nasty: &Nasty, field: &SampledField, surface: &Surface, brute: &BruteForce, what: &str) {
    let (points, name) = (nodes(field.lattice()), nasty.name);
    let truth = judged(&points, |p| brute.unsigned(p));
    let bounds = surface.bounds(&points, &two()).expect("answers");
    let (lower, upper) = (field.lower(), field.upper());
    assert_eq!((points.len(), points.len()), (lower.len(), upper.len()));
    for (i, &p) in points.iter().enumerate() {
        let (low, high, value) = (f64::from(lower[i]), f64::from(upper[i]), field.values()[i]);
        let sides = if nasty.kind != Kind::Open && truth[i] > 1e-9 * nasty.mesh.extent().diagonal() {
            vec![if judge::winding(&nasty.mesh, p).is_some_and(|w| w > 0) { -1.0 } else { 1.0 }]
        } else if bounds[i].width() > 0.0 {
            vec![-1.0, 1.0]
        } else {
            vec![if bounds[i].lower < 0.0 { -1.0 } else { 1.0 }]
        };
        let holds = sides.iter().any(|side| low <= side * truth[i] && side * truth[i] <= high);
        assert!(holds, "{name}, {what}: [{low:e}, {high:e}] at {p:?}, truth {sides:?} * {:e}", truth[i]);
        assert!(low <= high && lower[i] <= value && value <= upper[i], "{name}, {what}: {value} in [{low:e}, {high:e}] at {p:?}");
        let rounded = (truth[i] as f32).min(field.band() as f32);
        assert_eq!(value.abs().to_bits(), rounded.to_bits(), "{name}, {what}: {value} at {p:?}, truth {}", truth[i]);
        if truth[i] < 0.999 * field.band() && sides.len() == 1 && low * high > 0.0 {
            let ulp = f64::from(rounded.next_up()) - f64::from(rounded);
            assert!(high - low <= 2.0 * ulp || high - low >= f64::from(f32::MAX), "{name}, {what}: [{low:e}, {high:e}] is wide at {p:?}");
        }
    }
}

#[test]
fn samples_enclose_the_truth() {
    for nasty in corpus() {
        let (surface, brute) = (surface(&nasty.mesh, SignChoice::Auto), BruteForce::new(&nasty.mesh));
        let size = nasty.mesh.extent().diagonal();
        for (resolution, band) in [(3, None), (19, None), (14, Some(0.07)), (12, Some(0.3)), (9, Some(1e-3)), (7, Some(1e3))] {
            let lattice = Grid::over(&nasty.mesh.extent().grow(0.15 * size), resolution).expect("a lattice");
            let field = sample(&surface, &lattice, band.map(|b| b * size), PLENTY, &two())
                .unwrap_or_else(|error| panic!("{}: {error}", nasty.name));
            enclosed(&nasty, &field, &surface, &brute, &format!("{resolution} samples, band {band:?}"));
        }
    }
}

#[test]
fn sampled_fields_bound_the_truth_between_samples() {
    for nasty in corpus() {
        let (brute, size) = (BruteForce::new(&nasty.mesh), nasty.mesh.extent().diagonal());
        let surface = surface(&nasty.mesh, SignChoice::Auto);
        let lattice = Grid::over(&nasty.mesh.extent().grow(0.1 * size), 11).expect("a lattice");
        let points = cell_places(&nasty.mesh, &lattice, 300, 12);
        let truth = |p: DVec3| if judge::winding(&nasty.mesh, p).is_some_and(|w| w > 0) { -brute.unsigned(p) } else { brute.unsigned(p) };
        for band in [None, Some(0.1 * size)] {
            let field = sample(&surface, &lattice, band, PLENTY, &two()).expect("a field");
            let fail = |broken| panic!("{}, band {band:?}: {broken}", nasty.name);
            check_many(&field, &points).unwrap_or_else(fail);
            if nasty.kind == Kind::Open {
                // Whatever the side, one of the two is inside.
                for &p in &points {
                    let (found, distance) = (field.at(p), brute.unsigned(p));
                    assert!(
                        found.contains(distance) || found.contains(-distance),
                        "{}, band {band:?}: {found:?} at {p:?}, {distance}",
                        nasty.name
                    );
                }
            } else {
                check_truth(&field, truth, &points, 1e-12 * size).unwrap_or_else(fail);
                check_range(&field, truth, &points, 1e-12 * size).unwrap_or_else(fail);
            }
        }
    }
}

#[test]
fn blocks_of_a_lattice_hold_the_samples_of_the_whole() {
    for nasty in corpus().into_iter().step_by(3) {
        let surface = surface(&nasty.mesh, SignChoice::Auto);
        let whole = Grid::over(&nasty.mesh.extent().grow(0.1 * nasty.mesh.extent().diagonal()), 45).expect("a lattice");
        let all = sample(&surface, &whole, None, PLENTY, &two()).expect("samples");
        let [_, ny, nz] = whole.shape.map(|n| n as usize);
        let mut random = Random::new(13);
        for _ in 0..4 {
            let first: [usize; 3] = std::array::from_fn(|axis| random.below(whole.shape[axis] as usize));
            let shape: [u32; 3] = std::array::from_fn(|axis| 1 + random.below(whole.shape[axis] as usize - first[axis]) as u32);
            let block = Grid { first: first.map(|i| i as i64), shape, ..whole };
            let part = sample(&surface, &block, None, PLENTY, &two()).expect("samples");
            for (n, value) in part.values().iter().enumerate() {
                let (y, z) = (shape[1] as usize, shape[2] as usize);
                let [i, j, k] = [first[0] + n / (y * z), first[1] + n / z % y, first[2] + n % z];
                assert_eq!(value.to_bits(), all.values()[(i * ny + j) * nz + k].to_bits(), "{} at {i}, {j}, {k}", nasty.name);
            }
        }
    }
}

#[test]
fn blocks_of_a_complete_field_answer_like_the_whole() {
    for nasty in corpus().into_iter().step_by(3) {
        let surface = surface(&nasty.mesh, SignChoice::Auto);
        let whole = Grid::over(&nasty.mesh.extent().grow(0.1 * nasty.mesh.extent().diagonal()), 30).expect("a grid");
        let all = complete(&surface, &whole, Region::Everywhere, PLENTY, &two()).expect("a field");
        let mut random = Random::new(14);
        for round in 0..3 {
            let first: [usize; 3] = std::array::from_fn(|axis| random.below(whole.shape[axis] as usize));
            let shape: [u32; 3] = std::array::from_fn(|axis| 1 + random.below(whole.shape[axis] as usize - first[axis]) as u32);
            // Blocks may also begin before the whole.
            let first = first.map(|i| i as i64 - if round == 2 { 13 } else { 0 });
            let block = Grid { first, shape, ..whole };
            let part = complete(&surface, &block, Region::Everywhere, PLENTY, &two()).expect("a field");
            assert_eq!(part.extent(), Some(block.extent()));
            let points = cell_places(&nasty.mesh, &block, 600, 15);
            same(nasty.name, &part, &surface, &points, "a block");
            if round < 2 {
                for _ in 0..200 {
                    let cell: [u32; 3] = shape.map(|n| random.below(n as usize) as u32);
                    let of_whole: [u32; 3] = std::array::from_fn(|axis| cell[axis] + first[axis] as u32);
                    assert_eq!(part.cell(cell).0, all.cell(of_whole).0, "{}: cell {of_whole:?}", nasty.name);
                }
            }
        }
    }
}

#[test]
fn samples_do_not_depend_on_threads() {
    for nasty in corpus().into_iter().step_by(4) {
        let surface = surface(&nasty.mesh, SignChoice::Auto);
        let lattice = Grid::over(&nasty.mesh.extent().grow(0.1 * nasty.mesh.extent().diagonal()), 70).expect("a lattice");
        let bits = |values: &[f32]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        check_threads(nasty.name, |run| {
            let field = sample(&surface, &lattice, None, PLENTY, run)?;
            Ok((bits(field.values()), bits(&field.lower()), bits(&field.upper())))
        })
        .unwrap_or_else(|broken| panic!("{broken}"));
    }
}

#[test]
fn what_cannot_be_built_is_said() {
    let surface = surface(&shapes::welded(&shapes::cube()), SignChoice::Auto);
    let extent = surface.extent().expect("a box");
    assert!(matches!(Grid::over(&extent, 0), Err(Error::Invalid(_))));
    let vast = Grid { origin: DVec3::ZERO, spacing: 1e-6, first: [0; 3], shape: [1_000_000; 3] };
    assert!(matches!(complete(&surface, &vast, Region::Everywhere, 1 << 30, &two()), Err(Error::Memory { .. })));
    assert!(matches!(sample(&surface, &vast, None, 1 << 30, &two()), Err(Error::Memory { .. })));
    let vaster = Grid { shape: [u32::MAX; 3], ..vast };
    assert!(matches!(complete(&surface, &vaster, Region::Everywhere, 1 << 30, &two()), Err(Error::Memory { .. })));
    assert!(matches!(sample(&surface, &vaster, None, 1 << 30, &two()), Err(Error::Memory { .. })));
    let lattice = Grid::over(&extent, 4).expect("a lattice");
    for band in [0.0, -1.0, f64::NAN] {
        assert!(matches!(sample(&surface, &lattice, Some(band), PLENTY, &two()), Err(Error::Invalid(_))), "band {band}");
    }
    let field = complete(&surface, &lattice, Region::Everywhere, PLENTY, &two()).expect("a field");
    for bad in [f64::NAN, f64::INFINITY] {
        let points = [DVec3::ZERO, DVec3::new(0.0, bad, 0.0)];
        assert!(matches!(field.distances(&points, &two()), Err(Error::Invalid(_))));
        assert!(matches!(field.nearest_many(&points, &two()), Err(Error::Invalid(_))));
        assert!(matches!(surface.bounds(&points, &two()), Err(Error::Invalid(_))));
    }
    assert_eq!(field.nearest(DVec3::splat(3.0), 1.0), None);
    assert_eq!(Aabb::around([DVec3::ZERO, DVec3::ONE]), extent);
    assert_eq!(field.at(DVec3::splat(0.5)), Interval::exact(-0.5));
}

#[test]
fn parts_put_together_again_are_the_field() {
    for nasty in corpus().into_iter().step_by(4) {
        let surface = surface(&nasty.mesh, SignChoice::Auto);
        let whole = Grid::over(&nasty.mesh.extent().grow(0.1 * nasty.mesh.extent().diagonal()), 20).expect("a grid");
        for first in [[0; 3], [3, -9, 5]] {
            let grid = Grid { first, ..whole };
            for region in [Region::Everywhere, Region::Inside] {
                let field = complete(&surface, &grid, region, PLENTY, &two()).expect("a field");
                let parts = field.to_parts(&two()).expect("parts");
                let again = CompleteField::from_parts(Arc::clone(&surface), grid, region, &parts, &two()).expect("the field again");
                assert_eq!(again.statistics(), field.statistics(), "{}", nasty.name);
                let points = cell_places(&nasty.mesh, &grid, 400, 16);
                let bits = |field: &CompleteField| {
                    let bounds = field.bounds(&points, &two()).expect("answers");
                    bounds.iter().map(|b| [b.lower.to_bits(), b.upper.to_bits()]).collect::<Vec<_>>()
                };
                assert_eq!(bits(&again), bits(&field), "{}", nasty.name);
                same(nasty.name, &again, &surface, &points, "put together again");
            }
        }
    }
}
