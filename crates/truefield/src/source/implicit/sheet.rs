//! What interval arithmetic proves of the surface in a box.

use super::jet::Jet;
use super::matrix::{middle, middle_of};
use super::number::Number;
use super::tape::Tape;
use crate::geom::{Aabb, DVec3, Interval};

/// A sheet reaches beyond its box by this part of the box's size, so that one proof serves the neighbours.
const REACH: f64 = 0.5;

/// In a sheet, gradients differ from their middle by no more than this part of it.
const STEADY: f64 = 0.5;

/// The surface in a box and around it: one smooth sheet at most, nearly a plane.
#[derive(Clone, Debug)]
pub(super) struct Sheet {
    /// Where the following holds: the box, and some way beyond it within the domain.
    pub reach: Aabb,
    /// Contains the formula's values, gradients and second derivatives there.
    pub value: Interval,
    pub gradient: [Interval; 3],
    pub hessian: [Interval; 6],
    /// In the box, `normal . x` of the surface lies within `thickness` of `offset`. The normal is a unit vector.
    pub normal: DVec3,
    pub offset: f64,
    pub thickness: f64,
}

/// What a box has of the surface.
pub(super) enum Content {
    /// Nothing: the formula is positive (outside) or negative (inside) everywhere.
    Nothing(Side),
    /// One smooth sheet at most.
    Sheet(Box<Sheet>),
    /// It may have anything.
    Open,
}

/// Where a point is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    Inside,
    Outside,
}

impl Side {
    /// The side of a value, where it is certain.
    pub(super) fn of(value: Interval) -> Option<Self> {
        if value.upper < 0.0 {
            Some(Self::Inside)
        } else if value.lower > 0.0 {
            Some(Self::Outside)
        } else {
            None
        }
    }

    /// The other one.
    pub(super) fn other(self) -> Self {
        match self {
            Self::Inside => Self::Outside,
            Self::Outside => Self::Inside,
        }
    }

    /// -1 inside and 1 outside, like distances.
    pub(super) fn sign(self) -> f64 {
        match self {
            Self::Inside => -1.0,
            Self::Outside => 1.0,
        }
    }
}

impl Content {
    /// Looks at one box of the domain.
    pub(super) fn of(tape: &Tape, domain: &Aabb, cell: &Aabb) -> Self {
        if let Some(side) = Side::of(tape.over(cell)) {
            return Self::Nothing(side);
        }
        let (center, half) = (cell.center(), half(cell));
        let at = tape.jet_over::<0>(&Aabb::new(center, center));
        let slopes: Jet<Interval, 0> = tape.jet_over(cell);
        // The mean value theorem: f(x) = f(c) + (a gradient of the box) . (x - c).
        let mean = (0..3).fold(at.value, |sum, axis| sum.add(slopes.gradient[axis].mul(Interval::around(0.0, half[axis]))));
        if let Some(side) = Side::of(mean) {
            return Self::Nothing(side);
        }
        if !steady(&slopes.gradient) {
            return Self::Open;
        }
        let grown = Aabb::new(cell.min - cell.size() * REACH, cell.max + cell.size() * REACH);
        let reach = Aabb::new(grown.min.max(domain.min), grown.max.min(domain.max));
        let jet: Jet<Interval, 6> = tape.jet_over(&reach);
        if !steady(&jet.gradient) || jet.hessian.iter().any(|h| !h.width().is_finite()) {
            return Self::Open;
        }
        let sheet = Sheet::over(reach, jet).through(&at, center, half);
        let (value, steepness) = (middle(at.value).0, middle_of(&at.gradient).0.length());
        let across = sheet.normal.abs().dot(half);
        if (value / steepness).abs() > (across + sheet.thickness) * (1.0 + 1e-14) {
            return Self::Nothing(if value > 0.0 { Side::Outside } else { Side::Inside });
        }
        Self::Sheet(Box::new(sheet))
    }
}

impl Sheet {
    /// What the derivatives over `reach` say; there is no slab yet.
    fn over(reach: Aabb, jet: Jet<Interval, 6>) -> Self {
        let Jet { value, gradient, hessian } = jet;
        Self { reach, value, gradient, hessian, normal: DVec3::X, offset: 0.0, thickness: f64::INFINITY }
    }

    /// The surface in a box, whatever it is like; without a slab.
    pub(super) fn around(tape: &Tape, reach: Aabb) -> Self {
        Self::over(reach, tape.jet_over(&reach))
    }

    /// The same sheet in a part of its box, with a thinner slab.
    pub(super) fn part(&self, tape: &Tape, cell: &Aabb) -> Self {
        let (center, grown) = (cell.center(), cell.size() * REACH);
        let reach = Aabb::new((cell.min - grown).max(self.reach.min), (cell.max + grown).min(self.reach.max));
        Self { reach, ..self.clone() }.through(&tape.jet_over(&Aabb::new(center, center)), center, half(cell))
    }

    /// With the slab of a box around `center`, from what is known there.
    fn through(self, at: &Jet<Interval, 0>, center: DVec3, half: DVec3) -> Self {
        let (gradient, spread) = middle_of(&at.gradient);
        let steepness = gradient.length();
        let (value, doubt) = middle(at.value);
        // f(x) = f(c) + g(c) . v + v H v / 2, with |v| below the half sizes.
        let size = |k: usize| self.hessian[k].upper.max(-self.hessian[k].lower);
        let bent = 0.5 * (size(0) * half.x * half.x + size(1) * half.y * half.y + size(2) * half.z * half.z)
            + size(3) * half.x * half.y
            + size(4) * half.x * half.z
            + size(5) * half.y * half.z;
        let normal = gradient / steepness;
        let thickness = (bent + doubt + spread * half.length()) / steepness * (1.0 + 1e-14);
        let offset = normal.dot(center) - value / steepness;
        let rounding = 8.0 * f64::EPSILON * (center.length() + half.length() + offset.abs());
        Self { normal, offset, thickness: thickness + rounding, ..self }
    }

    /// No more than the squared distance of `p` to the surface in `cell`, infinite where there is none, and a point near where it may be nearest.
    ///
    /// The least |y|^2 over the part of the box p + y that lies in the slab is no less than that of |y|^2 plus any
    /// multiple of how far y is from reaching the slab, which splits into one easy problem for each axis.
    pub(super) fn least(&self, p: DVec3, cell: &Aabb) -> (f64, DVec3) {
        let center = cell.center();
        let apart = (self.normal.dot(center) - self.offset).abs() - self.normal.abs().dot(half(cell)) - self.thickness;
        if apart > 8.0 * f64::EPSILON * (center.length() + self.offset.abs()) {
            return (f64::INFINITY, center);
        }
        let (low, high) = (cell.min - p, cell.max - p);
        let height = self.normal.dot(p) - self.offset;
        let rounding = 8.0 * f64::EPSILON * (p.length() + self.offset.abs());
        let way = (height.abs() - self.thickness - rounding).max(0.0);
        let toward = self.normal * -height.signum();
        let nearest = (toward * way).clamp(low, high);
        let parts = nearest * nearest - toward * nearest * (2.0 * way);
        let size = nearest.length_squared() + 2.0 * way * (toward * nearest).abs().element_sum() + 2.0 * way * way;
        let dual = parts.element_sum() + 2.0 * way * way - 16.0 * f64::EPSILON * size;
        let plain = DVec3::ZERO.clamp(low, high).length_squared() * (1.0 - 8.0 * f64::EPSILON);
        (dual.max(plain), p + (toward * height.abs()).clamp(low, high))
    }
}

/// Whether gradients point the same way, more or less.
fn steady(gradient: &[Interval; 3]) -> bool {
    let (middle, radius) = middle_of(gradient);
    radius <= STEADY * middle.length() && middle.length() > 0.0
}

/// Half the edge lengths, rounded up.
fn half(cell: &Aabb) -> DVec3 {
    let center = cell.center();
    (cell.max - center).max(center - cell.min) * (1.0 + f64::EPSILON)
}
