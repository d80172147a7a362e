//! Which side of a mesh a point is on.

use crate::error::Result;
use crate::geom::{DVec3, FacetPoint};
use crate::mesh::TriangleMesh;
use crate::run::Run;

/// How the user wants sides to be decided.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SignChoice {
    /// The quickest rule that is proven for the mesh.
    #[default]
    Auto,
    /// Angle-weighted pseudonormals.
    Pseudonormal,
    /// Generalised winding number.
    Winding,
    /// No sides: distances are positive everywhere.
    Unsigned,
}

/// The rule that decides sides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SignKind {
    /// Angle-weighted pseudonormals.
    Pseudonormal,
    /// Generalised winding number.
    Winding,
    /// No sides.
    Unsigned,
}

/// The rule in force and why.
#[derive(Clone, Debug)]
pub struct SignRule {
    /// Which rule.
    pub kind: SignKind,
    /// Why, in a sentence.
    pub reason: String,
}

/// The side of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Inside: the distance is negative.
    Inside,
    /// Outside: the distance is positive.
    Outside,
    /// Not decidable; the better guess is inside.
    PerhapsInside,
    /// Not decidable; the better guess is outside.
    PerhapsOutside,
}

impl Side {
    /// Whether the side is decided.
    pub fn is_certain(self) -> bool {
        matches!(self, Self::Inside | Self::Outside)
    }

    /// -1 inside, 1 outside; the better guess where undecided.
    pub fn sign(self) -> f64 {
        match self {
            Self::Inside | Self::PerhapsInside => -1.0,
            Self::Outside | Self::PerhapsOutside => 1.0,
        }
    }
}

/// Decides sides for one mesh.
#[derive(Clone, Debug)]
pub(crate) struct Signs {
    rule: SignRule,
}

impl Signs {
    pub fn new(_mesh: &TriangleMesh, choice: SignChoice, _run: &Run<'_>) -> Result<Self> {
        let kind = if choice == SignChoice::Unsigned { SignKind::Unsigned } else { SignKind::Winding };
        Ok(Self { rule: SignRule { kind, reason: "winding numbers hold for every mesh".into() } })
    }

    pub fn rule(&self) -> &SignRule {
        &self.rule
    }

    /// The side of `p`, whose nearest point is `nearest` on `triangle`.
    pub fn side(&self, mesh: &TriangleMesh, p: DVec3, _nearest: &FacetPoint, _triangle: u32) -> Side {
        if self.rule.kind == SignKind::Unsigned {
            return Side::Outside;
        }
        let mut sum = 0.0;
        for t in 0..mesh.triangles().len() as u32 {
            let [a, b, c] = mesh.corners(t).map(|v| v - p);
            let (la, lb, lc) = (a.length(), b.length(), c.length());
            sum += a.dot(b.cross(c)).atan2(la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
        }
        if sum.abs() > std::f64::consts::PI { Side::Inside } else { Side::Outside }
    }

    /// The side of every point of the ball around `p`, which does not touch the surface, if they all have one.
    pub fn side_of_ball(&self, mesh: &TriangleMesh, p: DVec3, nearest: &FacetPoint, triangle: u32, _radius: f64) -> Option<Side> {
        Some(self.side(mesh, p, nearest, triangle)).filter(|side| side.is_certain())
    }

    /// Whether the side can change at the surface only.
    pub fn changes_at_surface_only(&self) -> bool {
        true
    }
}
