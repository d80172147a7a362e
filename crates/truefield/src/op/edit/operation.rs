//! What a tool does to a shape, as one formula.
//!
//! With all signs as [`Turned`] has them, every edit is the greater of two numbers, x of the field and y of the tool, or a
//! smooth one: max(x, y) + h^2 / 4k with h = max(k - |x - y|, 0). For k = 0 it is an intersection of two solids. What is
//! known of its distance d, where x and y are distances and g is their (smooth) maximum:
//! 1. |d| >= |g|, since g has the sign of d, vanishes where d does and changes by no more than one moves.
//! 2. Inside, where g < 0: d >= max(x, y), since the ball of that radius lies in both.
//! 3. d = max(x, y) where x + y <= -k: if x is the greater one, the ball of radius |x| around the point lies so deep in
//!    the tool that nothing but the field's own boundary can be met in it.
//! 4. Elsewhere outside, d is no more than the way to any point that is certainly inside.

use crate::error::{Error, Result};
use crate::field::adaptive::Change;
use crate::geom::Interval;
use crate::source::kink::Seam;

/// What a tool does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Operation {
    /// Takes the tool away: the greater of the field and the negative tool.
    Carve,
    /// Adds the tool: the lesser of both.
    Fill,
    /// Keeps what is in both: the greater of both.
    Intersect,
    /// Adds the tool and fills the seam with a fillet: the smooth lesser of both, over this length.
    Blend(f64),
}

/// The signs that make every operation a maximum, and how smooth it is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turned {
    field: f64,
    tool: f64,
    /// Over which difference the maximum is smooth.
    pub smooth: f64,
}

impl Operation {
    pub(super) fn check(self) -> Result<()> {
        match self {
            Self::Blend(radius) if !(radius > 0.0 && radius.is_finite()) => {
                Err(Error::invalid(format!("the radius is {radius}; give a positive length, or fill without one")))
            }
            _ => Ok(()),
        }
    }

    pub(super) fn change(self) -> Change {
        match self {
            Self::Carve | Self::Intersect => Change::Shrunk,
            Self::Fill | Self::Blend(_) => Change::Grown,
        }
    }

    pub(super) fn turned(self) -> Turned {
        match self {
            Self::Carve => Turned { field: 1.0, tool: -1.0, smooth: 0.0 },
            Self::Intersect => Turned { field: 1.0, tool: 1.0, smooth: 0.0 },
            Self::Fill => Turned { field: -1.0, tool: -1.0, smooth: 0.0 },
            Self::Blend(radius) => Turned { field: -1.0, tool: -1.0, smooth: radius },
        }
    }
}

impl Turned {
    /// x of a value of the field, and back.
    pub fn field(self, value: f64) -> f64 {
        self.field * value
    }

    /// y of a value of the tool.
    pub fn tool(self, value: f64) -> f64 {
        self.tool * value
    }

    pub fn field_range(self, range: Interval) -> Interval {
        turned(self.field, range)
    }

    pub fn tool_range(self, range: Interval) -> Interval {
        turned(self.tool, range)
    }

    /// The (smooth) maximum.
    pub fn combine(self, x: f64, y: f64) -> f64 {
        let h = (self.smooth - (x - y).abs()).max(0.0);
        x.max(y) + if h > 0.0 { h * h / (4.0 * self.smooth) } else { 0.0 }
    }

    /// Whether the maximum is x wherever both are in these ranges.
    pub fn is_first(self, x: Interval, y: Interval) -> bool {
        y.upper + self.smooth <= x.lower
    }

    /// How the maximum passes from x to y: it is their mean and f of their difference, f'' = 1 / 2k.
    pub fn seam(self) -> Seam {
        if self.smooth > 0.0 { Seam::Smooth(0.5 / self.smooth) } else { Seam::Sharp }
    }

    /// Contains the distance minus the maximum of what the field and the tool say, from the same for each of them, as far
    /// as nothing but a point inside bounds it; and whether that is so.
    pub fn error(self, errors: [Interval; 2], [x, y]: [Interval; 2]) -> (Interval, bool) {
        let [e, s] = errors;
        let mut error = if self.is_first(x, y) {
            e
        } else if self.is_first(y, x) {
            s
        } else {
            e.hull(s)
        };
        let highest = x.upper.max(y.upper) + 0.25 * self.smooth;
        if self.smooth > 0.0 && !self.is_first(x, y) && !self.is_first(y, x) {
            error.lower -= 0.25 * self.smooth;
        }
        (error, !(x.upper + y.upper <= -self.smooth || highest <= 0.0))
    }
}

/// `interval` with its sign changed where `sign` is negative.
fn turned(sign: f64, interval: Interval) -> Interval {
    if sign < 0.0 { interval.negated() } else { interval }
}
