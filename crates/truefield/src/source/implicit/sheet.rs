//! What interval arithmetic proves of the surface in a box.

use super::jet::Jet;
use super::matrix::{eigenvalues, middle, middle_of, times};
use super::number::Number;
use super::tape::Tape;
use super::taylor::Taylor;
use crate::geom::{Aabb, DVec3, Interval};

/// In a sheet, gradients differ from their middle by no more than this part of it.
const STEADY: f64 = 0.25;

/// How far around a point its side is looked for, in sizes of the domain.
const TOUCH: f64 = 1e-9;

/// From a corner, in margins: in no direction in which formulas tend to be zero.
const ASIDE: DVec3 = DVec3::new(0.31, -0.67, 0.83);

/// What derivatives say of the surface in a box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sheet {
    /// Where the following holds.
    pub extent: Aabb,
    /// Contains the formula's values, gradients and second derivatives there.
    pub value: Interval,
    pub gradient: [Interval; 3],
    pub hessian: [Interval; 6],
    /// Contains the eigenvalues of the second derivatives.
    pub turns: Interval,
}

/// What a box has of the surface.
pub(super) enum Content {
    /// Nothing: the formula is positive (outside) or negative (inside) everywhere.
    Nothing(Side),
    /// One smooth sheet at most, nearly a plane.
    Sheet(Box<(Taylor, Sheet)>),
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

    /// The side of a point of `domain`, where it is certain.
    ///
    /// Where the formula is 0 and of one sign around it, it only touches zero: that is no surface.
    pub(super) fn at(tape: &Tape, domain: &Aabb, p: DVec3) -> Option<Self> {
        let value = tape.certain(p);
        Self::of(value).or_else(|| {
            let touches = value.lower >= 0.0 || value.upper <= 0.0;
            touches.then(|| Self::around(tape, domain, &Aabb::new(p, p), TOUCH * domain.diagonal())).flatten()
        })
    }

    /// The side of all of a box, where the formula nowhere in it, nor within `margin` of it, has the other sign.
    ///
    /// Zeros may fill a room that parts both signs: there surface is. Boxes of either sign that touch would share a room of
    /// zeros at a corner of the smaller one, so that places next to all corners must tell the sign.
    pub(super) fn around(tape: &Tape, domain: &Aabb, cell: &Aabb, margin: f64) -> Option<Self> {
        let side = match over_grown(tape, domain, cell, margin) {
            Interval { lower, .. } if lower >= 0.0 => Self::Outside,
            Interval { upper, .. } if upper <= 0.0 => Self::Inside,
            _ => return None,
        };
        let tells = |corner: u8| {
            let at = DVec3::from([0, 1, 2].map(|axis| if corner >> axis & 1 == 0 { cell.min[axis] } else { cell.max[axis] }));
            let place = (at + ASIDE * margin).max(domain.min).min(domain.max);
            Self::of(tape.certain(place)) == Some(side)
        };
        (0..8).all(tells).then_some(side)
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

/// The formula in a box and within `margin` of it.
fn over_grown(tape: &Tape, domain: &Aabb, cell: &Aabb, margin: f64) -> Interval {
    let grown = cell.grow(margin);
    tape.over(&Aabb::new(grown.min.max(domain.min), grown.max.min(domain.max)))
}

/// Whether the formula is 0 everywhere in a box.
pub(super) fn is_level(tape: &Tape, cell: &Aabb) -> bool {
    let value = tape.over(cell);
    value.lower == 0.0 && value.upper == 0.0
}

impl Content {
    /// Looks at one box.
    pub(super) fn of(tape: &Tape, cell: &Aabb) -> Self {
        if let Some(side) = Side::of(tape.over(cell)) {
            return Self::Nothing(side);
        }
        let center = cell.center();
        let at = tape.jet_over::<0>(&Aabb::new(center, center));
        let slopes = tape.slopes(cell);
        // The mean value theorem: f(x) = f(c) + (a gradient of the box) . (x - c).
        let half = (cell.max - center).max(center - cell.min) * (1.0 + f64::EPSILON);
        let mean = (0..3).fold(at.value, |sum, axis| sum.add(slopes[axis].mul(Interval::around(0.0, half[axis]))));
        if let Some(side) = Side::of(mean) {
            return Self::Nothing(side);
        }
        if !is_steady(&slopes, STEADY) {
            return Self::Open;
        }
        let sheet = Sheet::over(tape, cell);
        if sheet.hessian.iter().any(|h| !h.width().is_finite()) {
            return Self::Open;
        }
        let taylor = Taylor::new(&at, &sheet);
        if taylor.is_empty(cell) {
            return Self::Nothing(if taylor.level() > 0.0 { Side::Outside } else { Side::Inside });
        }
        Self::Sheet(Box::new((taylor, sheet)))
    }
}

impl Sheet {
    /// The surface in a box, whatever it is like.
    pub(super) fn over(tape: &Tape, extent: &Aabb) -> Self {
        let Jet { value, gradient, hessian } = tape.jet_over(extent);
        Self { extent: *extent, value, gradient, hessian, turns: eigenvalues(&hessian) }
    }

    /// What is known of I + `a` H, for any second derivatives H of it.
    pub(super) fn bend(&self, a: f64, normal: DVec3) -> Bend {
        let parts = self.hessian.map(middle);
        let spread = (0..6).map(|k| if k < 3 { parts[k].1.powi(2) } else { 2.0 * parts[k].1.powi(2) }).sum::<f64>().sqrt();
        let matrix = parts.map(|(middle, _)| middle);
        let (first, second) = normal.any_orthonormal_pair();
        let (turned, one, two) = (times(&matrix, normal), times(&matrix, first), times(&matrix, second));
        let (xx, yy, xy) = (one.dot(first), two.dot(second), one.dot(second));
        let (mean, apart) = (0.5 * (xx + yy), (0.5 * (xx - yy)).hypot(xy));
        let along = turned.dot(normal);
        let size = self.turns.upper.max(-self.turns.lower);
        let doubt = a.abs() * spread * (1.0 + 1e-14) + 1e-14 * (1.0 + a.abs() * (size + spread));
        Bend {
            whole: 1.0 + (a * self.turns.lower).min(a * self.turns.upper) - 1e-14 * (1.0 + a.abs() * size),
            tangential: 1.0 + (a * (mean - apart)).min(a * (mean + apart)) - doubt,
            normal: (1.0 + a * along - doubt).min(0.0),
            mixed: a.abs() * (turned - normal * along).length() + doubt,
        }
    }
}

/// No eigenvalue of I + a H is less than `whole`; along a normal and across it, more is known.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bend {
    pub whole: f64,
    /// Of tangential directions.
    tangential: f64,
    /// Of the normal, if negative.
    normal: f64,
    /// No less than what it mixes of a normal and any tangent.
    pub mixed: f64,
}

impl Bend {
    /// No more than u (I + a H) u for any u of length 1 that leaves the tangent plane by `off` at most.
    pub(super) fn least(&self, off: f64) -> f64 {
        self.tangential - self.both() * off * off - 2.0 * self.mixed * off
    }

    /// The greatest part by which such a u may leave the tangent plane, if that is not to be negative.
    pub(super) fn most_off(&self) -> f64 {
        let (tangential, both) = (self.tangential.max(0.0), self.both());
        tangential / (self.mixed + (self.mixed * self.mixed + both * tangential).sqrt())
    }

    /// What is lost with the square of that part.
    pub(super) fn both(&self) -> f64 {
        self.tangential.max(0.0) - self.normal
    }
}

/// Whether gradients differ from their middle by no more than that part of it.
pub(super) fn is_steady(gradient: &[Interval; 3], part: f64) -> bool {
    let (middle, radius) = middle_of(gradient);
    radius <= part * middle.length() && middle.length() > 0.0
}
