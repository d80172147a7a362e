//! The control points of a patch as plain numbers, laid out for sums along u.

use super::bezier::Bezier;
use crate::geom::DVec3;

/// Of each of four along u, the coordinates of four along v.
#[derive(Clone, Copy, Debug)]
pub(super) struct Net([[f64; 12]; 4]);

/// A point of a patch and its derivatives there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub at: DVec3,
    pub u: DVec3,
    pub v: DVec3,
    pub uu: DVec3,
    pub uv: DVec3,
    pub vv: DVec3,
}

/// The cubic Bernstein polynomials at t, their first and their second derivatives.
#[inline(always)]
pub(super) fn bernstein(t: f64) -> [[f64; 4]; 3] {
    let s = 1.0 - t;
    [
        [s * s * s, 3.0 * t * s * s, 3.0 * t * t * s, t * t * t],
        [-3.0 * s * s, 3.0 * s * (s - 2.0 * t), 3.0 * t * (2.0 * s - t), 3.0 * t * t],
        [6.0 * s, 6.0 * (t - 2.0 * s), 6.0 * (s - 2.0 * t), 6.0 * t],
    ]
}

impl Net {
    pub fn new(bezier: &Bezier) -> Self {
        Self(bezier.0.map(|row| std::array::from_fn(|k| row[k / 3][k % 3])))
    }

    #[inline(always)]
    pub fn derivatives(&self, [u, v]: [f64; 2]) -> Point {
        let (a, b) = (bernstein(u), bernstein(v));
        // Sums along u of points, first and second derivatives; loops that become vectors.
        let mut rows = [[0.0; 12]; 3];
        for (row, a) in rows.iter_mut().zip(&a) {
            for k in 0..12 {
                row[k] = (self.0[0][k] * a[0] + self.0[1][k] * a[1]) + (self.0[2][k] * a[2] + self.0[3][k] * a[3]);
            }
        }
        Point {
            at: along(&rows[0], &b[0]),
            u: along(&rows[1], &b[0]),
            v: along(&rows[0], &b[1]),
            uu: along(&rows[2], &b[0]),
            uv: along(&rows[1], &b[1]),
            vv: along(&rows[0], &b[2]),
        }
    }
}

/// The sum along v.
#[inline(always)]
fn along(row: &[f64; 12], weights: &[f64; 4]) -> DVec3 {
    let mut sum = [0.0; 3];
    for axis in 0..3 {
        sum[axis] = (row[axis] * weights[0] + row[axis + 3] * weights[1]) + (row[axis + 6] * weights[2] + row[axis + 9] * weights[3]);
    }
    DVec3::from_array(sum)
}
