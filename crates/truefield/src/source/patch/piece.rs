//! A part of a patch by its own control points.

use super::bezier::Bezier;
use super::oriented::Oriented;
use crate::geom::{Aabb, DVec3};

/// A part of a patch over a rectangle of (u, v), with boxes around its points and derivatives.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    bezier: Bezier,
    hulls: [Aabb; 6],
}

impl Piece {
    pub(super) fn new(bezier: Bezier) -> Self {
        Self { bezier, hulls: bezier.hulls() }
    }

    pub(super) fn extent(&self) -> &Aabb {
        &self.hulls[0]
    }

    pub(super) fn bezier(&self) -> &Bezier {
        &self.bezier
    }

    /// Boxes of its points and derivatives, see [`Bezier::hulls`].
    pub(super) fn hulls(&self) -> &[Aabb; 6] {
        &self.hulls
    }

    /// Whether the edges across u, the lower and the upper, and those across v are one point each.
    pub(super) fn point_edges(&self) -> [[bool; 2]; 2] {
        let at = |i: usize, j: usize| self.bezier.0[i][j];
        let is_point = |edge: [DVec3; 4]| edge.iter().all(|p| *p == edge[0]);
        [[0, 3].map(|i| is_point([0, 1, 2, 3].map(|j| at(i, j)))), [0, 3].map(|j| is_point([0, 1, 2, 3].map(|i| at(i, j))))]
    }

    /// A box along it.
    pub(super) fn oriented(&self) -> Oriented {
        let middle = self.bezier.derivatives(0.5, 0.5);
        Oriented::around(self.bezier.controls(), [middle.u, middle.v])
    }

    /// The direction in which it is longer.
    pub(super) fn longer(&self) -> usize {
        let length = |hull: &Aabb| hull.min.abs().max(hull.max.abs()).length_squared();
        usize::from(length(&self.hulls[2]) > length(&self.hulls[1]))
    }

    /// Cut across the direction in which it is longer.
    pub(super) fn halves(&self) -> [Self; 2] {
        self.bezier.halves(self.longer()).map(Self::new)
    }
}
