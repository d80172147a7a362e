//! Surfaces sampled by wavefronts: their intervals hold the truth, and are as narrow as promised.

mod nasty;

use std::sync::Arc;

use nasty::{Kind, corpus, judge, shapes};
use truefield::build::marched::sample_marched;
use truefield::build::sampled::sample;
use truefield::build::voxelize::{Rule, voxelize};
use truefield::laws::{BruteForce, check_threads};
use truefield::{Cancel, DVec3, Error, Grid, Known, Run, SampledField, SignChoice, Surface, TriangleMesh};

const PLENTY: u64 = 1 << 32;

fn two() -> Run<'static> {
    Run::with_threads(2)
}

fn surface(mesh: &TriangleMesh) -> Surface {
    Surface::new(Arc::new(mesh.clone()), SignChoice::Auto, &two()).expect("a surface")
}

/// Points over the box of the part, in a block whose first is not (0, 0, 0).
fn lattice(mesh: &TriangleMesh, resolution: u32, margin: f64) -> Grid {
    let extent = mesh.extent();
    let grid = Grid::over(&extent.grow(margin * extent.diagonal()), resolution).expect("a grid");
    let shift = [3.0, -2.0, 5.0];
    let origin = grid.origin + (DVec3::splat(0.5) - DVec3::from_array(shift)) * grid.spacing;
    Grid { origin, first: shift.map(|i| i as i64), ..grid }
}

fn marched(surface: &Surface, lattice: &Grid, band: Option<f64>) -> SampledField {
    sample_marched(surface, lattice, band, PLENTY, &two()).expect("a field")
}

/// The intervals hold what is known to be true, and the values.
fn judged(name: &str, field: &SampledField, truth: impl Fn(DVec3) -> f64, signed: bool) {
    for number in 0..field.values().len() {
        let (interval, value, truth) = (field.interval(number), f64::from(field.values()[number]), truth(field.lattice().node(number)));
        assert!(interval.contains(value), "{name}: {value} is not in {interval:?}");
        let (low, high) = match (interval.lower < 0.0, interval.upper < 0.0) {
            _ if signed => (interval.lower, interval.upper),
            (true, true) => (-interval.upper, -interval.lower),
            (true, false) => (0.0, interval.upper.max(-interval.lower)),
            _ => (interval.lower, interval.upper),
        };
        assert!(low <= truth && truth <= high, "{name}: {truth} is not in {interval:?} at sample {number}");
    }
}

#[test]
fn intervals_hold_the_truth_and_are_narrow() {
    for nasty in corpus() {
        let (surface, brute) = (surface(&nasty.mesh), BruteForce::new(&nasty.mesh));
        for (resolution, margin) in [(5, 0.3), (14, 0.05)] {
            let lattice = lattice(&nasty.mesh, resolution, margin);
            let field = marched(&surface, &lattice, None);
            judged(nasty.name, &field, |p| brute.unsigned(p), false);
            if nasty.kind == Kind::Solid {
                let truth = |p: DVec3| match judge::winding(&nasty.mesh, p) {
                    Some(w) if w > 0 => -brute.unsigned(p),
                    _ => brute.unsigned(p),
                };
                judged(nasty.name, &field, truth, true);
            }
            let rounding = 1e-6 * lattice.extent().diagonal().max(lattice.origin.abs().max_element());
            let doubtful = |number: usize| field.interval(number).lower < 0.0 && field.interval(number).upper > 0.0;
            // Beyond single precision, intervals are wide and right.
            let single = (1e-30..1e30).contains(&lattice.spacing);
            for number in (0..field.values().len()).filter(|&number| single && !doubtful(number)) {
                let interval = field.interval(number);
                assert!(interval.width() <= 3f64.sqrt() * lattice.spacing + rounding, "{}: {interval:?}", nasty.name);
            }
        }
    }
}

#[test]
fn touched_voxels_are_exact() {
    let mesh = shapes::welded(&shapes::scan(60, 40, 3));
    let (surface, lattice) = (surface(&mesh), lattice(&mesh, 60, 0.1));
    let field = marched(&surface, &lattice, None);
    let cells = Grid { origin: lattice.origin - 0.5 * lattice.spacing, ..lattice };
    let voxels = voxelize(&surface, &cells, Rule::Conservative, PLENTY, &two()).expect("voxels");
    assert!(voxels.near.len() > 1000);
    for near in &voxels.near {
        let value = field.values()[near.voxel as usize];
        assert_eq!(value.abs(), near.distance as f32);
        let interval = field.interval(near.voxel as usize);
        assert!(interval.width() <= 2.1 * f64::from(value.abs().next_up() - value.abs()) || interval.lower * interval.upper <= 0.0);
    }
}

#[test]
fn millions_of_samples_hold_the_exact_ones() {
    let mesh = shapes::welded(&shapes::scan(60, 40, 7));
    let (surface, lattice) = (surface(&mesh), lattice(&mesh, 150, 0.1));
    assert!(lattice.len() > 2_000_000);
    let exact = sample(&surface, &lattice, None, PLENTY, &two()).expect("samples");
    let field = marched(&surface, &lattice, None);
    let (mut excess, mut width) = (0.0, 0.0);
    for number in 0..lattice.len() {
        let (truth, interval) = (f64::from(exact.values()[number]), field.interval(number));
        assert!(interval.lower <= truth && truth <= interval.upper, "{truth} is not in {interval:?}");
        excess += f64::from(field.values()[number]).abs() - truth.abs();
        width += interval.width();
    }
    // The values are far nearer than the intervals promise.
    let count = lattice.len() as f64 * lattice.spacing;
    assert!(excess / count < 0.02 && width / count < 1.4, "{} {}", excess / count, width / count);
}

#[test]
fn parts_of_a_shape_know_that_there_is_more_beyond() {
    for nasty in corpus().into_iter().step_by(2) {
        let (surface, brute) = (surface(&nasty.mesh), BruteForce::new(&nasty.mesh));
        let mut lattice = lattice(&nasty.mesh, 21, 0.05);
        lattice.first = [0, 1, 2].map(|axis| lattice.first[axis] + i64::from(lattice.shape[axis] / 3));
        lattice.shape = lattice.shape.map(|n| (n / 2).max(1));
        match sample_marched(&surface, &lattice, None, PLENTY, &two()) {
            Ok(field) => judged(nasty.name, &field, |p| brute.unsigned(p), false),
            Err(error) => assert!(error.to_string().contains("touches no voxel"), "{}: {error}", nasty.name),
        }
    }
}

#[test]
fn bands_cut_off_what_is_far() {
    for nasty in corpus().into_iter().step_by(2) {
        let (surface, brute) = (surface(&nasty.mesh), BruteForce::new(&nasty.mesh));
        let lattice = lattice(&nasty.mesh, 16, 0.2);
        let whole = marched(&surface, &lattice, None);
        for steps in [0.3, 2.0, 5.5] {
            let band = steps * lattice.spacing;
            let field = marched(&surface, &lattice, Some(band));
            judged(nasty.name, &field, |p| brute.unsigned(p), false);
            for (a, b) in field.values().iter().zip(whole.values()) {
                assert_eq!(*a, b.signum() * b.abs().min(band as f32), "{}", nasty.name);
            }
        }
    }
}

#[test]
fn what_cannot_be_marched_is_said() {
    let mesh = shapes::welded(&shapes::cube());
    let (surface, lattice) = (surface(&mesh), lattice(&mesh, 30, 0.1));
    let field = |lattice: &Grid, band: Option<f64>, memory: u64| sample_marched(&surface, lattice, band, memory, &two());
    for band in [0.0, -1.0, f64::NAN] {
        assert!(matches!(field(&lattice, Some(band), PLENTY), Err(Error::Invalid(sentence)) if sentence.contains("band")));
    }
    assert!(matches!(field(&lattice, None, 1000), Err(Error::Memory { .. })));
    assert!(matches!(field(&Grid { shape: [1 << 20; 3], ..lattice }, None, PLENTY), Err(Error::Memory { .. })));
    let away = Grid { origin: lattice.origin + 100.0, ..lattice };
    assert!(matches!(field(&away, None, PLENTY), Err(Error::Invalid(sentence)) if sentence.contains("touches no voxel")));
    let cancel = Cancel::new();
    cancel.cancel();
    assert!(matches!(sample_marched(&surface, &lattice, None, PLENTY, &Run { cancel: &cancel, ..two() }), Err(Error::Cancelled)));
    check_threads("a marched field", |run| {
        let field = sample_marched(&surface, &lattice, None, PLENTY, run)?;
        let Known::Between { lower, upper } = field.known().clone() else { panic!("no bounds") };
        Ok((field.values().to_vec(), lower, upper))
    })
    .expect("the same");
}
