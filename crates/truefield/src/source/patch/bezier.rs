//! One bicubic Bezier patch.

use crate::geom::{Aabb, DVec3};

/// A bicubic patch: control points `[i][j]`, i along u and j along v.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bezier(pub [[DVec3; 4]; 4]);

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
fn bernstein(t: f64) -> [[f64; 4]; 3] {
    let s = 1.0 - t;
    [
        [s * s * s, 3.0 * t * s * s, 3.0 * t * t * s, t * t * t],
        [-3.0 * s * s, 3.0 * s * (s - 2.0 * t), 3.0 * t * (2.0 * s - t), 3.0 * t * t],
        [6.0 * s, 6.0 * (t - 2.0 * s), 6.0 * (s - 2.0 * t), 6.0 * t],
    ]
}

impl Bezier {
    /// The point at (u, v).
    ///
    /// Along an edge that two patches share in opposite directions both give the same bits: the weights are symmetric, and
    /// so is the order of the sum.
    pub fn point(&self, u: f64, v: f64) -> DVec3 {
        let (a, b) = (bernstein(u)[0], bernstein(v)[0]);
        let sum = |weights: &[f64; 4], points: [DVec3; 4]| {
            (points[0] * weights[0] + points[3] * weights[3]) + (points[1] * weights[1] + points[2] * weights[2])
        };
        sum(&a, self.0.map(|row| sum(&b, row)))
    }

    pub(super) fn derivatives(&self, u: f64, v: f64) -> Point {
        let (a, b) = (bernstein(u), bernstein(v));
        let sum = |weights: &[f64; 4], points: &[DVec3; 4]| {
            points[0] * weights[0] + points[1] * weights[1] + points[2] * weights[2] + points[3] * weights[3]
        };
        let rows = [0, 1, 2].map(|order| self.0.map(|row| sum(&b[order], &row)));
        Point {
            at: sum(&a[0], &rows[0]),
            u: sum(&a[1], &rows[0]),
            v: sum(&a[0], &rows[1]),
            uu: sum(&a[2], &rows[0]),
            uv: sum(&a[1], &rows[1]),
            vv: sum(&a[0], &rows[2]),
        }
    }

    /// The halves below and above the middle of u (axis 0) or v (axis 1).
    pub(super) fn halves(&self, axis: usize) -> [Self; 2] {
        let turned = if axis == 0 { self.turned() } else { *self };
        let mut halves = [turned; 2];
        for row in 0..4 {
            let [a, b, c, d] = turned.0[row];
            let (ab, bc, cd) = ((a + b) * 0.5, (b + c) * 0.5, (c + d) * 0.5);
            let (abc, bcd) = ((ab + bc) * 0.5, (bc + cd) * 0.5);
            let middle = (abc + bcd) * 0.5;
            halves[0].0[row] = [a, ab, abc, middle];
            halves[1].0[row] = [middle, bcd, cd, d];
        }
        if axis == 0 { halves.map(|half| half.turned()) } else { halves }
    }

    /// With u and v changed over.
    fn turned(&self) -> Self {
        Self(std::array::from_fn(|i| std::array::from_fn(|j| self.0[j][i])))
    }

    /// All control points.
    pub(super) fn controls(&self) -> impl Iterator<Item = DVec3> + Clone + '_ {
        self.0.iter().flatten().copied()
    }

    /// Boxes that hold the points, and the derivatives along u, v, u u, u v and v v: each is a patch of differences, and lies
    /// in the hull of its control points.
    pub(super) fn hulls(&self) -> [Aabb; 6] {
        let p = &self.0;
        let along = |i: usize, j: usize, du: usize, dv: usize| -> DVec3 {
            match (du, dv) {
                (0, 0) => p[i][j],
                (1, 0) => (p[i + 1][j] - p[i][j]) * 3.0,
                (0, 1) => (p[i][j + 1] - p[i][j]) * 3.0,
                (2, 0) => (p[i + 2][j] - p[i + 1][j] * 2.0 + p[i][j]) * 6.0,
                (0, 2) => (p[i][j + 2] - p[i][j + 1] * 2.0 + p[i][j]) * 6.0,
                _ => (p[i + 1][j + 1] - p[i + 1][j] - p[i][j + 1] + p[i][j]) * 9.0,
            }
        };
        let size = self.controls().fold(0.0_f64, |size, p| size.max(p.abs().max_element()));
        [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)].map(|(du, dv)| {
            let (rows, columns) = (4 - du, 4 - dv);
            let points = (0..rows * columns).map(|k| along(k / columns, k % columns, du, dv));
            // Halving and differences round.
            Aabb::around(points).grow(64.0 * f64::EPSILON * size)
        })
    }
}
