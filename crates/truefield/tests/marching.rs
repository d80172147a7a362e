//! Wavefronts and fast marching against brute force and against the paper's own loop.

use truefield::build::difference::{Difference, difference};
use truefield::build::march::{march, march_sites};
use truefield::build::raster::NO_SITE;
use truefield::build::wavefront::{Wavefront, wavefront};
use truefield::laws::{Random, check_threads};
use truefield::{Cancel, DVec3, Error, Grid, Run};

const PLENTY: u64 = 1 << 32;
const FAR: f64 = f64::INFINITY;

fn two() -> Run<'static> {
    Run::with_threads(2)
}

/// A volume in the plainest terms.
struct Volume {
    shape: Vec<usize>,
    sampling: Vec<f64>,
    sites: Vec<bool>,
}

impl Volume {
    fn random(shape: &[usize], sampling: &[f64], density: f64, random: &mut Random) -> Self {
        let count = shape.iter().product();
        let sites = (0..count).map(|_| random.unit() < density).collect();
        Self { shape: shape.to_vec(), sampling: sampling.to_vec(), sites }
    }

    fn place(&self, mut index: usize) -> [i64; 3] {
        let mut place = [0; 3];
        for axis in (0..self.shape.len()).rev() {
            place[axis] = (index % self.shape[axis]) as i64;
            index /= self.shape[axis];
        }
        place
    }

    /// Whole numbers where all sampling is the same, so that ties are ties.
    fn squared(&self, a: usize, b: usize) -> f64 {
        let (a, b) = (self.place(a), self.place(b));
        let steps = |axis: usize| ((a[axis] - b[axis]) * (a[axis] - b[axis])) as f64;
        let first = self.sampling[0];
        if self.sampling.iter().all(|s| *s == first) {
            return (0..self.shape.len()).map(steps).sum::<f64>() * (first * first);
        }
        (0..self.shape.len()).map(|axis| steps(axis) * (self.sampling[axis] * self.sampling[axis])).sum()
    }

    /// The nearest site of every voxel.
    fn brute(&self) -> Vec<u32> {
        let sites: Vec<usize> = (0..self.sites.len()).filter(|&v| self.sites[v]).collect();
        let nearest = |v: usize| sites.iter().copied().min_by(|&a, &b| self.squared(v, a).total_cmp(&self.squared(v, b)));
        (0..self.sites.len()).map(|v| nearest(v).map_or(NO_SITE, |site| site as u32)).collect()
    }

    fn neighbours(&self, v: usize) -> Vec<usize> {
        let place = self.place(v);
        let mut out = vec![];
        'steps: for n in 0..3usize.pow(self.shape.len() as u32) {
            let mut index = 0;
            for axis in 0..self.shape.len() {
                let digit = n / 3usize.pow((self.shape.len() - 1 - axis) as u32) % 3;
                let at = place[axis] + digit as i64 - 1;
                if at < 0 || at >= self.shape[axis] as i64 {
                    continue 'steps;
                }
                index = index * self.shape[axis] + at as usize;
            }
            if index != v {
                out.push(index);
            }
        }
        out
    }

    /// Algorithm 1 as it stands: two buffers, every voxel and every neighbour in every pass.
    fn algorithm(&self) -> (Vec<u32>, Vec<u64>) {
        let count = self.sites.len();
        let mut old: Vec<u32> = (0..count).map(|v| if self.sites[v] { v as u32 } else { NO_SITE }).collect();
        // What rounding may do to ties is no difference.
        let rounded = |d: f64| f64::from_bits(d.to_bits() & !31);
        let length = |v: usize, site: u32| if site == NO_SITE { f64::INFINITY } else { rounded(self.squared(v, site as usize)) };
        let mut changed = vec![];
        loop {
            let mut new = old.clone();
            for v in 0..count {
                let kept = length(v, old[v]);
                let offers = self.neighbours(v).into_iter().map(|u| (length(v, old[u]), old[u]));
                // The first of equals.
                if let Some((_, site)) = offers.filter(|(d, _)| *d < kept).min_by(|a, b| a.0.total_cmp(&b.0)) {
                    new[v] = site;
                }
            }
            let count = old.iter().zip(&new).filter(|(a, b)| a != b).count() as u64;
            old = new;
            if count == 0 {
                return (old, changed);
            }
            changed.push(count);
        }
    }

    fn march(&self, run: &Run<'_>) -> Wavefront {
        wavefront(&self.shape, &self.sampling, &self.sites, FAR, PLENTY, run).expect("a wavefront")
    }

    fn difference(&self, marched: &[u32], exact: &[u32]) -> Result<Difference, Error> {
        difference(&self.shape, &self.sampling, marched, exact, &two())
    }

    /// Distances belong to their sites, which are there and no nearer than the nearest.
    fn judge(&self, sites: &[u32], distance: &[f32]) {
        for (v, (&site, &distance)) in sites.iter().zip(distance).enumerate() {
            if site == NO_SITE {
                assert_eq!(distance, f32::INFINITY);
                continue;
            }
            assert!(self.sites[site as usize], "voxel {v} of {:?} has {site}, which is no site", self.shape);
            let truth = self.squared(v, site as usize).sqrt();
            assert!((f64::from(distance) - truth).abs() <= 1e-7 * truth, "{distance} is not {truth}");
        }
    }
}

fn volumes() -> Vec<Volume> {
    let mut random = Random::new(41);
    let shapes: [&[usize]; 12] = [
        &[1],
        &[37],
        &[1, 1, 1],
        &[9, 1, 11],
        &[1, 50, 31],
        &[23, 33],
        &[33, 1],
        &[7, 8, 9],
        &[29, 6, 5],
        &[2, 2, 2],
        &[13, 13, 13],
        &[1, 1, 64],
    ];
    let mut out = vec![];
    for shape in shapes {
        for density in [0.0, 0.004, 0.05, 0.5, 1.0] {
            for sampling in [[1.0, 1.0, 1.0], [0.3, 0.3, 0.3], [0.5, 0.5, 2.0], [1.0, 3.7, 0.1]] {
                out.push(Volume::random(shape, &sampling[..shape.len()], density, &mut random));
            }
        }
    }
    out
}

#[test]
fn wavefronts_are_the_algorithm_to_the_last_pass() {
    for volume in volumes() {
        let (sites, changed) = volume.algorithm();
        let found = volume.march(&two());
        assert_eq!(found.changed, changed, "{:?} {:?}", volume.shape, volume.sampling);
        assert_eq!(found.sites, sites, "{:?} {:?}", volume.shape, volume.sampling);
        volume.judge(&found.sites, &found.distance);
    }
}

#[test]
fn wavefronts_end_in_time() {
    for volume in volumes() {
        let found = volume.march(&two());
        // The paper allows the length of the diagonal; the longest axis is enough.
        let longest = volume.shape.iter().max().expect("an axis");
        assert!(found.changed.len() < *longest, "{} passes over {:?}", found.changed.len(), volume.shape);
        let any = volume.sites.contains(&true);
        assert!(found.sites.iter().all(|site| (*site != NO_SITE) == any));
    }
    // A site in one corner has the longest way to go: a ring a pass.
    let mut corner = Volume::random(&[20, 31, 17], &[1.0; 3], 0.0, &mut Random::new(1));
    corner.sites[0] = true;
    let found = corner.march(&two());
    assert_eq!(found.changed.len(), 30);
    assert_eq!(found.changed.iter().sum::<u64>(), 20 * 31 * 17 - 1);
    assert_eq!(found.distance[20 * 31 * 17 - 1], (19.0f64 * 19.0 + 30.0 * 30.0 + 16.0 * 16.0).sqrt() as f32);
}

#[test]
fn wavefronts_are_exact() {
    for volume in volumes() {
        let found = volume.march(&two());
        let counted = volume.difference(&found.sites, &volume.brute()).expect("a difference");
        assert_eq!(counted, Difference::default(), "{:?} {:?}", volume.shape, volume.sampling);
    }
    // Few sites, close together, have the thinnest cells.
    let mut random = Random::new(12);
    for round in 0..60 {
        let (shape, sampling): (&[usize], &[f64]) = [
            (&[150, 150][..], &[1.0, 1.0][..]),
            (&[150, 150], &[1.0, 0.37]),
            (&[33, 34, 35], &[1.0; 3]),
            (&[33, 34, 35], &[0.5, 2.0, 1.0]),
        ][round % 4];
        let mut volume = Volume::random(shape, sampling, 0.0, &mut random);
        for _ in 0..2 + random.below(9) {
            let index = shape.iter().fold(0, |index, n| index * n + random.below(*n.min(&20)));
            volume.sites[index] = true;
        }
        let found = volume.march(&two());
        assert_eq!(volume.difference(&found.sites, &volume.brute()).expect("a difference"), Difference::default());
    }
}

#[test]
fn the_checker_counts_what_brute_force_finds() {
    // Voronoi cells on a grid need not be connected, and the order of distances cuts some off.
    let mut volume = Volume::random(&[120, 120], &[1.0; 2], 0.0, &mut Random::new(1));
    for [i, j] in [[13, 7], [9, 0], [14, 2], [14, 3], [12, 12]] {
        volume.sites[i * 120 + j] = true;
    }
    let exact = volume.brute();
    let found = march_sites(&volume.shape, &volume.sampling, &volume.sites, FAR, PLENTY, &two()).expect("a march");
    let length = |v: usize, site: u32| volume.squared(v, site as usize).sqrt();
    let excess = |v: usize| length(v, found.points[v]) - length(v, exact[v]);
    let farther: Vec<f64> = (0..exact.len()).map(excess).filter(|d| *d > 1e-9).collect();
    assert!(!farther.is_empty());
    let counted = volume.difference(&found.points, &exact).expect("a difference");
    assert_eq!(counted.voxels, farther.len() as u64);
    assert!((counted.largest - farther.iter().copied().fold(0.0, f64::max)).abs() < 1e-9);
    // What is nearer than the nearest is a fault of the caller.
    let error = volume.difference(&exact, &found.points).expect_err("sites that are not nearest");
    assert!(error.to_string().contains("is nearer"), "{error}");
}

#[test]
fn a_planted_fault_is_counted() {
    let volume = Volume::random(&[9, 10, 11], &[1.0, 1.0, 2.0], 0.02, &mut Random::new(4));
    let exact = volume.brute();
    assert_eq!(volume.difference(&exact, &exact).expect("a difference"), Difference::default());
    let site = exact.iter().copied().find(|s| *s != exact[500]).expect("another site");
    let mut marched = exact.clone();
    marched[500] = site;
    let truth = volume.squared(500, site as usize).sqrt() - volume.squared(500, exact[500] as usize).sqrt();
    let found = volume.difference(&marched, &exact).expect("a difference");
    assert!(found.voxels == 1 && (found.largest - truth).abs() < 1e-12, "{found:?} {truth}");
    marched[3] = NO_SITE;
    assert_eq!(volume.difference(&marched, &exact).expect("a difference").voxels, 2);
    marched[3] = 5000;
    assert!(volume.difference(&marched, &exact).is_err());
    assert!(volume.difference(&exact[1..], &exact).is_err());
}

#[test]
fn wavefronts_stop_at_their_limit() {
    for sampling in [[1.0, 1.0, 1.0], [0.7, 0.7, 0.7], [1.0, 0.4, 0.9]] {
        let volume = Volume::random(&[24, 25, 26], &sampling, 0.001, &mut Random::new(8));
        let whole = volume.march(&two());
        for limit in [0.1, 1.0, 2.0, 3.0_f64.sqrt() * 0.7, 5.5] {
            let found = wavefront(&volume.shape, &sampling, &volume.sites, limit, PLENTY, &two()).expect("a wavefront");
            let marched = march_sites(&volume.shape, &sampling, &volume.sites, limit, PLENTY, &two()).expect("a march");
            volume.judge(&found.sites, &found.distance);
            volume.judge(&marched.points, &marched.distance);
            for v in 0..found.sites.len() {
                let truth = volume.squared(v, whole.sites[v] as usize).sqrt();
                if (truth - limit).abs() > 1e-9 && found.sites[v] == NO_SITE {
                    assert!(truth > limit, "{truth} is left out at {limit}");
                }
                for site in [found.sites[v], marched.points[v]] {
                    assert!(site == NO_SITE || volume.squared(v, site as usize).sqrt() <= limit * (1.0 + 1e-9));
                }
            }
        }
    }
}

#[test]
fn wavefronts_do_not_depend_on_threads() {
    // Fronts of more than the voxels that one thread does alone.
    let volume = Volume::random(&[90, 61, 70], &[1.0; 3], 0.02, &mut Random::new(3));
    check_threads("a wavefront", |run| wavefront(&volume.shape, &volume.sampling, &volume.sites, FAR, PLENTY, run)).expect("the same");
    let first = volume.march(&two()).changed[0];
    assert!(first > 100_000, "{first}");
}

#[test]
fn marches_keep_sites_at_least_as_near_as_order_promises() {
    let (mut voxels, mut farther) = (0, 0);
    for volume in volumes() {
        let exact = volume.brute();
        let found = march_sites(&volume.shape, &volume.sampling, &volume.sites, FAR, PLENTY, &two()).expect("a march");
        volume.judge(&found.points, &found.distance);
        let any = volume.sites.contains(&true);
        assert!(found.points.iter().all(|point| (*point != NO_SITE) == any));
        let counted = volume.difference(&found.points, &exact).expect("a difference");
        if volume.shape.iter().filter(|n| **n > 1).count() <= 1 {
            assert_eq!(counted.voxels, 0, "along a line nothing stands between a voxel and its site");
        }
        (voxels, farther) = (voxels + exact.len() as u64, farther + counted.voxels);
    }
    assert!(farther * 100 < voxels, "{farther} of {voxels}");
}

#[test]
fn marches_carry_points_from_a_narrow_band() {
    // A ball: the lattice points next to its surface know their closest points exactly.
    let grid = Grid { origin: DVec3::new(-1.3, -1.25, -1.2), spacing: 0.05, first: [3, -2, 1], shape: [50, 52, 49] };
    let at = |index: usize| {
        let [_, ny, nz] = grid.shape.map(|n| n as usize);
        let [i, j, k] = [index / nz / ny, index / nz % ny, index % nz].map(|i| i as i64);
        grid.corner(grid.first[0] + i, grid.first[1] + j, grid.first[2] + k)
    };
    let (mut points, mut known) = (vec![], vec![]);
    for index in 0..grid.len() {
        let p = at(index);
        if (p.length() - 1.0).abs() < grid.spacing {
            known.push((index as u32, points.len() as u32));
            points.push(p.normalize());
        }
    }
    let found = march(&grid, &points, &known, FAR, PLENTY, &two()).expect("a march");
    let mut worst = 0.0f64;
    for index in 0..grid.len() {
        let (p, point) = (at(index), points[found.points[index] as usize]);
        assert!((f64::from(found.distance[index]) - (p - point).length()).abs() < 1e-6);
        worst = worst.max((p - point).length() - (p.length() - 1.0).abs());
    }
    // Far finer than the spacing: accuracy follows the points.
    assert!(worst > -1e-12 && worst < 0.2 * grid.spacing, "{worst}");
}

#[test]
fn bad_input_is_a_sentence() {
    let go = |shape: &[usize], sampling: &[f64], count: usize, limit: f64| {
        let sites = vec![true; count];
        let a = wavefront(shape, sampling, &sites, limit, PLENTY, &two()).map(|_| ());
        let b = march_sites(shape, sampling, &sites, limit, PLENTY, &two()).map(|_| ());
        assert_eq!(a, b);
        a.expect_err("refused").to_string()
    };
    assert!(go(&[2, 2, 2, 2], &[1.0; 4], 16, FAR).contains("4 axes"));
    assert!(go(&[], &[], 1, FAR).contains("0 axes"));
    assert!(go(&[4, 4], &[1.0], 16, FAR).contains("1 numbers"));
    for bad in [0.0, -1.0, f64::NAN, FAR] {
        assert!(go(&[4, 4], &[1.0, bad], 16, FAR).contains("positive"));
    }
    assert!(go(&[4, 4], &[1.0, 1.0], 15, FAR).contains("15 marks"));
    assert!(go(&[4, 4], &[1.0, 1.0], 16, f64::NAN).contains("limit"));
    assert!(go(&[4, 4], &[1.0, 1.0], 16, 0.0).contains("limit"));
    assert!(go(&[1 << 20, 1 << 20, 1 << 30], &[1.0; 3], 1, FAR).contains("voxels"));
    let long = wavefront(&[40_000], &[1.0], &vec![true; 40_000], FAR, PLENTY, &two()).expect_err("too long");
    assert!(long.to_string().contains("40000"), "{long}");
    let large = wavefront(&[100, 100], &[1.0; 2], &vec![true; 10_000], FAR, 100_000, &two());
    assert!(matches!(large, Err(Error::Memory { needed, allowed: 100_000, .. }) if needed > 160_000 && needed < 200_000), "{large:?}");
    assert!(matches!(march_sites(&[100, 100], &[1.0; 2], &vec![true; 10_000], FAR, 100_000, &two()), Err(Error::Memory { .. })));
    let grid = Grid { origin: DVec3::ZERO, spacing: 1.0, first: [0; 3], shape: [2, 2, 2] };
    assert!(march(&grid, &[DVec3::NAN], &[], FAR, PLENTY, &two()).is_err());
    assert!(march(&grid, &[DVec3::ZERO], &[(0, 1)], FAR, PLENTY, &two()).is_err());
    assert!(march(&grid, &[DVec3::ZERO], &[(8, 0)], FAR, PLENTY, &two()).is_err());
    // No voxels and no sites are no fault.
    assert_eq!(wavefront(&[0, 5], &[1.0; 2], &[], FAR, PLENTY, &two()).expect("nothing").sites, []);
    assert_eq!(march_sites(&[5, 0], &[1.0; 2], &[], FAR, PLENTY, &two()).expect("nothing").points, []);
}

#[test]
fn marches_can_be_stopped() {
    let volume = Volume::random(&[40, 40, 40], &[1.0; 3], 0.001, &mut Random::new(2));
    let cancel = Cancel::new();
    cancel.cancel();
    let run = Run { cancel: &cancel, ..two() };
    assert_eq!(wavefront(&volume.shape, &volume.sampling, &volume.sites, FAR, PLENTY, &run), Err(Error::Cancelled));
    assert_eq!(march_sites(&volume.shape, &volume.sampling, &volume.sites, FAR, PLENTY, &run), Err(Error::Cancelled));
    // However few voxels are there to settle, and many trials to begin with.
    assert_eq!(march_sites(&[2, 2, 2], &[1.0; 3], &[true; 8], FAR, PLENTY, &run), Err(Error::Cancelled));
}
