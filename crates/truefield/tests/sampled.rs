//! Sampled fields and what is made of them, against balls whose distances are known.

use truefield::laws::{Random, check_lipschitz, check_many, check_range, check_threads, check_truth};
use truefield::op::boolean::{complement, difference, intersection, union};
use truefield::op::offset::offset;
use truefield::op::resample::resample;
use truefield::{Aabb, Continuity, DVec3, Distance, Error, Grid, Known, Lattice, Result, Run, SampledField};

const PLENTY: u64 = 1 << 30;

type Job<'a> = dyn Fn(&Run<'_>) -> Result<SampledField> + 'a;

#[derive(Clone, Copy)]
struct Ball {
    center: DVec3,
    radius: f64,
}

impl Ball {
    fn at(self, p: DVec3) -> f64 {
        (p - self.center).length() - self.radius
    }

    fn grown(self, by: f64) -> Self {
        Self { radius: self.radius + by, ..self }
    }
}

/// Two balls that cross, the second smaller.
const A: Ball = Ball { center: DVec3::new(-0.4, 0.1, 0.0), radius: 0.9 };
const B: Ball = Ball { center: DVec3::new(0.55, -0.1, 0.2), radius: 0.7 };

/// Signed distance of the union (`side` 1) or intersection (`side` -1) of two balls whose spheres cross.
fn both(a: Ball, b: Ball, side: f64, p: DVec3) -> f64 {
    let axis = b.center - a.center;
    let apart = axis.length();
    let along = (apart * apart + a.radius * a.radius - b.radius * b.radius) / (2.0 * apart);
    assert!(along.abs() < a.radius, "the spheres do not cross");
    let ring = (a.radius * a.radius - along * along).sqrt();
    let axis = axis / apart;
    let local = p - (a.center + axis * along);
    let height = local.dot(axis);
    let mut nearest = ((local - axis * height).length() - ring).hypot(height);
    for (own, other) in [(a, b), (b, a)] {
        let foot = own.center + (p - own.center).normalize() * own.radius;
        if side * other.at(foot) > 0.0 {
            nearest = nearest.min(own.at(p).abs());
        }
    }
    let inside = if side > 0.0 { a.at(p).min(b.at(p)) } else { a.at(p).max(b.at(p)) };
    nearest.copysign(inside)
}

/// Longer along z than along x, and a block that does not begin at the origin.
fn lattice() -> Lattice {
    Lattice { origin: DVec3::new(-2.9, -1.7, -2.6), spacing: DVec3::new(0.11, 0.13, 0.17), first: [7, -1, 3], shape: [37, 29, 25] }
}

fn sampled(lattice: Lattice, truth: impl Fn(DVec3) -> f64) -> SampledField {
    let values = (0..lattice.len()).map(|n| truth(lattice.node(n)) as f32).collect();
    let known = Known::Rounded { band: f64::INFINITY, doubtful: Vec::new() };
    SampledField::new(lattice, values, known, Continuity::Everywhere).expect("a field")
}

/// The same, but with the truth lost by up to `error`, and bounds that say so.
fn blurred(lattice: Lattice, truth: impl Fn(DVec3) -> f64, error: f64) -> SampledField {
    let mut random = Random::new(5);
    let values = (0..lattice.len()).map(|n| (truth(lattice.node(n)) + random.between(-error, error) * 0.999) as f32).collect();
    SampledField::new(lattice, values, Known::Within(error), Continuity::Everywhere).expect("a field")
}

/// In the lattice, at its samples, and far around it.
fn places(lattice: &Lattice, count: usize) -> Vec<DVec3> {
    let mut random = Random::new(11);
    let extent = lattice.extent();
    (0..count)
        .map(|n| match n % 4 {
            0 => lattice.node(random.below(lattice.len())),
            1 => random.within(&extent.grow(3.0)),
            _ => random.within(&extent),
        })
        .collect()
}

fn holds(field: &SampledField, truth: impl Fn(DVec3) -> f64, what: &str) {
    let fail = |broken| panic!("{what}: {broken}");
    let points = places(field.lattice(), 200_000);
    check_truth(field, &truth, &points, 1e-12).unwrap_or_else(fail);
    check_many(field, &points[..1000]).unwrap_or_else(fail);
    check_lipschitz(field, &points[..5000], 1e-12).unwrap_or_else(fail);
    check_range(field, &truth, &points[..2000], 1e-12).unwrap_or_else(fail);
    for n in 0..field.values().len() {
        let (value, known) = (f64::from(field.values()[n]), field.interval(n));
        assert!(known.contains(value), "{what}: {value} of sample {n} is not in {known:?}");
        assert!(known.contains(truth(field.lattice().node(n))), "{what}: {known:?} of sample {n}");
    }
}

#[test]
fn bounds_hold_everywhere_whatever_is_known() {
    let truth = |p| both(A, B, 1.0, p);
    holds(&sampled(lattice(), truth), truth, "rounded");
    holds(&blurred(lattice(), truth, 0.05), truth, "within");
    let lost = blurred(lattice(), truth, 0.05);
    let known = Known::Between { lower: lost.lower(), upper: lost.upper() };
    holds(&SampledField::new(lattice(), lost.values().to_vec(), known, Continuity::Everywhere).expect("a field"), truth, "between");
    let infinite = SampledField::new(lattice(), lost.values().to_vec(), Known::Within(f64::INFINITY), Continuity::Everywhere);
    holds(&infinite.expect("a field"), truth, "nothing known");
    let band = 0.2;
    let values = sampled(lattice(), truth).values().iter().map(|v| v.clamp(-(band as f32), band as f32)).collect();
    let banded = SampledField::new(lattice(), values, Known::Rounded { band, doubtful: Vec::new() }, Continuity::Everywhere);
    holds(&banded.expect("a field"), truth, "band");
}

#[test]
fn interpolation_is_trilinear_and_reproduces_what_is() {
    // Trilinear interpolation reproduces every product of linear functions, per axis.
    let truth = |p: DVec3| (0.3 * p.x - 1.0) * (1.1 + p.y) * (0.2 - 0.7 * p.z);
    let lattice = lattice();
    let field = sampled(lattice, truth);
    let mut random = Random::new(2);
    for _ in 0..20_000 {
        let p = random.within(&lattice.extent());
        let value = field.interpolate(p).expect("inside");
        assert!((value - truth(p)).abs() < 1e-5, "{value} at {p}, not {}", truth(p));
        let gradient = field.gradient(p).expect("inside");
        let step = 1e-6;
        let slope = DVec3::from_array(DVec3::AXES.map(|axis| (truth(p + axis * step) - truth(p - axis * step)) / (2.0 * step)));
        assert!((gradient - slope.normalize()).length() < 1e-3, "{gradient} at {p}, not {slope}");
    }
    for n in 0..lattice.len() {
        let value = field.interpolate(lattice.node(n)).expect("inside");
        assert!((value - f64::from(field.values()[n])).abs() < 1e-6, "{value} at sample {n}");
    }
    let beyond = lattice.extent().max + DVec3::new(1e-9, 0.0, 0.0);
    assert_eq!((field.interpolate(beyond), field.gradient(beyond)), (None, None));
    assert!(field.distances(&[beyond], &Run::default()).expect("an answer")[0].is_nan());
    assert!(matches!(field.bounds(&[DVec3::NAN], &Run::default()), Err(Error::Invalid(_))));
}

#[test]
fn layers_one_sample_thick_are_fields() {
    for shape in [[1, 1, 1], [1, 9, 1], [9, 1, 7], [1, 2, 1]] {
        let lattice = Lattice { shape, ..lattice() };
        let field = sampled(lattice, |p| A.at(p));
        holds(&field, |p| A.at(p), &format!("{shape:?}"));
        let middle = lattice.extent().center();
        assert!(field.interpolate(middle).is_some_and(|v| (v - A.at(middle)).abs() < 0.2));
        assert!(field.gradient(middle).is_some_and(|g| g.is_finite() && (g.length() - 1.0).abs() < 1e-9 || shape == [1, 1, 1]));
    }
}

#[test]
fn infinite_samples_do_not_spoil_their_neighbours() {
    let lattice = Lattice { origin: DVec3::ZERO, spacing: DVec3::ONE, first: [0; 3], shape: [3, 1, 1] };
    let known = Known::Rounded { band: f64::INFINITY, doubtful: Vec::new() };
    let field = SampledField::new(lattice, vec![1.0, 2.0, f32::INFINITY], known, Continuity::Everywhere).expect("a field");
    assert_eq!(field.interpolate(DVec3::ZERO), Some(1.0));
    assert_eq!(field.interpolate(DVec3::X), Some(2.0));
    assert_eq!(field.interpolate(DVec3::X * 1.5), Some(f64::INFINITY));
    assert_eq!(field.gradient(DVec3::X * 0.5), Some(DVec3::X));
    for error in [0.0, 0.5, f64::INFINITY] {
        let field = SampledField::new(lattice, vec![f32::NEG_INFINITY, 1.0, f32::INFINITY], Known::Within(error), Continuity::Everywhere);
        let field = field.expect("a field");
        assert!((0..3).all(|n| field.interval(n).contains(f64::from(field.values()[n]))), "error {error}");
        match offset(&field, 0.25, PLENTY, &Run::default()) {
            Ok(grown) => assert_eq!((error, grown.values()), (f64::INFINITY, [f32::NEG_INFINITY, 0.75, f32::INFINITY].as_slice())),
            // No distance is infinite beside a finite one.
            Err(Error::Invalid(sentence)) => assert!(error < 1.0 && sentence.contains("no distances"), "{sentence}"),
            Err(other) => panic!("{other}"),
        }
    }
}

#[test]
fn solids_are_combined_with_bounds_that_hold() {
    let run = Run::with_threads(2);
    for error in [0.0, 0.03] {
        let make = |ball: Ball| if error == 0.0 { sampled(lattice(), |p| ball.at(p)) } else { blurred(lattice(), |p| ball.at(p), error) };
        let (a, b) = (make(A), make(B));
        let whole = union(&a, &b, PLENTY, &run).expect("a union");
        holds(&whole, |p| both(A, B, 1.0, p), "union");
        let common = intersection(&a, &b, PLENTY, &run).expect("an intersection");
        holds(&common, |p| both(A, B, -1.0, p), "intersection");
        let outside = complement(&whole).expect("a complement");
        holds(&outside, |p| -both(A, B, 1.0, p), "complement");
        // De Morgan, and a difference by its definition.
        let (not_a, not_b) = (complement(&a).expect("a field"), complement(&b).expect("a field"));
        let again = intersection(&not_a, &not_b, PLENTY, &run).expect("an intersection");
        assert_eq!(again.values(), outside.values());
        assert_eq!((again.lower(), again.upper()), (outside.lower(), outside.upper()));
        let rest = difference(&a, &b, PLENTY, &run).expect("a difference");
        let same = intersection(&a, &not_b, PLENTY, &run).expect("an intersection");
        assert_eq!((rest.values(), rest.lower(), rest.upper()), (same.values(), same.lower(), same.upper()));
    }
}

#[test]
fn combined_bounds_are_tight_where_the_distance_is_known() {
    let run = Run::with_threads(2);
    let (a, b) = (sampled(lattice(), |p| A.at(p)), sampled(lattice(), |p| B.at(p)));
    let whole = union(&a, &b, PLENTY, &run).expect("a union");
    let (mut outside, mut certain) = (0, 0);
    for n in 0..whole.values().len() {
        let (p, known) = (lattice().node(n), whole.interval(n));
        let truth = both(A, B, 1.0, p);
        if truth > 1e-6 {
            outside += 1;
            assert!(known.width() < 1e-6, "{known:?} outside, at {p}");
        }
        if truth < 0.0 {
            certain += usize::from(known.width() < 1e-6);
            // What is handed round is at most a diagonal and a tenth worse than the truth.
            assert!(known.lower > truth * 1.1 - 0.25, "{known:?} at {p}, truth {truth}");
        }
    }
    assert!(outside > 1000 && certain > 500, "{outside} outside, {certain} certain inside");
}

#[test]
fn solids_grow_and_shrink_with_bounds_that_hold() {
    let run = Run::with_threads(2);
    for by in [0.0, 0.07, 0.3] {
        for error in [0.0, 0.02] {
            let make = |side: f64| {
                if error == 0.0 { sampled(lattice(), |p| both(A, B, side, p)) } else { blurred(lattice(), |p| both(A, B, side, p), error) }
            };
            // Two balls grow into two larger ones; what two balls share shrinks into what two smaller ones share.
            let grown = offset(&make(1.0), by, PLENTY, &run).expect("a field");
            holds(&grown, |p| both(A.grown(by), B.grown(by), 1.0, p), &format!("grown by {by}, error {error}"));
            let shrunk = offset(&make(-1.0), -by, PLENTY, &run).expect("a field");
            holds(&shrunk, |p| both(A.grown(-by), B.grown(-by), -1.0, p), &format!("shrunk by {by}, error {error}"));
            for n in (0..grown.values().len()).step_by(7) {
                let truth = both(A.grown(by), B.grown(by), 1.0, lattice().node(n));
                let known = grown.interval(n);
                if truth > 1e-6 + 2.0 * error {
                    assert!(known.width() <= 2.0 * error + 1e-6, "{known:?} outside");
                } else {
                    assert!(known.lower > truth * 1.1 - 0.2 - 3.0 * error, "{known:?} inside, truth {truth}");
                }
            }
        }
    }
}

#[test]
fn an_intersection_may_be_empty_and_a_union_everything() {
    let run = Run::with_threads(2);
    let far = Ball { center: DVec3::new(0.0, 0.0, 3.0), radius: 0.5 };
    let (a, b) = (sampled(lattice(), |p| A.at(p)), sampled(lattice(), |p| far.at(p)));
    let nothing = intersection(&a, &b, PLENTY, &run).expect("a field");
    for n in 0..nothing.values().len() {
        let known = nothing.interval(n);
        assert!(known.lower > 0.0 && known.upper == f64::INFINITY, "{known:?}");
    }
    let all = complement(&nothing).expect("a field");
    assert!(all.upper().iter().all(|&u| u < 0.0) && all.lower().iter().all(|&l| l == f32::NEG_INFINITY));
}

#[test]
fn other_lattices_take_samples_whose_bounds_hold() {
    let truth = |p| both(A, B, 1.0, p);
    let run = Run::with_threads(2);
    let field = sampled(lattice(), truth);
    // Finer inside, coarser and far beyond, and a single layer.
    for target in [
        Lattice { origin: DVec3::new(-1.1, -0.9, -0.8), spacing: DVec3::new(0.05, 0.07, 0.06), first: [0; 3], shape: [40, 25, 28] },
        Lattice { origin: DVec3::new(-5.0, -4.0, -3.0), spacing: DVec3::new(0.9, 0.5, 0.4), first: [0; 3], shape: [11, 16, 15] },
        Lattice { origin: DVec3::ZERO, spacing: DVec3::ONE, first: [0; 3], shape: [1, 1, 1] },
    ] {
        let taken = resample(&field, target, PLENTY, &run).expect("a field");
        holds(&taken, truth, "resampled");
        let extent = lattice().extent();
        for n in 0..target.len() {
            let p = target.node(n);
            let near = p.clamp(extent.min, extent.max);
            // The interpolation may leave the bounds; what is stored as a sample does not.
            let bounds = field.at(p);
            let value = (field.interpolate(near).expect("inside") + (p - near).length()).max(bounds.lower).min(bounds.upper);
            assert!((f64::from(taken.values()[n]) - value).abs() < 1e-5, "{} at {p}, not {value}", taken.values()[n]);
        }
    }
    let same = resample(&field, lattice(), PLENTY, &run).expect("a field");
    for n in 0..field.values().len() {
        assert!((same.values()[n] - field.values()[n]).abs() < 1e-6 && same.interval(n).width() < 1e-5);
    }
    let vast = Lattice { shape: [u32::MAX, u32::MAX, 1], ..lattice() };
    assert!(matches!(resample(&field, vast, PLENTY, &run), Err(Error::Memory { .. })));
}

#[test]
fn results_do_not_depend_on_threads() {
    let (a, b) = (blurred(lattice(), |p| A.at(p), 0.1), sampled(lattice(), |p| B.at(p)));
    let target = Lattice { origin: DVec3::splat(-1.0), spacing: DVec3::splat(0.1), first: [0; 3], shape: [21, 20, 19] };
    let bits = |field: SampledField| {
        let all = [field.values().to_vec(), field.lower(), field.upper()];
        all.map(|array| array.into_iter().map(f32::to_bits).collect::<Vec<u32>>())
    };
    let jobs: [&Job<'_>; 4] =
        [&|run| union(&a, &b, PLENTY, run), &|run| difference(&a, &b, PLENTY, run), &|run| offset(&a, 0.2, PLENTY, run), &|run| {
            resample(&a, target, PLENTY, run)
        }];
    for job in jobs {
        check_threads("an operation", |run| Ok(bits(job(run)?))).unwrap_or_else(|broken| panic!("{broken}"));
    }
    let points = places(&lattice(), 20_000);
    check_threads("queries", |run| {
        let numbers = |v: Vec<f64>| v.into_iter().map(f64::to_bits).collect::<Vec<u64>>();
        Ok((
            numbers(a.distances(&points, run)?),
            a.gradients(&points, run)?.iter().map(|g| g.to_array().map(f64::to_bits)).collect::<Vec<_>>(),
        ))
    })
    .unwrap_or_else(|broken| panic!("{broken}"));
}

#[test]
fn bad_samples_are_refused() {
    let good = lattice();
    let field = |lattice: Lattice, values: Vec<f32>, known: Known| SampledField::new(lattice, values, known, Continuity::Everywhere);
    let ones = || vec![1.0f32; good.len()];
    let exact = || Known::Rounded { band: f64::INFINITY, doubtful: Vec::new() };
    assert!(field(good, ones(), exact()).is_ok());
    for bad in [
        Lattice { spacing: DVec3::new(0.1, 0.0, 0.1), ..good },
        Lattice { spacing: DVec3::new(0.1, -0.2, 0.1), ..good },
        Lattice { spacing: DVec3::new(0.1, f64::NAN, 0.1), ..good },
        Lattice { spacing: DVec3::splat(f64::MAX), ..good },
        Lattice { origin: DVec3::INFINITY, ..good },
        Lattice { shape: [37, 0, 25], ..good },
        Lattice { shape: [37, 29, 24], ..good },
    ] {
        assert!(matches!(field(bad, ones(), exact()), Err(Error::Invalid(_))), "{bad:?}");
    }
    let spoiled = |value: f32| ones().into_iter().enumerate().map(|(n, v)| if n == 77 { value } else { v }).collect::<Vec<f32>>();
    assert!(field(good, spoiled(f32::NAN), exact()).is_err());
    let between = |lower: f32, upper: f32| Known::Between { lower: spoiled(lower), upper: spoiled(upper) };
    assert!(field(good, ones(), between(1.0, 1.0)).is_ok());
    assert!(field(good, ones(), between(1.1, 1.2)).is_err());
    assert!(field(good, ones(), between(0.1, 0.2)).is_err());
    assert!(field(good, ones(), between(f32::NAN, 2.0)).is_err());
    assert!(field(good, ones(), Known::Between { lower: vec![0.0], upper: vec![2.0] }).is_err());
    for error in [-1.0, f64::NAN] {
        assert!(field(good, ones(), Known::Within(error)).is_err());
    }
    for (band, doubtful) in [(0.0, vec![]), (f64::NAN, vec![]), (1.0, vec![3, 2]), (1.0, vec![good.len() as u64])] {
        assert!(field(good, ones(), Known::Rounded { band, doubtful }).is_err());
    }
}

#[test]
fn what_has_no_inside_is_not_combined() {
    let run = Run::default();
    let values = vec![1.0; lattice().len()];
    let known = Known::Rounded { band: f64::INFINITY, doubtful: Vec::new() };
    let open = SampledField::new(lattice(), values, known, Continuity::ExceptOpenings).expect("a field");
    let closed = sampled(lattice(), |p| A.at(p));
    assert!(matches!(union(&open, &closed, PLENTY, &run), Err(Error::Invalid(_))));
    assert!(matches!(difference(&closed, &open, PLENTY, &run), Err(Error::Invalid(_))));
    assert!(matches!(offset(&open, 1.0, PLENTY, &run), Err(Error::Invalid(_))));
    for bad in [f64::NAN, f64::INFINITY] {
        assert!(matches!(offset(&closed, bad, PLENTY, &run), Err(Error::Invalid(_))));
    }
    let moved = sampled(Lattice { origin: lattice().origin + 1e-9, ..lattice() }, |p| A.at(p));
    assert!(matches!(intersection(&closed, &moved, PLENTY, &run), Err(Error::Invalid(_))));
}

#[test]
fn what_does_not_fit_is_refused() {
    let a = sampled(lattice(), |p| A.at(p));
    let run = Run::default();
    assert!(matches!(union(&a, &a, 1000, &run), Err(Error::Memory { .. })));
    assert!(matches!(offset(&a, 0.1, 29 * lattice().len() as u64 - 1, &run), Err(Error::Memory { .. })));
    assert!(offset(&a, 0.1, 29 * lattice().len() as u64, &run).is_ok());
}

#[test]
fn a_grid_of_cubes_is_a_lattice_of_its_corners() {
    let grid = Grid::over(&Aabb::new(DVec3::new(-1.0, 0.0, 2.0), DVec3::new(0.3, 0.7, 2.9)), 13).expect("a grid");
    let block = Grid { first: [-3, 2, 5], ..grid };
    let lattice = Lattice::from(block);
    let [_, ny, nz] = block.shape.map(i64::from);
    for n in 0..lattice.len() {
        let number = n as i64;
        let corner = block.corner(number / (ny * nz) - 3, number / nz % ny + 2, number % nz + 5);
        assert_eq!(lattice.node(n), corner);
    }
    assert_eq!(lattice.extent().min, lattice.node(0));
    assert_eq!(lattice.extent().max, lattice.node(lattice.len() - 1));
}
