//! Distance transforms against brute force over all pairs of voxels.

use truefield::Run;

use truefield::build::transform::{Border, Image, Measure, Site, Target, Transform};
use truefield::laws::Random;

/// A transform with its own data.
#[derive(Clone, Debug)]
struct Case {
    image: Vec<u8>,
    shape: Vec<usize>,
    spacing: Vec<f64>,
    periodic: Vec<bool>,
    target: Target,
    border: Border,
    measure: Measure,
}

impl Case {
    fn plain(image: Vec<u8>, shape: &[usize]) -> Self {
        assert_eq!(image.len(), shape.iter().product::<usize>());
        Self {
            image,
            shape: shape.to_vec(),
            spacing: vec![1.0; shape.len()],
            periodic: vec![false; shape.len()],
            target: Target::Background,
            border: Border::Nothing,
            measure: Measure::Centers,
        }
    }

    fn random(dice: &mut Random, most: usize) -> Self {
        let axes = dice.below(4) + 1;
        let mut shape = vec![1; axes];
        for _ in 0..20 {
            let axis = dice.below(axes);
            let length = dice.below(40) + 1;
            if shape.iter().product::<usize>() / shape[axis] * length <= most {
                shape[axis] = length;
            }
        }
        let voxels: usize = shape.iter().product();
        let kinds = dice.below(4) + 1;
        let density = [0, 1, 10, 50, 90, 99, 100][dice.below(7)];
        let image = (0..voxels).map(|_| if dice.below(100) < density { 0 } else { dice.below(kinds) as u8 + 1 }).collect();
        let spacings: &[f64] =
            [&[1.0][..], &[0.5, 2.0, 1.0], &[0.7, 0.7, 3.1], &[0.3, std::f64::consts::E, 1.7], &[0.9765625, 2.5]][dice.below(5)];
        Self {
            image,
            spacing: (0..axes).map(|_| spacings[dice.below(spacings.len())]).collect(),
            periodic: (0..axes).map(|_| dice.below(3) == 0).collect(),
            target: [Target::Background, Target::Foreground, Target::OtherSide, Target::OtherLabel][dice.below(4)],
            border: [Border::Nothing, Border::Background, Border::Foreground][dice.below(3)],
            measure: [Measure::Centers, Measure::Between][dice.below(2)],
            shape,
        }
    }

    fn ask(&self) -> Transform<'_> {
        Transform {
            image: Image::U8(&self.image),
            shape: &self.shape,
            spacing: &self.spacing,
            periodic: &self.periodic,
            target: self.target,
            border: self.border,
            measure: self.measure,
            memory: 1 << 30,
        }
    }

    fn distance(&self, threads: usize) -> Vec<f32> {
        let mut out = vec![f32::NAN; self.image.len()];
        self.ask().distance(&mut out, None::<&mut [u32]>, &Run::with_threads(threads)).expect("a transform");
        out
    }

    fn with_sites<S: Site>(&self) -> (Vec<f32>, Vec<S>) {
        let (mut out, mut sites) = (vec![f32::NAN; self.image.len()], vec![S::default(); self.image.len()]);
        self.ask().distance(&mut out, Some(&mut sites), &Run::with_threads(2)).expect("a transform");
        (out, sites)
    }

    fn place(&self, flat: usize) -> Vec<i64> {
        let mut rest = flat;
        let mut place = vec![0; self.shape.len()];
        for axis in (0..self.shape.len()).rev() {
            place[axis] = (rest % self.shape[axis]) as i64;
            rest /= self.shape[axis];
        }
        place
    }

    /// Whether voxel `from` has a site where the image holds `value`, or beyond the border.
    fn is_site(&self, from: usize, value: Option<u8>) -> bool {
        let own = self.image[from];
        match (self.target, value, self.border) {
            (_, None, Border::Nothing) => false,
            (Target::Background, Some(value), _) => value == 0,
            (Target::Background, None, border) => border == Border::Background,
            (Target::Foreground, Some(value), _) => value != 0,
            (Target::Foreground, None, border) => border == Border::Foreground,
            (Target::OtherSide, Some(value), _) => (value != 0) != (own != 0),
            (Target::OtherSide, None, border) => (border == Border::Foreground) != (own != 0),
            (Target::OtherLabel, Some(value), _) => value != own,
            (Target::OtherLabel, None, border) => border == Border::Foreground || own != 0,
        }
    }

    /// Distance between two places as far as one axis goes; `measure` in steps.
    fn along(&self, axis: usize, steps: i64, measure: &impl Fn(f64) -> f64) -> f64 {
        let length = self.shape[axis] as i64;
        let steps = if self.periodic[axis] { steps.rem_euclid(length).min(length - steps.rem_euclid(length)) } else { steps.abs() };
        measure(steps as f64) * self.spacing[axis]
    }

    /// Brute force: the least distance of a voxel to its sites, and the first site at it (`None`: the border).
    fn brute(&self, from: usize, measure: &impl Fn(f64) -> f64) -> (f64, Option<usize>) {
        let at = self.place(from);
        let mut least = (f64::INFINITY, None);
        for to in 0..self.image.len() {
            if self.is_site(from, Some(self.image[to])) {
                let place = self.place(to);
                let square: f64 = (0..at.len()).map(|axis| self.along(axis, place[axis] - at[axis], measure).powi(2)).sum();
                if square < least.0 {
                    least = (square, Some(to));
                }
            }
        }
        if self.is_site(from, None) {
            for axis in (0..at.len()).filter(|&axis| !self.periodic[axis]) {
                for steps in [at[axis] + 1, self.shape[axis] as i64 - at[axis]] {
                    let square: f64 = (0..at.len()).map(|a| self.along(a, if a == axis { steps } else { 0 }, measure).powi(2)).sum();
                    if square < least.0 {
                        least = (square, None);
                    }
                }
            }
        }
        (least.0.sqrt(), least.1)
    }

    fn sign(&self, voxel: usize) -> f64 {
        if self.target == Target::OtherSide && self.image[voxel] != 0 { -1.0 } else { 1.0 }
    }
}

fn centres(steps: f64) -> f64 {
    steps
}

fn between(steps: f64) -> f64 {
    (steps - 0.5).max(0.0)
}

/// Rounding in double precision may decide which way single precision rounds.
fn same(found: f32, truth: f64) -> bool {
    found == truth as f32 || (f64::from(found) - truth).abs() <= truth.abs() * f64::from(f32::EPSILON) * 0.500_001
}

#[test]
fn distances_and_sites_are_those_of_brute_force() {
    let mut dice = Random::new(1);
    for round in 0..700 {
        let case = Case::random(&mut dice, 400);
        let out = case.distance(1 + round % 3);
        let (again, sites) = case.with_sites::<u32>();
        assert_eq!(out.iter().map(|v| v.to_bits()).collect::<Vec<_>>(), again.iter().map(|v| v.to_bits()).collect::<Vec<_>>(), "{case:?}");
        let (_, wide) = case.with_sites::<u64>();
        for voxel in 0..out.len() {
            let (truth, nearest) = if case.measure == Measure::Centers { case.brute(voxel, &centres) } else { case.brute(voxel, &between) };
            assert!(same(out[voxel], case.sign(voxel) * truth), "voxel {voxel}: {} and not {truth} in {case:?}", out[voxel]);
            assert_eq!(sites[voxel] == u32::MAX, wide[voxel] == u64::MAX);
            let Ok(site) = usize::try_from(sites[voxel] as i32) else {
                // Nothing, or the border, which may be as near as a site.
                assert!(truth.is_infinite() || case.is_site(voxel, None), "voxel {voxel} of {case:?}");
                continue;
            };
            assert_eq!(sites[voxel], wide[voxel] as u32);
            assert!(case.is_site(voxel, Some(case.image[site])), "site {site} of voxel {voxel} is none in {case:?}");
            let (at, to) = (case.place(voxel), case.place(site));
            let measure = |steps: f64| if case.measure == Measure::Centers { steps } else { between(steps) };
            let length = (0..at.len()).map(|a| case.along(a, to[a] - at[a], &measure).powi(2)).sum::<f64>().sqrt();
            assert!((length - truth).abs() <= 1e-12 * truth, "site {site} of voxel {voxel} is {length} and not {truth} away in {case:?}");
            if case.border == Border::Nothing && case.spacing.iter().all(|s| *s == 1.0) && !case.periodic.contains(&true) {
                assert_eq!(Some(site), nearest, "the first of equals, voxel {voxel} of {case:?}");
            }
        }
    }
}

#[test]
fn squares_are_whole_where_the_sampling_is_one() {
    let mut dice = Random::new(2);
    for shape in [&[300, 40][..], &[37, 41, 29], &[1000], &[6, 7, 8, 9]] {
        let voxels = shape.iter().product::<usize>();
        let case = Case::plain((0..voxels).map(|_| u8::from(dice.below(200) > 0)).collect(), shape);
        let sites: Vec<_> = (0..voxels).filter(|&v| case.image[v] == 0).map(|v| case.place(v)).collect();
        for (voxel, found) in case.distance(2).into_iter().enumerate() {
            let at = case.place(voxel);
            let square: i64 = sites.iter().map(|site| site.iter().zip(&at).map(|(a, b)| (a - b).pow(2)).sum()).min().expect("a site");
            assert_eq!((f64::from(found) * f64::from(found)).round() as i64, square);
            assert_eq!(found, (square as f64).sqrt() as f32);
        }
    }
}

/// Columns longer, wider and farther from sites than any constant of the passes.
#[test]
fn large_images_are_those_of_brute_force() {
    let mut dice = Random::new(3);
    for (shape, count) in
        [(&[700, 300][..], 5), (&[3, 2000, 33], 4), (&[90, 70, 50], 3), (&[90, 70, 50], 3000), (&[5, 20_000], 7), (&[20_000, 5], 7)]
    {
        for target in [Target::Background, Target::OtherSide] {
            let voxels = shape.iter().product::<usize>();
            let mut image = vec![1; voxels];
            for _ in 0..count {
                image[dice.below(voxels)] = 0;
            }
            let case = Case { target, ..Case::plain(image, shape) };
            let (found, _) = case.with_sites::<u32>();
            let places = [0, 1].map(|kind| (0..voxels).filter(|&v| case.image[v] == kind).map(|v| case.place(v)).collect::<Vec<_>>());
            for _ in 0..3000 {
                let voxel = dice.below(voxels);
                let at = case.place(voxel);
                let kind = if target == Target::Background { 0 } else { 1 - case.image[voxel] };
                let truth: i64 = places[usize::from(kind)]
                    .iter()
                    .map(|site| site.iter().zip(&at).map(|(a, b)| (a - b).pow(2)).sum())
                    .min()
                    .expect("a site");
                assert_eq!(f64::from(found[voxel].abs()), f64::from((truth as f64).sqrt() as f32), "voxel {voxel} of {shape:?}");
            }
        }
    }
}

#[test]
fn distances_beyond_whole_numbers_are_exact_too() {
    // Squares of more than 31 bits, along the first axis and along the last.
    for shape in [[50_000, 2], [2, 50_000]] {
        let mut image = vec![1; 100_000];
        image[0] = 0;
        let case = Case::plain(image, &shape);
        let (found, sites) = case.with_sites::<u32>();
        let truth = |voxel: usize| case.place(voxel).iter().map(|x| (x * x) as f64).sum::<f64>().sqrt();
        for voxel in (0..100_000).step_by(37).chain([99_998, 99_999]) {
            assert_eq!(found[voxel], truth(voxel) as f32);
            assert_eq!(sites[voxel], 0);
        }
    }
}

#[test]
fn bounds_hold_for_brute_force_over_voxels() {
    let mut dice = Random::new(4);
    for _ in 0..300 {
        let case = Case::random(&mut dice, 250);
        let (mut lower, mut upper) = (vec![f32::NAN; case.image.len()], vec![f32::NAN; case.image.len()]);
        case.ask().bounds(&mut lower, &mut upper, &Run::with_threads(2)).expect("bounds");
        let sides = matches!(case.target, Target::OtherSide | Target::OtherLabel);
        for voxel in 0..lower.len() {
            let near = case.brute(voxel, &|steps| (steps - if sides { 1.5 } else { 0.5 }).max(0.0)).0;
            let far = case.brute(voxel, &|steps| steps + 0.5).0;
            let (low, high) = if case.sign(voxel) < 0.0 { (-upper[voxel], -lower[voxel]) } else { (lower[voxel], upper[voxel]) };
            let tight = |found: f32, truth: f64| (f64::from(found) - truth).abs() <= 3e-7 * truth || f64::from(found) == truth;
            // Brute force is itself rounded in double precision.
            assert!(f64::from(low) <= near * (1.0 + 1e-15) && tight(low, near), "{low} for {near}, voxel {voxel} of {case:?}");
            assert!(f64::from(high) >= far * (1.0 - 1e-15) && tight(high, far), "{high} for {far}, voxel {voxel} of {case:?}");
        }
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let mut dice = Random::new(5);
    for shape in [&[40, 60, 130][..], &[500, 400], &[3, 4, 70, 80]] {
        let voxels = shape.iter().product::<usize>();
        let image: Vec<u8> = (0..voxels).map(|_| dice.below(20).min(2) as u8).collect();
        for target in [Target::Background, Target::OtherLabel] {
            let case =
                Case { target, spacing: (0..shape.len()).map(|a| 1.0 + a as f64 / 7.1).collect(), ..Case::plain(image.clone(), shape) };
            let one = case.distance(1);
            for threads in [2, 3, 8] {
                assert_eq!(one, case.distance(threads));
            }
        }
    }
}

/// Asks for distances and sites, and hands back the bits and the sites.
fn answer(ask: Transform<'_>) -> (Vec<u32>, Vec<u32>) {
    let (mut out, mut sites) = (vec![0.0; ask.image.len()], vec![0u32; ask.image.len()]);
    ask.distance(&mut out, Some(&mut sites), &Run::with_threads(2)).expect("a transform");
    (out.iter().map(|v| v.to_bits()).collect(), sites)
}

#[test]
fn every_type_of_voxel_answers_the_same() {
    let mut dice = Random::new(6);
    let case = Case { target: Target::OtherSide, ..Case::plain((0..5000).map(|_| dice.below(3) as u8).collect(), &[50, 100]) };
    let expected = answer(case.ask());
    let shorts: Vec<u16> = case.image.iter().map(|&v| u16::from(v) << 9).collect();
    let words: Vec<u32> = case.image.iter().map(|&v| u32::from(v) << 30).collect();
    let longs: Vec<u64> = case.image.iter().map(|&v| u64::from(v) << 40).collect();
    let floats: Vec<f32> = case.image.iter().map(|&v| [-0.0, 1e-45, f32::NEG_INFINITY][usize::from(v)]).collect();
    let doubles: Vec<f64> = case.image.iter().map(|&v| [-0.0, 5e-324, -2.0][usize::from(v)]).collect();
    for image in [Image::U16(&shorts), Image::U32(&words), Image::U64(&longs), Image::F32(&floats), Image::F64(&doubles)] {
        assert_eq!(answer(Transform { image, ..case.ask() }), expected);
    }
    let labels = Transform { target: Target::OtherLabel, ..case.ask() };
    for image in [Image::U16(&shorts), Image::U32(&words)] {
        assert_eq!(answer(Transform { image, ..labels }), answer(labels));
    }
}

#[test]
fn what_cannot_be_asked_is_refused() {
    let case = Case::plain(vec![1; 12], &[3, 4]);
    let mut out = vec![0.0; 12];
    let run = Run::with_threads(1);
    let mut refused = |ask: Transform<'_>, word: &str| {
        let error = ask.distance(&mut out, None::<&mut [u32]>, &run).expect_err(word).to_string();
        assert!(error.contains(word), "{error}");
    };
    refused(Transform { spacing: &[1.0, 0.0], ..case.ask() }, "sampling");
    refused(Transform { spacing: &[1.0, f64::NAN], ..case.ask() }, "sampling");
    refused(Transform { spacing: &[1.0], ..case.ask() }, "spacings");
    refused(Transform { shape: &[3, 5], ..case.ask() }, "shape");
    refused(Transform { shape: &[usize::MAX, usize::MAX], ..case.ask() }, "shape");
    let floats = [f64::NAN; 12];
    refused(Transform { image: Image::F64(&floats), ..case.ask() }, "not a number");
    refused(Transform { image: Image::F64(&floats), target: Target::OtherLabel, ..case.ask() }, "labels");
    refused(Transform { spacing: &[1.0, std::f64::consts::PI], memory: 95, ..case.ask() }, "MiB");
    let mut sites = [0u32; 11];
    assert!(case.ask().distance(&mut [0.0; 12], Some(&mut sites), &run).is_err());
    let empty = Case::plain(Vec::new(), &[3, 0]);
    assert_eq!(empty.distance(2), []);
}
