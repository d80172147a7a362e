//! The laws of [`Distance`].

use super::Random;
use super::broken::{Broken, Law, hold};
use crate::distance::Distance;
use crate::geom::{Aabb, DVec3, Interval};

/// Cells tried around every point by the law of ranges.
const CELLS: usize = 2;

/// Points tried in every cell, corners not counted.
const POINTS: usize = 4;

/// All laws of [`Distance`] against a judge that knows the true signed distance.
///
/// `allowance` is the rounding that is forgiven, a length. Where the side jumps away from the
/// surface (open meshes), signed distances are not continuous: check the laws one by one, all but
/// [`check_lipschitz`].
pub fn check_distance<S: Distance + ?Sized>(
    source: &S,
    judge: impl Fn(DVec3) -> f64,
    points: &[DVec3],
    allowance: f64,
) -> Result<(), Broken> {
    check_truth(source, &judge, points, allowance)?;
    check_many(source, points)?;
    check_range(source, &judge, points, allowance)?;
    check_lipschitz(source, points, allowance)?;
    check_extent(source, &judge, points, allowance)
}

/// `at` contains the truth: one number where exact, both signs of it where the side is unknown.
pub fn check_truth<S: Distance + ?Sized>(source: &S, judge: impl Fn(DVec3) -> f64, points: &[DVec3], allowance: f64) -> Result<(), Broken> {
    for &p in points {
        let (found, truth) = (source.at(p), judge(p));
        hold(Law::Truth, p, encloses(found, truth, allowance), || format!("{found:?} does not contain {truth:?}"))?;
    }
    Ok(())
}

/// `at_many` gives the bits of `at`, for slices of every length.
pub fn check_many<S: Distance + ?Sized>(source: &S, points: &[DVec3]) -> Result<(), Broken> {
    let bits = |i: Interval| (i.lower.to_bits(), i.upper.to_bits());
    let mut rest = points;
    let mut length = 1;
    while !rest.is_empty() {
        let (part, after) = rest.split_at(length.min(rest.len()));
        let mut many = vec![Interval::exact(f64::NAN); part.len()];
        source.at_many(part, &mut many);
        for (&p, &many) in part.iter().zip(&many) {
            let one = source.at(p);
            hold(Law::Many, p, bits(one) == bits(many), || format!("at_many says {many:?} and at says {one:?}"))?;
        }
        rest = after;
        length = length * 2 + 1;
    }
    Ok(())
}

/// `over` contains the truth everywhere in a cell: cells of all sizes around the points, judged at
/// their corners, their centre and points between; also cells without thickness and single points.
pub fn check_range<S: Distance + ?Sized>(source: &S, judge: impl Fn(DVec3) -> f64, points: &[DVec3], allowance: f64) -> Result<(), Broken> {
    let mut random = Random::new(1);
    let size = Aabb::around(points.iter().copied()).size().max_element().max(f64::MIN_POSITIVE);
    for &p in points {
        for _ in 0..CELLS {
            let edge = random.length(1e-6, 1.0) * size;
            let flat = |random: &mut Random| if random.below(8) == 0 { 0.0 } else { edge * random.unit() };
            let (low, high) =
                (DVec3::from_array([(); 3].map(|()| flat(&mut random))), DVec3::from_array([(); 3].map(|()| flat(&mut random))));
            let cell = Aabb::new(p - low, p + high);
            let range = source.over(&cell);
            let inside = (0..8).map(|corner| cell.corner(corner)).chain([cell.center(), p]);
            for q in inside.chain((0..POINTS).map(|_| random.within(&cell)).collect::<Vec<_>>()) {
                let truth = judge(q);
                hold(Law::Range, q, encloses(range, truth, allowance), || format!("{range:?} over {cell:?} does not contain {truth:?}"))?;
            }
        }
    }
    Ok(())
}

/// No two intervals are farther apart than their points. Needs no judge.
pub fn check_lipschitz<S: Distance + ?Sized>(source: &S, points: &[DVec3], allowance: f64) -> Result<(), Broken> {
    let mut random = Random::new(2);
    let size = Aabb::around(points.iter().copied()).size().max_element().max(f64::MIN_POSITIVE);
    for (i, &p) in points.iter().enumerate() {
        let near = p + random.direction() * (size * random.length(1e-9, 1.0));
        for q in [near, points[(i + 1) % points.len()]] {
            let (first, second, apart) = (source.at(p), source.at(q), (p - q).length() + allowance);
            let holds = first.lower <= second.upper + apart && second.lower <= first.upper + apart;
            hold(Law::Lipschitz, p, holds, || format!("{first:?} here and {second:?} at {q:?}, only {apart:?} away"))?;
        }
    }
    Ok(())
}

/// The surface lies in the extent: outside it no distance is shorter than the way to the extent.
pub fn check_extent<S: Distance + ?Sized>(
    source: &S,
    judge: impl Fn(DVec3) -> f64,
    points: &[DVec3],
    allowance: f64,
) -> Result<(), Broken> {
    let Some(extent) = source.extent() else { return Ok(()) };
    for &p in points {
        // From the point on out: both the point and its mirror images beyond the faces.
        let beyond = DVec3::from_array(std::array::from_fn(|axis| {
            if p[axis] < extent.center()[axis] {
                extent.min[axis].min(2.0 * extent.min[axis] - p[axis])
            } else {
                extent.max[axis].max(2.0 * extent.max[axis] - p[axis])
            }
        }));
        for q in [p, beyond] {
            let (way, truth) = (extent.distance_squared(q).sqrt(), judge(q));
            hold(Law::Extent, q, truth.abs() >= way - allowance, || format!("the surface is {truth:?} away and the extent {way:?}"))?;
        }
    }
    Ok(())
}

fn encloses(found: Interval, truth: f64, allowance: f64) -> bool {
    found.lower <= found.upper && found.lower - allowance <= truth && truth <= found.upper + allowance
}
