//! One bicubic Bezier patch.

use super::net::{Net, Point, bernstein};
use crate::geom::{Aabb, DVec3};

/// A bicubic patch: control points `[i][j]`, i along u and j along v.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bezier(pub [[DVec3; 4]; 4]);

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
        Net::new(self).derivatives([u, v])
    }

    /// What lies over the rectangle of this lower corner and size.
    pub(super) fn part(&self, low: [f64; 2], size: [f64; 2]) -> Self {
        let along = |rows: &Self, from: f64, to: f64| {
            Self(rows.0.map(|[a, b, c, d]| {
                let to_three = |[x, y, z]: [f64; 3]| {
                    let (ab, bc, cd) = (a.lerp(b, x), b.lerp(c, x), c.lerp(d, x));
                    let (abc, bcd) = (ab.lerp(bc, y), bc.lerp(cd, y));
                    abc.lerp(bcd, z)
                };
                [[from, from, from], [from, from, to], [from, to, to], [to, to, to]].map(to_three)
            }))
        };
        let across = along(&self.turned(), low[0], low[0] + size[0]).turned();
        along(&across, low[1], low[1] + size[1])
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
            // Differences round, and take each of some twenty halvings' rounding times 24.
            Aabb::around(points).grow(1024.0 * f64::EPSILON * size)
        })
    }
}
