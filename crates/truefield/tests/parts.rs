//! Complete fields taken apart and put together again: the same field from good parts, a sentence from bad ones.

mod nasty;

use std::borrow::Cow;
use std::sync::Arc;

use nasty::corpus;
use truefield::build::complete::complete;
use truefield::field::complete::Region;
use truefield::laws::{Random, places};
use truefield::{Cancel, CompleteField, DVec3, Error, Grid, Parts, Run, SignChoice, Silent, Surface, TriangleMesh};

fn two() -> Run<'static> {
    Run::with_threads(2)
}

fn surface(mesh: &TriangleMesh) -> Arc<Surface> {
    Arc::new(Surface::new(Arc::new(mesh.clone()), SignChoice::Auto, &two()).expect("a surface"))
}

fn assembled(field: &CompleteField, parts: &Parts<'_>) -> Result<CompleteField, Error> {
    CompleteField::from_parts(Arc::clone(field.surface()), *field.grid(), field.region(), parts, &two())
}

fn bits(field: &CompleteField, points: &[DVec3]) -> Vec<(u64, u64, u64, u32, [u64; 3])> {
    let nearest = field.nearest_many(points, &two()).expect("answers");
    let bounds = field.bounds(points, &two()).expect("answers");
    let told = nearest.iter().zip(bounds);
    told.map(|(n, b)| (b.lower.to_bits(), b.upper.to_bits(), n.distance.to_bits(), n.element, n.point.to_array().map(f64::to_bits)))
        .collect()
}

/// A field with all there is: uniform and varied blocks, long lists, a grid that starts in the middle of a block.
fn rich(region: Region) -> CompleteField {
    let ring = 400;
    let mut vertices = vec![DVec3::new(0.0, 0.0, 1.0), DVec3::new(0.0, 0.0, -1.0)];
    vertices.extend((0..ring).map(|i| f64::from(i) * std::f64::consts::TAU / f64::from(ring)).map(|a| DVec3::new(a.cos(), a.sin(), 0.0)));
    let triangles = (0..ring).flat_map(|i| {
        let (a, b) = (2 + i as u32, 2 + ((i + 1) % ring) as u32);
        [[0, a, b], [1, b, a]]
    });
    let mesh = TriangleMesh::new(vertices, triangles.collect()).expect("a mesh");
    let grid = Grid { origin: DVec3::splat(-1.3), spacing: 0.08, first: [-3, 2, 5], shape: [37, 30, 26] };
    complete(&surface(&mesh), &grid, region, 1 << 30, &two()).expect("a field")
}

#[test]
fn parts_make_the_same_field_again() {
    for nasty in corpus() {
        let surface = surface(&nasty.mesh);
        let grid = Grid::over(&nasty.mesh.extent().grow(0.1 * nasty.mesh.extent().diagonal()), 17).expect("a grid");
        let points = places(&nasty.mesh, 500, 3);
        for (region, budget) in [(Region::Everywhere, 1 << 30), (Region::Inside, 1 << 30), (Region::Everywhere, 40_000)] {
            let field = match complete(&surface, &grid, region, budget, &two()) {
                Err(Error::Memory { .. }) => continue,
                field => field.expect("a field"),
            };
            let parts = field.to_parts(&two()).expect("parts");
            let again = assembled(&field, &parts).unwrap_or_else(|error| panic!("{}: {error}", nasty.name));
            assert_eq!(again.to_parts(&Run::with_threads(1)).expect("parts"), parts, "{}", nasty.name);
            assert_eq!(again.statistics(), field.statistics(), "{}", nasty.name);
            assert_eq!((again.grid(), again.region()), (field.grid(), field.region()));
            assert_eq!(bits(&again, &points), bits(&field, &points), "{}", nasty.name);
        }
    }
}

#[test]
fn the_rich_field_is_rich() {
    for region in [Region::Everywhere, Region::Inside] {
        let field = rich(region);
        let parts = field.to_parts(&two()).expect("parts");
        assert!(field.statistics().long > 0 && !parts.entries.is_empty() && !parts.wide_entries.is_empty());
        assert!(parts.varied.contains(&1) && (region == Region::Everywhere || parts.varied.contains(&0)));
        assert_eq!(assembled(&field, &parts).expect("a field").to_parts(&two()), Ok(parts));
    }
}

/// Any number of any array changed, arrays cut and grown: a sentence, or a field that answers without leaving its arrays.
#[test]
fn damaged_parts_are_refused_or_harmless() {
    let field = rich(Region::Inside);
    let parts = field.to_parts(&two()).expect("parts");
    let points = places(field.surface().mesh(), 300, 9);
    let mut random = Random::new(4);
    let mut refused = 0;
    for round in 0..1_000 {
        let mut bad = parts.clone();
        for _ in 0..=round % 3 {
            match random.below(8) {
                0 => damage(&mut bad.triangle_counts, &mut random, |x, y| *x ^= y as u16),
                1 => damage(&mut bad.list_counts, &mut random, |x, y| *x ^= y as u16),
                2 => damage(&mut bad.varied, &mut random, |x, y| *x ^= y as u8),
                3 => damage(&mut bad.triangles, &mut random, |x, y| *x ^= y as u32),
                4 => damage(&mut bad.ends, &mut random, |x, y| *x ^= y as u16),
                5 => damage(&mut bad.entries, &mut random, |x, y| *x ^= y as u8),
                6 => damage(&mut bad.wide_entries, &mut random, |x, y| *x ^= y as u16),
                _ => damage(&mut bad.cells, &mut random, |x, y| *x ^= y as u16),
            }
        }
        match assembled(&field, &bad) {
            Ok(odd) => {
                odd.statistics();
                assert_eq!(bits(&odd, &points).len(), points.len());
            }
            Err(Error::Format(_)) => refused += 1,
            Err(other) => panic!("{other}"),
        }
    }
    assert!(refused > 500, "only {refused} of 1000 were refused");
}

fn damage<T: Clone>(array: &mut Cow<'_, [T]>, random: &mut Random, flip: impl Fn(&mut T, usize)) {
    let array = array.to_mut();
    let at = random.below(array.len().max(1));
    match random.below(8) {
        0 => array.truncate(at),
        1 => array.extend_from_within(at..),
        _ if array.is_empty() => {}
        _ => flip(&mut array[at], 1 << random.below(32)),
    }
}

#[test]
fn each_broken_rule_is_named() {
    type Change = fn(&mut Parts<'_>);
    let cases: [(Change, &str); 12] = [
        (|p| p.triangle_counts.to_mut().truncate(3), "triangle_counts counts 3 blocks"),
        (|p| p.list_counts.to_mut().push(0), "list_counts counts"),
        (|p| p.varied.to_mut().clear(), "varied counts 0 blocks"),
        (|p| p.varied.to_mut()[0] = 2, "must be 0 or 1"),
        (|p| p.cells.to_mut().truncate(600), "cells ends inside block"),
        (|p| p.entries.to_mut().push(0), "entries is longer"),
        (|p| p.triangles.to_mut().swap(0, 1), "do not ascend"),
        (|p| p.triangles.to_mut()[p.triangle_counts[0] as usize - 1] = 1 << 31, "the mesh does not have"),
        (|p| p.ends.to_mut()[0] = 0, "ends where it starts"),
        (|p| p.ends.to_mut()[1] = p.ends[0], "ends where it starts"),
        (|p| p.wide_entries.to_mut().fill(u16::MAX), "beyond its triangles"),
        (|p| p.cells.to_mut()[0] = 0x1ffe, "whose list does not exist"),
    ];
    let field = rich(Region::Everywhere);
    let parts = field.to_parts(&two()).expect("parts");
    for (change, sentence) in cases {
        let mut bad = parts.clone();
        change(&mut bad);
        let error = assembled(&field, &bad).expect_err(sentence);
        assert!(matches!(&error, Error::Format(said) if said.contains(sentence)), "{error} is not about: {sentence}");
    }
}

#[test]
fn impossible_grids_are_refused() {
    let field = rich(Region::Inside);
    let parts = field.to_parts(&two()).expect("parts");
    let good = *field.grid();
    for grid in [
        Grid { spacing: 0.0, ..good },
        Grid { spacing: -0.08, ..good },
        Grid { spacing: f64::NAN, ..good },
        Grid { spacing: f64::MAX, ..good },
        Grid { origin: DVec3::INFINITY, ..good },
        Grid { origin: DVec3::NAN, ..good },
        Grid { shape: [37, 0, 26], ..good },
        Grid { shape: [u32::MAX; 3], ..good },
        Grid { shape: [38, 31, 50], ..good },
        Grid { first: [i64::MAX, 0, 0], ..good },
        Grid { first: [0, i64::MIN, 0], ..good },
        Grid { first: [1, 2, 5], ..good },
    ] {
        let result = CompleteField::from_parts(Arc::clone(field.surface()), grid, Region::Inside, &parts, &two());
        assert!(matches!(result, Err(Error::Format(_))), "{grid:?}");
    }
}

#[test]
fn both_ways_can_be_cancelled() {
    let field = rich(Region::Inside);
    let parts = field.to_parts(&two()).expect("parts");
    let cancel = Cancel::new();
    cancel.cancel();
    let run = Run { threads: 2, cancel: &cancel, progress: &Silent };
    assert_eq!(field.to_parts(&run), Err(Error::Cancelled));
    let result = CompleteField::from_parts(Arc::clone(field.surface()), *field.grid(), field.region(), &parts, &run);
    assert_eq!(result.err(), Some(Error::Cancelled));
}
