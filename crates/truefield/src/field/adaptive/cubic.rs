//! Tricubic interpolation of 64 samples at thirds of a cell's edges.

use super::page::Samples;
use crate::geom::DVec3;

/// Samples along an edge.
const N: usize = 4;

/// The cubics that are 1 at one third and 0 at the others, at `t` from 0 to 1.
pub(crate) fn weights(t: f64) -> [f64; N] {
    let [a, b, c, d] = [t, 3.0 * t - 1.0, 3.0 * t - 2.0, t - 1.0];
    [-0.5 * b * c * d, 4.5 * a * c * d, -4.5 * a * b * d, 0.5 * a * b * c]
}

/// Their slopes.
fn slopes(t: f64) -> [f64; N] {
    let square = t * t;
    [-5.5 + 18.0 * t - 13.5 * square, 9.0 - 45.0 * t + 40.5 * square, -4.5 + 36.0 * t - 40.5 * square, 1.0 - 9.0 * t + 13.5 * square]
}

fn sum(samples: &Samples, x: [f64; N], y: [f64; N], z: [f64; N]) -> f64 {
    let mut total = 0.0;
    for i in 0..N {
        for j in 0..N {
            let row = &samples[(i * N + j) * N..][..N];
            let along = (0..N).map(|k| f64::from(row[k]) * z[k]).sum::<f64>();
            total += x[i] * y[j] * along;
        }
    }
    total
}

/// The value at `at`, whose coordinates run from 0 to 1.
pub(crate) fn value(samples: &Samples, at: DVec3) -> f64 {
    sum(samples, weights(at.x), weights(at.y), weights(at.z))
}

/// Slopes along the three axes, per cell.
pub(crate) fn gradient(samples: &Samples, at: DVec3) -> DVec3 {
    let [x, y, z] = [at.x, at.y, at.z].map(weights);
    DVec3::new(sum(samples, slopes(at.x), y, z), sum(samples, x, slopes(at.y), z), sum(samples, x, y, slopes(at.z)))
}

/// Control points of the Bernstein form: the values lie in their hull, as do those of slopes in the hull of differences.
fn control(samples: &Samples) -> [f64; 64] {
    let mut c = samples.map(f64::from);
    for stride in [1, N, N * N] {
        for first in (0..64).filter(|number| number / stride % N == 0) {
            let [a, b, d, e] = [0, 1, 2, 3].map(|step| c[first + step * stride]);
            c[first + stride] = (-5.0 * a + 18.0 * b - 9.0 * d + 2.0 * e) / 6.0;
            c[first + 2 * stride] = (2.0 * a - 9.0 * b + 18.0 * d - 5.0 * e) / 6.0;
        }
    }
    c
}

/// Least and largest control point: no value in the cell lies outside.
pub(crate) fn range(samples: &Samples) -> (f64, f64) {
    control(samples).iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &c| (low.min(c), high.max(c)))
}

/// Bounds of the absolute second derivatives along the three axes, per cell squared.
pub(crate) fn bends(samples: &Samples) -> DVec3 {
    let c = control(samples);
    let bend = |stride: usize| {
        let inner = (0..64).filter(|number| matches!(number / stride % N, 1 | 2));
        6.0 * inner.map(|at| (c[at - stride] - 2.0 * c[at] + c[at + stride]).abs()).fold(0.0, f64::max)
    };
    DVec3::new(bend(N * N), bend(N), bend(1))
}

/// No less than the slopes along the three axes, per cell.
pub(crate) fn steepest(samples: &Samples) -> DVec3 {
    let c = control(samples);
    let slope = |stride: usize| {
        3.0 * (0..64).filter(|n| !(n / stride).is_multiple_of(N)).map(|at| (c[at] - c[at - stride]).abs()).fold(0.0, f64::max)
    };
    DVec3::new(slope(N * N), slope(N), slope(1))
}

/// Where samples lie in a cell, coordinates from 0 to 1.
pub(crate) fn third(sample: usize) -> DVec3 {
    DVec3::new((sample / 16) as f64, (sample / 4 % 4) as f64, (sample % 4) as f64) / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cubic(p: DVec3) -> f64 {
        (p.x * p.x * p.x - 2.0 * p.x + 1.0) * (p.y * p.y + 0.5 * p.y * p.y * p.y) * (3.0 - p.z - p.z * p.z * p.z)
    }

    #[test]
    fn cubics_come_back_with_their_slopes_and_within_their_bounds() {
        let third = |n: usize| n as f64 / 3.0;
        let samples: Samples = std::array::from_fn(|n| cubic(DVec3::new(third(n / 16), third(n / 4 % 4), third(n % 4))) as f32);
        let (low, high) = range(&samples);
        let bends = bends(&samples);
        let step = 1e-4;
        for n in 0..1000 {
            let at = DVec3::new(f64::from(n % 10), f64::from(n / 10 % 10), f64::from(n / 100)) / 9.0;
            let found = value(&samples, at);
            assert!((found - cubic(at)).abs() < 1e-5, "{found} is not {} at {at}", cubic(at));
            assert!(low <= found + 1e-9 && found <= high + 1e-9);
            let slopes = gradient(&samples, at);
            assert!(slopes.abs().cmple(steepest(&samples) + 1e-9).all());
            for axis in 0..3 {
                let (mut before, mut after) = (at, at);
                (before[axis], after[axis]) = (at[axis] - step, at[axis] + step);
                let [before, after] = [before, after].map(|at| value(&samples, at));
                assert!(((after - before) / (2.0 * step) - slopes[axis]).abs() < 1e-5);
                assert!(((after - 2.0 * found + before) / (step * step)).abs() < bends[axis] + 1e-2);
            }
        }
    }
}
