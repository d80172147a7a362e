//! Visiting scattered points so that neighbours follow each other.
//!
//! Points are sorted along a space-filling (Morton) curve, or by another key, in runs of the given order, run by run; the
//! runs are cut at the same keys, and what lies between two cuts is one piece of work. Nothing depends on the threads.

use crate::error::Result;
use crate::geom::{Aabb, DVec3};
use crate::run::Run;
use crate::simd::{Fuse, multiversion};

/// Points of a run, sorted on its own; its answers are put in their places at once.
const RUN: usize = 1 << 16;

/// A piece of work is about so many points, or fewer where that leaves too few pieces for many threads.
const MOST: usize = 8192;
const LEAST: usize = 512;
const PIECES: usize = 128;

const BITS: u32 = 10;

/// Where a point lies on the curve, or another key, then its index.
pub(crate) type Place = (u32, u32);

/// What `answer` makes of all points, in their order. It is given some thousand points that follow each other along the
/// curve, and their places on it, ascending; which ones does not depend on the threads.
///
/// Where points go that are not finite does not matter.
pub(crate) fn along_curve<T: Copy + Send + Sync>(
    phase: &'static str,
    points: &[DVec3],
    run: &Run<'_>,
    answer: impl Fn(&[DVec3], &[u32]) -> Vec<T> + Sync,
) -> Result<Vec<T>> {
    let boxes = run.blocks(phase, points.len().div_ceil(RUN), |at| Ok(around(&points[part(at, points.len())])))?;
    let curve = Curve::over(&boxes.iter().fold(Aabb::EMPTY, |all, &one| all.union(one)));
    // By a finer curve of their own: the first may have been spoilt by a point far away.
    by_key(phase, points, run, |points| curve.places(points), |points| along_own_curve(points, &answer))
}

/// What `answer` makes of points, in their order, given them along a curve around them, with their places on it.
pub(crate) fn along_own_curve<T: Copy>(points: &[DVec3], answer: impl FnOnce(&[DVec3], &[u32]) -> Vec<T>) -> Vec<T> {
    let curve = Curve::over(&around(points));
    let mut places: Vec<Place> = curve.places(points).into_iter().zip(0..).collect();
    sort(&mut places);
    let (keys, points): (Vec<u32>, Vec<DVec3>) = places.iter().map(|&(key, i)| (key, points[i as usize])).unzip();
    let sorted = answer(&points, &keys);
    let mut answers = sorted.clone();
    for (&(_, i), &answer) in places.iter().zip(&sorted) {
        answers[i as usize] = answer;
    }
    answers
}

/// What `answer` makes of all points, in their order. It is given some thousand points, in any order, whose keys follow
/// those of the points before; which ones does not depend on the threads.
pub(crate) fn by_key<T: Copy + Send + Sync>(
    phase: &'static str,
    points: &[DVec3],
    run: &Run<'_>,
    keys: impl Fn(&[DVec3]) -> Vec<u32> + Sync,
    answer: impl Fn(&[DVec3]) -> Vec<T> + Sync,
) -> Result<Vec<T>> {
    let runs = run.blocks(phase, points.len().div_ceil(RUN), |at| {
        let range = part(at, points.len());
        let mut places: Vec<Place> = keys(&points[range.clone()]).into_iter().zip(range.start as u32..).collect();
        sort(&mut places);
        Ok(places)
    })?;
    let pieces = pieces(&runs, points.len());
    let answers = run.blocks(phase, pieces.len(), |piece| {
        let mut fetched = Vec::with_capacity(pieces[piece].iter().map(|part| part.len()).sum());
        for (run, part) in runs.iter().zip(&pieces[piece]) {
            fetched.extend(run[part.clone()].iter().map(|&(_, i)| points[i as usize]));
        }
        Ok(answer(&fetched))
    })?;
    let Some(&any) = answers.first().and_then(|piece| piece.first()) else { return Ok(Vec::new()) };
    let mut out = vec![any; points.len()];
    run.chunks(phase, &mut out, RUN, |at, out| {
        for (parts, answers) in pieces.iter().zip(&answers) {
            let before: usize = parts[..at].iter().map(|part| part.len()).sum();
            for (&(_, i), &answer) in runs[at][parts[at].clone()].iter().zip(&answers[before..]) {
                out[i as usize - at * RUN] = answer;
            }
        }
        Ok(())
    })?;
    Ok(out)
}

fn part(at: usize, count: usize) -> std::ops::Range<usize> {
    at * RUN..((at + 1) * RUN).min(count)
}

fn around(points: &[DVec3]) -> Aabb {
    Aabb::around(points.iter().copied().filter(|p| p.is_finite()))
}

/// By piece and run: the part of the run that belongs to the piece.
fn pieces(runs: &[Vec<Place>], count: usize) -> Vec<Vec<std::ops::Range<usize>>> {
    let size = (count / PIECES).clamp(LEAST, MOST);
    // A few places of each run tell where to cut; where many points have one place their indices do.
    let stride = size / 8;
    let mut known: Vec<Place> = runs.iter().flat_map(|run| run.iter().skip(stride / 2).step_by(stride).copied()).collect();
    known.sort_unstable();
    let cuts = known.into_iter().skip(8).step_by(8).collect::<Vec<_>>();
    let mut starts = vec![0; runs.len()];
    let mut out = Vec::with_capacity(cuts.len() + 1);
    for cut in cuts.into_iter().map(Some).chain([None]) {
        let parts = runs.iter().zip(&mut starts).map(|(run, start)| {
            let end = cut.map_or(run.len(), |cut| *start + run[*start..].partition_point(|&place| place < cut));
            std::mem::replace(start, end)..end
        });
        out.push(parts.collect());
    }
    out
}

/// A Morton curve through a box.
pub(crate) struct Curve {
    origin: DVec3,
    scale: DVec3,
}

impl Curve {
    pub fn over(extent: &Aabb) -> Self {
        let cells = f64::from(1u32 << BITS);
        let scale = extent.size().max(DVec3::splat(f64::MIN_POSITIVE)).recip() * (cells * (1.0 - 1e-9));
        Self { origin: extent.min, scale }
    }

    /// Places of points, in their order.
    pub fn places(&self, points: &[DVec3]) -> Vec<u32> {
        let mut out = vec![0; points.len()];
        places(self, points, &mut out);
        out
    }
}

multiversion!(fn places(curve: &Curve, points: &[DVec3], out: &mut [u32]) = places_body);

/// Points placed side by side.
const LANES: usize = 16;

#[inline(always)]
fn places_body<F: Fuse>(curve: &Curve, points: &[DVec3], out: &mut [u32]) {
    let most = f64::from((1u32 << BITS) - 1);
    // What is added to it is rounded to a whole number, which its lowest bits hold.
    let whole = (1u64 << 52) as f64;
    for (points, out) in points.chunks(LANES).zip(out.chunks_mut(LANES)) {
        let mut cell = [[0u32; LANES]; 3];
        for (lane, p) in points.iter().enumerate() {
            let q = (*p - curve.origin) * curve.scale;
            for axis in 0..3 {
                let x = if q[axis] > 0.0 { q[axis] } else { 0.0 };
                cell[axis][lane] = ((if x < most { x } else { most }) + whole).to_bits() as u32;
            }
        }
        let mut place = [0u32; LANES];
        for lane in 0..LANES {
            let spread = |axis: usize| spread_bits(cell[axis][lane] & ((1 << BITS) - 1));
            place[lane] = spread(0) | spread(1) << 1 | spread(2) << 2;
        }
        out.copy_from_slice(&place[..points.len()]);
    }
}

/// Sorts by key; equal keys keep their order.
pub(crate) fn sort(places: &mut Vec<Place>) {
    // Counting pays for its tables only where there are many.
    if places.len() < 256 {
        return places.sort_unstable();
    }
    let first = places[0].0;
    let differing = places.iter().fold(0, |bits, (key, _)| bits | (key ^ first));
    let mut other = vec![(0, 0); places.len()];
    for shift in [0, 10, 20, 30] {
        if differing >> shift & 1023 != 0 {
            pass(places, &mut other, shift);
            std::mem::swap(places, &mut other);
        }
    }
}

/// One stable counting pass over ten bits.
fn pass(from: &[Place], to: &mut [Place], shift: u32) {
    let mut starts = [0usize; 1025];
    for (key, _) in from {
        starts[((key >> shift) & 1023) as usize + 1] += 1;
    }
    for i in 1..starts.len() {
        starts[i] += starts[i - 1];
    }
    for place in from {
        let slot = &mut starts[((place.0 >> shift) & 1023) as usize];
        to[*slot] = *place;
        *slot += 1;
    }
}

/// Puts two zero bits after each of the ten lowest bits.
fn spread_bits(x: u32) -> u32 {
    let x = (x | x << 16) & 0x0300_00ff;
    let x = (x | x << 8) & 0x0300_f00f;
    let x = (x | x << 4) & 0x030c_30c3;
    (x | x << 2) & 0x0924_9249
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laws::Random;

    /// Scattered, on a line, all in one place, with one far away, and a few only.
    fn clouds() -> Vec<Vec<DVec3>> {
        let mut random = Random::new(3);
        let mut cloud =
            |count: usize, make: &mut dyn FnMut(&mut Random) -> DVec3| (0..count).map(|_| make(&mut random)).collect::<Vec<_>>();
        let mut far = cloud(70_000, &mut |r| r.direction());
        far[69_000] = DVec3::splat(1e9);
        vec![
            Vec::new(),
            cloud(1, &mut |r| r.direction()),
            cloud(700, &mut |r| r.direction()),
            cloud(150_000, &mut |r| r.direction() * r.unit()),
            cloud(70_000, &mut |r| DVec3::X * r.unit()),
            cloud(70_000, &mut |_| DVec3::ONE),
            far,
        ]
    }

    #[test]
    fn every_point_is_answered_once_and_in_its_place() {
        for points in clouds() {
            for threads in [1, 2, 7] {
                let pieces = std::sync::Mutex::new(Vec::new());
                let answer = |points: &[DVec3], keys: &[u32]| {
                    assert!(points.len() == keys.len() && keys.is_sorted());
                    pieces.lock().expect("no panic").push(points.len());
                    points.iter().map(|p| p.to_array().map(f64::to_bits)).collect::<Vec<_>>()
                };
                let out = along_curve("", &points, &Run::with_threads(threads), answer).expect("answers");
                assert_eq!(out, points.iter().map(|p| p.to_array().map(f64::to_bits)).collect::<Vec<_>>());
                let pieces = pieces.into_inner().expect("no panic");
                assert_eq!(pieces.iter().sum::<usize>(), points.len());
                // No place on the curve makes a piece too large for the others.
                assert!(pieces.iter().all(|&n| n <= 3 * LEAST.max(points.len() / PIECES)), "{pieces:?}");
            }
        }
    }

    #[test]
    fn neighbours_follow_each_other() {
        let mut random = Random::new(5);
        let points: Vec<DVec3> = (0..100_000).map(|_| DVec3::new(random.unit(), random.unit(), random.unit())).collect();
        let steps = along_curve("", &points, &Run::with_threads(2), |points, _| {
            let step = |i: usize| if i == 0 { 0.0 } else { (points[i] - points[i - 1]).length() };
            (0..points.len()).map(step).collect::<Vec<_>>()
        });
        let mean = steps.expect("answers").iter().sum::<f64>() / points.len() as f64;
        // Of points in any order it is 0.66.
        assert!(mean < 0.05, "{mean}");
    }
}
