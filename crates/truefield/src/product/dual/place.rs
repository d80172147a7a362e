//! Where the vertex of a piece of surface lies: where the planes at its crossings come nearest to meeting.

use crate::field::adaptive::Cell;
use crate::geom::{Aabb, DVec3};

/// Normals that all lie this near to their mean (cosine) belong to one smooth piece, which is followed by Newton's step.
const SMOOTH: f64 = 0.87;

/// Normals that all lie this near to their mean belong to a plane.
const FLAT: f64 = 0.9995;

/// Directions in which the planes say less than this part of what they say in the best are left to the mean of the points.
const NOTHING: f64 = 0.02;

/// Rounds that move a vertex along the faces of its cell.
const ROUNDS: usize = 16;

/// What becomes of a vertex where the surface is smooth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Smooth {
    /// It is moved onto where the field is at the distance.
    Followed,
    /// It stays where the planes say: they know better than the field, or are the end of the domain.
    Left,
}

/// The vertex of crossings with their normals, in their cell (Ju et al. 2002, equation 1).
pub(super) fn vertex(points: &[(DVec3, DVec3)], cell: &Cell<'_>, extent: &Aabb, distance: f64, smooth: Smooth) -> DVec3 {
    let share = 1.0 / points.len() as f64;
    let mean = points.iter().map(|&(p, _)| p - extent.min).sum::<DVec3>() * share + extent.min;
    let normal = points.iter().map(|&(_, n)| n).sum::<DVec3>().normalize_or_zero();
    let spread = points.iter().map(|&(_, n)| n.dot(normal)).fold(f64::INFINITY, f64::min);
    if spread > FLAT {
        let along = points.iter().map(|&(p, n)| n.dot(p - mean)).sum::<f64>() * share;
        let flat = (mean + normal * along).clamp(extent.min, extent.max);
        return if smooth == Smooth::Followed { onto(cell, flat, distance, extent) } else { flat };
    }
    // Least squares about the mean.
    let (mut a, mut b) = ([[0.0; 3]; 3], [0.0; 3]);
    for &(p, n) in points {
        let along = n.dot(p - mean);
        for i in 0..3 {
            for j in 0..3 {
                a[i][j] += n[i] * n[j];
            }
            b[i] += n[i] * along;
        }
    }
    let moved = solve(a, DVec3::from_array(b));
    let (low, high) = (extent.min - mean, extent.max - mean);
    let moved = if moved.cmpge(low).all() && moved.cmple(high).all() { moved } else { inside(a, b, moved.clamp(low, high), low, high) };
    let at = (mean + moved).clamp(extent.min, extent.max);
    if spread > SMOOTH && smooth == Smooth::Followed { onto(cell, at, distance, extent) } else { at }
}

/// One step of Newton's towards the distance, in the cell.
fn onto(cell: &Cell<'_>, p: DVec3, distance: f64, extent: &Aabb) -> DVec3 {
    let gradient = cell.gradient(p);
    let square = gradient.length_squared();
    // A cell in which the distance hardly grows tells no way.
    if !(square > 0.25) {
        return p;
    }
    (p - gradient * ((cell.value(p) - distance) / square)).clamp(extent.min, extent.max)
}

/// The shortest of the best solutions of a x = b, without the directions about which `a` says next to nothing.
fn solve(a: [[f64; 3]; 3], b: DVec3) -> DVec3 {
    let (values, vectors) = eigen(a);
    let least = NOTHING * values.iter().copied().fold(0.0, f64::max);
    let mut x = DVec3::ZERO;
    for (value, vector) in values.into_iter().zip(vectors) {
        if value > least {
            x += vector * (vector.dot(b) / value);
        }
    }
    x
}

/// Eigenvalues and unit eigenvectors of a symmetric matrix, by Jacobi's rotations.
fn eigen(mut a: [[f64; 3]; 3]) -> ([f64; 3], [DVec3; 3]) {
    let mut vectors = [DVec3::X, DVec3::Y, DVec3::Z];
    for _ in 0..6 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q].abs() < 1e-14 * (a[p][p] + a[q][q]) {
                continue;
            }
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let c = 1.0 / (t * t + 1.0).sqrt();
            let s = t * c;
            for k in 0..3 {
                (a[k][p], a[k][q]) = (c * a[k][p] - s * a[k][q], s * a[k][p] + c * a[k][q]);
            }
            for k in 0..3 {
                (a[p][k], a[q][k]) = (c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]);
            }
            (vectors[p], vectors[q]) = (vectors[p] * c - vectors[q] * s, vectors[p] * s + vectors[q] * c);
        }
    }
    ([a[0][0], a[1][1], a[2][2]], vectors)
}

/// The best point of a box, one coordinate after the other; a little is given for staying near the middle.
fn inside(a: [[f64; 3]; 3], b: [f64; 3], from: DVec3, low: DVec3, high: DVec3) -> DVec3 {
    let little = 1e-7 * (a[0][0] + a[1][1] + a[2][2]);
    let mut x = from;
    for _ in 0..ROUNDS {
        for i in 0..3 {
            let others = (0..3).filter(|&j| j != i).map(|j| a[i][j] * x[j]).sum::<f64>();
            x[i] = ((b[i] - others) / (a[i][i] + little)).clamp(low[i], high[i]);
        }
    }
    x
}
