//! Closed intervals of distances.

/// Contains the true signed distance. `lower == upper`: exact; 0 strictly inside: side unknown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Not above the truth.
    pub lower: f64,
    /// Not below the truth.
    pub upper: f64,
}

impl Interval {
    /// Nothing is known.
    pub const ALL: Self = Self { lower: f64::NEG_INFINITY, upper: f64::INFINITY };

    /// The interval that holds one value.
    pub const fn exact(value: f64) -> Self {
        Self { lower: value, upper: value }
    }

    /// `[value - error, value + error]`.
    pub fn around(value: f64, error: f64) -> Self {
        Self { lower: value - error, upper: value + error }
    }

    /// `[-distance, distance]`: the distance is known, the side is not.
    pub fn either_side(distance: f64) -> Self {
        Self { lower: -distance.abs(), upper: distance.abs() }
    }

    /// Whether `value` lies in the interval, its ends included.
    pub fn contains(self, value: f64) -> bool {
        self.lower <= value && value <= self.upper
    }

    /// `upper - lower`.
    pub fn width(self) -> f64 {
        self.upper - self.lower
    }

    /// Widened by `error` on both sides.
    #[must_use]
    pub fn widen(self, error: f64) -> Self {
        Self { lower: self.lower - error, upper: self.upper + error }
    }

    /// The smallest interval that holds both.
    #[must_use]
    pub fn hull(self, other: Self) -> Self {
        Self { lower: self.lower.min(other.lower), upper: self.upper.max(other.upper) }
    }

    /// Mirrored at 0.
    #[must_use]
    pub fn negated(self) -> Self {
        Self { lower: -self.upper, upper: -self.lower }
    }

    /// All sums of a number of one and a number of the other.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self { lower: self.lower + other.lower, upper: self.upper + other.upper }
    }

    /// What lies in both; the ends change places where nothing does.
    #[must_use]
    pub fn intersection(self, other: Self) -> Self {
        Self { lower: self.lower.max(other.lower), upper: self.upper.min(other.upper) }
    }
}
