//! Distance transforms along axes at any angles, against brute force over all pairs of voxels.

use truefield::build::transform::{Image, Measure, Skewed, Target};
use truefield::laws::Random;
use truefield::{DVec3, Run};

struct Case {
    image: Vec<u8>,
    shape: Vec<usize>,
    steps: Vec<DVec3>,
    target: Target,
    measure: Measure,
}

impl Case {
    fn random(dice: &mut Random) -> Self {
        let axes = 2 + dice.below(2);
        let shape: Vec<usize> = (0..axes).map(|_| 1 + dice.below(if axes == 2 { 20 } else { 8 })).collect();
        // From nearly perpendicular to lattices whose steps are far from the shortest.
        let skew = [0.01, 0.5, 4.0][dice.below(3)];
        let mut steps: Vec<DVec3> = (0..axes)
            .map(|axis| {
                let mut step = dice.direction() * skew;
                if axes == 2 {
                    step.z = 0.0;
                }
                step[axis] += dice.between(0.5, 2.0);
                step
            })
            .collect();
        if dice.below(4) == 0 {
            // Whole numbers, with ties.
            steps.iter_mut().for_each(|step| *step = step.round());
            for (axis, step) in steps.iter_mut().enumerate() {
                step[axis] += 9.0;
            }
        }
        let density = [0, 1, 10, 50, 90, 100][dice.below(6)];
        let voxels: usize = shape.iter().product();
        let image = (0..voxels).map(|_| if dice.below(100) < density { 0 } else { 1 + dice.below(3) as u8 }).collect();
        let target = [Target::Background, Target::Foreground, Target::OtherSide, Target::OtherLabel][dice.below(4)];
        Self { image, shape, steps, target, measure: [Measure::Centers, Measure::Between][dice.below(2)] }
    }

    fn ask(&self) -> Skewed<'_> {
        let (target, measure) = (self.target, self.measure);
        Skewed { image: Image::U8(&self.image), shape: &self.shape, steps: &self.steps, target, measure, memory: 1 << 30 }
    }

    fn place(&self, flat: usize) -> Vec<i64> {
        let strides: Vec<usize> = (0..self.shape.len()).map(|axis| self.shape[axis + 1..].iter().product()).collect();
        strides.iter().zip(&self.shape).map(|(stride, length)| (flat / stride % length) as i64).collect()
    }

    fn way(&self, from: usize, to: usize) -> DVec3 {
        let (from, to) = (self.place(from), self.place(to));
        self.steps.iter().zip(from.iter().zip(&to)).map(|(&step, (a, b))| step * (b - a) as f64).sum()
    }

    fn is_site(&self, from: usize, to: usize) -> bool {
        let (own, value) = (self.image[from], self.image[to]);
        match self.target {
            Target::Background => value == 0,
            Target::Foreground => value != 0,
            Target::OtherSide => (value == 0) != (own == 0),
            Target::OtherLabel => value != own,
        }
    }

    /// Distance from the origin to the voxel about `centre`, by alternating projections onto its axes.
    fn to_voxel(&self, centre: DVec3) -> f64 {
        let mut along = vec![0.0; self.steps.len()];
        let mut length = f64::INFINITY;
        for _ in 0..20_000 {
            for axis in 0..along.len() {
                let rest = centre + (0..along.len()).filter(|&a| a != axis).map(|a| self.steps[a] * along[a]).sum::<DVec3>();
                along[axis] = (-rest.dot(self.steps[axis]) / self.steps[axis].length_squared()).clamp(-0.5, 0.5);
            }
            let now = (centre + self.steps.iter().zip(&along).map(|(&step, &t)| step * t).sum::<DVec3>()).length();
            if length - now <= 1e-13 * now {
                break;
            }
            length = now;
        }
        length
    }
}

#[test]
fn distances_and_sites_are_those_of_brute_force() {
    let mut dice = Random::new(21);
    for round in 0..250 {
        let case = Case::random(&mut dice);
        let voxels = case.image.len();
        let (mut out, mut sites) = (vec![f32::NAN; voxels], vec![0u32; voxels]);
        case.ask().distance(&mut out, Some(&mut sites), &Run::with_threads(1 + round % 3)).expect("a transform");
        for voxel in (0..voxels).step_by(if case.measure == Measure::Centers { 1 } else { 7 }) {
            let sign = if case.target == Target::OtherSide && case.image[voxel] != 0 { -1.0 } else { 1.0 };
            let all = (0..voxels).filter(|&to| case.is_site(voxel, to));
            let far = |to: usize| {
                let way = case.way(voxel, to);
                if case.measure == Measure::Centers || to == voxel { way.length() } else { case.to_voxel(way) }
            };
            let truth = all.map(far).fold(f64::INFINITY, f64::min);
            let slack = if case.measure == Measure::Centers { 1.2e-7 } else { 1e-5 };
            assert!(
                f64::from(out[voxel]) == sign * truth || (f64::from(out[voxel]) - sign * truth).abs() <= slack * truth,
                "voxel {voxel}: {} and not {truth}; shape {:?}, steps {:?}, {:?}, {:?}",
                out[voxel],
                case.shape,
                case.steps,
                case.target,
                case.measure
            );
            if truth.is_infinite() {
                assert_eq!(sites[voxel], u32::MAX);
            } else {
                let site = sites[voxel] as usize;
                assert!(case.is_site(voxel, site));
                assert!((far(site) - truth).abs() <= 1e-5 * truth.max(1e-12));
            }
        }
    }
}

#[test]
fn of_equals_the_lowest_is_found() {
    let mut image = vec![1; 49];
    for site in [10, 24, 38] {
        image[site] = 0;
    }
    let steps = [DVec3::new(2.0, 1.0, 0.0), DVec3::new(1.0, 2.0, 0.0)];
    let case = Case { image, shape: vec![7, 7], steps: steps.to_vec(), target: Target::Background, measure: Measure::Centers };
    let (mut out, mut sites) = (vec![0.0; 49], vec![0u64; 49]);
    case.ask().distance(&mut out, Some(&mut sites), &Run::with_threads(1)).expect("a transform");
    for voxel in 0..49 {
        let first = [10, 24, 38].into_iter().min_by(|&a, &b| case.way(voxel, a).length().total_cmp(&case.way(voxel, b).length()));
        assert_eq!(Some(sites[voxel] as usize), first);
    }
}

#[test]
fn bounds_enclose_every_point_of_the_voxels_they_speak_of() {
    let mut dice = Random::new(22);
    for _ in 0..60 {
        let case = Case { measure: Measure::Centers, ..Case::random(&mut dice) };
        let voxels = case.image.len();
        let [mut centres, mut lower, mut upper] = [0; 3].map(|_| vec![0.0; voxels]);
        let run = Run::with_threads(2);
        case.ask().distance(&mut centres, None::<&mut [u32]>, &run).expect("a transform");
        case.ask().bounds(&centres, &mut lower, &mut upper, &run).expect("bounds");
        let sides = matches!(case.target, Target::OtherSide | Target::OtherLabel);
        for voxel in 0..voxels {
            let minus = case.target == Target::OtherSide && case.image[voxel] != 0;
            let (low, high) = if minus { (-upper[voxel], -lower[voxel]) } else { (lower[voxel], upper[voxel]) };
            let mut nearest = f64::INFINITY;
            for to in (0..voxels).filter(|&to| case.is_site(voxel, to)) {
                let way = case.way(voxel, to);
                nearest = nearest.min(way.length());
                // A random point of the voxel, or of one of its neighbours where these count too.
                let reach = if sides { 1.5 } else { 0.5 };
                let point = way + case.steps.iter().map(|&step| step * dice.between(-reach, reach)).sum::<DVec3>();
                assert!(f64::from(low) <= point.length());
            }
            assert!(f64::from(high) >= nearest);
        }
    }
}

#[test]
fn what_cannot_be_asked_is_refused() {
    let steps = vec![DVec3::X, DVec3::new(0.5, 1.0, 0.0)];
    let case = Case { image: vec![1; 12], shape: vec![3, 4], steps, target: Target::Background, measure: Measure::Centers };
    let mut out = vec![0.0; 12];
    let run = Run::with_threads(1);
    let mut refused = |ask: Skewed<'_>, word: &str| {
        let error = ask.distance(&mut out, None::<&mut [u32]>, &run).expect_err(word).to_string();
        assert!(error.contains(word), "{error}");
    };
    refused(Skewed { steps: &[DVec3::X, DVec3::X], ..case.ask() }, "singular");
    refused(Skewed { steps: &[DVec3::X, DVec3::NAN], ..case.ask() }, "singular");
    refused(Skewed { steps: &[DVec3::X], ..case.ask() }, "axes");
    refused(Skewed { shape: &[12], steps: &[DVec3::X], ..case.ask() }, "axes");
    refused(Skewed { shape: &[3, 5], ..case.ask() }, "shape");
    refused(Skewed { shape: &[1 << 30, 0], ..case.ask() }, "2^30");
    refused(Skewed { memory: 10, ..case.ask() }, "MiB");
    let floats = [f32::NAN; 12];
    refused(Skewed { image: Image::F32(&floats), ..case.ask() }, "not a number");
    refused(Skewed { image: Image::F32(&floats), target: Target::OtherLabel, ..case.ask() }, "labels");
}
