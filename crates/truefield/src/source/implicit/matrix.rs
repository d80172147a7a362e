//! Symmetric three by three matrices, and proofs about all of an interval of them.

use super::jet::PAIRS;
use super::number::Number;
use crate::geom::{DVec3, Interval};

/// The middle of an interval and half its width.
pub(super) fn middle(of: Interval) -> (f64, f64) {
    let middle = 0.5 * of.lower + 0.5 * of.upper;
    (middle, (of.upper - middle).max(middle - of.lower))
}

/// The middle of a box of vectors, and no less than how far any is from it.
pub(super) fn middle_of(vector: &[Interval; 3]) -> (DVec3, f64) {
    let parts = vector.map(middle);
    let radius = parts.iter().map(|(_, r)| r * r).sum::<f64>().sqrt();
    (DVec3::from_array(parts.map(|(m, _)| m)), radius * (1.0 + 1e-15))
}

/// The product with a vector, of a matrix in the order of [`PAIRS`].
pub(super) fn times(matrix: &[f64; 6], v: DVec3) -> DVec3 {
    let [xx, yy, zz, xy, xz, yz] = *matrix;
    DVec3::new(xx * v.x + xy * v.y + xz * v.z, xy * v.x + yy * v.y + yz * v.z, xz * v.x + yz * v.y + zz * v.z)
}

/// Contains every eigenvalue of every matrix.
pub(super) fn eigenvalues(matrix: &[Interval; 6]) -> Interval {
    let parts = matrix.map(middle);
    // No eigenvalue moves by more than the norm of what is added.
    let spread = (0..6).map(|k| if k < 3 { parts[k].1.powi(2) } else { 2.0 * parts[k].1.powi(2) }).sum::<f64>().sqrt();
    if !spread.is_finite() {
        return Interval::ALL;
    }
    // What is left beside the diagonal is counted, too: it need not be smaller than what is.
    let (diagonal, off) = diagonal(parts.map(|(m, _)| m), 1e-3 * spread);
    let least = diagonal[0].min(diagonal[1]).min(diagonal[2]);
    let greatest = diagonal[0].max(diagonal[1]).max(diagonal[2]);
    Interval { lower: least - off - spread, upper: greatest + off + spread }.widen(1e-13 * (least.abs().max(greatest.abs()) + spread))
}

/// The diagonal after rotations that make all else about `enough`, and no less than the norm of all else.
fn diagonal(matrix: [f64; 6], enough: f64) -> ([f64; 3], f64) {
    let mut m = [[0.0; 3]; 3];
    for (k, (i, j)) in PAIRS.into_iter().enumerate() {
        (m[i][j], m[j][i]) = (matrix[k], matrix[k]);
    }
    let size = matrix.iter().fold(0.0_f64, |size, entry| size.max(entry.abs()));
    let enough = enough.max(1e-12 * size);
    for _ in 0..6 {
        if m[0][1].abs() + m[0][2].abs() + m[1][2].abs() <= enough {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if m[p][q] == 0.0 {
                continue;
            }
            let theta = (m[q][q] - m[p][p]) / (2.0 * m[p][q]);
            let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let c = 1.0 / (t * t + 1.0).sqrt();
            let s = t * c;
            for k in 0..3 {
                (m[k][p], m[k][q]) = (c * m[k][p] - s * m[k][q], s * m[k][p] + c * m[k][q]);
            }
            for k in 0..3 {
                (m[p][k], m[q][k]) = (c * m[p][k] - s * m[q][k], s * m[p][k] + c * m[q][k]);
            }
        }
    }
    let off = (m[0][1].powi(2) + m[0][2].powi(2) + m[1][2].powi(2)) * 2.0;
    ([m[0][0], m[1][1], m[2][2]], off.sqrt())
}

/// The least of `slope` u + `least` u^2 for u from `low` to `high`.
pub(super) fn fall(slope: f64, least: f64, low: f64, high: f64) -> f64 {
    let at = |u: f64| (slope + least * u) * u;
    let ends = at(low).min(at(high));
    let middle = -slope / (2.0 * least);
    if least > 0.0 && middle > low && middle < high { at(middle).min(ends) } else { ends }
}

/// The identity, plus `scale` times `matrix`, plus `weight` times (`gradient gradient^T` + `value` `matrix`).
pub(super) fn penalised(matrix: &[Interval; 6], scale: f64, weight: f64, gradient: &[Interval; 3], value: Interval) -> [Interval; 6] {
    let factor = if weight == 0.0 { Interval::exact(scale) } else { Interval::exact(scale).add(Interval::exact(weight).mul(value)) };
    std::array::from_fn(|k| {
        let (i, j) = PAIRS[k];
        let mut entry = matrix[k].mul(factor);
        if weight != 0.0 {
            let both = if i == j { gradient[i].square() } else { gradient[i].mul(gradient[j]) };
            entry = entry.add(both.mul(Interval::exact(weight)));
        }
        if i == j { entry.add(Interval::exact(1.0)) } else { entry }
    })
}
