//! Interval arithmetic in double precision, rounded outward: what it says holds for real numbers.
//!
//! Sums, products, quotients and roots are correctly rounded by every machine, so one step to the next double on either
//! side contains the truth. The functions of the mathematics library are not: they are trusted to [`LIBRARY`] units in the
//! last place, four times what glibc, musl, Apple's and Microsoft's state. Where an operation is not defined for all of
//! its argument (a division by 0, the root or logarithm of what may be negative) nothing is known of the result, nor of
//! anything made of it.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::number::{Number, Scalar};
use crate::geom::Interval;

/// Units in the last place by which a function of the mathematics library may be wrong.
pub(super) const LIBRARY: f64 = 4.0;

/// An interval from its ends; nothing is known where one is not a number.
fn ordered(lower: f64, upper: f64) -> Interval {
    if lower <= upper { Interval { lower, upper } } else { Interval::ALL }
}

/// Ends that were rounded once, to the nearest.
fn outward(lower: f64, upper: f64) -> Interval {
    ordered(lower - step(lower), upper + step(upper))
}

/// No less than the step from a number to its neighbours: in two operations, unlike the step itself.
fn step(value: f64) -> f64 {
    value.abs() * f64::EPSILON + f64::MIN_POSITIVE
}

/// The product where some end is infinite, or the width of either is.
#[cold]
fn wide_product(a: Interval, b: Interval) -> Interval {
    if a.is_zero() && b.upper - b.lower < f64::INFINITY || b.is_zero() && a.upper - a.lower < f64::INFINITY {
        return Interval::exact(0.0);
    }
    if a == Interval::ALL || b == Interval::ALL {
        return Interval::ALL;
    }
    let products = [a.lower * b.lower, a.lower * b.upper, a.upper * b.lower, a.upper * b.upper];
    // 0 times an end that is infinite is no number: the end stands for numbers beyond all bounds, times 0 is 0.
    product_of(a, b, products.map(|p| if p.is_nan() { 0.0 } else { p }))
}

/// The least and the greatest of what the ends make; rounding does not take it over zero.
fn product_of(a: Interval, b: Interval, [p, q, r, s]: [f64; 4]) -> Interval {
    let less = |x: f64, y: f64| if x < y { x } else { y };
    let more = |x: f64, y: f64| if x > y { x } else { y };
    let mut product = outward(less(less(p, q), less(r, s)), more(more(p, q), more(r, s)));
    let (down, up, other_down, other_up) = (a.lower >= 0.0, a.upper <= 0.0, b.lower >= 0.0, b.upper <= 0.0);
    if down & other_down | up & other_up {
        product.lower = product.lower.max(0.0);
    }
    if down & other_up | up & other_down {
        product.upper = product.upper.min(0.0);
    }
    product
}

/// A value of the mathematics library, lowered by its error.
fn library_down(value: f64) -> f64 {
    if value == f64::INFINITY { f64::MAX } else { (value - value.abs() * (LIBRARY * f64::EPSILON)).next_down() }
}

/// A value of the mathematics library, raised by its error.
fn library_up(value: f64) -> f64 {
    -library_down(-value)
}

/// The image of an interval under an increasing function of the library.
fn increasing(of: Interval, function: impl Fn(f64) -> f64) -> Interval {
    if of == Interval::ALL {
        return of;
    }
    let lower = function(of.lower);
    let upper = if of.lower == of.upper { lower } else { function(of.upper) };
    ordered(library_down(lower), library_up(upper))
}

/// Whether `first + k * period` may lie in the interval for a whole number k.
fn may_meet(of: Interval, first: f64, period: f64) -> bool {
    let (a, b) = ((of.lower - first) / period, (of.upper - first) / period);
    let margin = 8.0 * f64::EPSILON * (a.abs().max(b.abs()) + 1.0);
    !((b + margin).floor() < (a - margin).ceil())
}

/// A wave between -1 and 1 whose crests lie at `crest`, a period of 2 pi apart.
fn wave(of: Interval, crest: f64, function: impl Fn(f64) -> f64) -> Interval {
    if of == Interval::ALL {
        return of;
    }
    // An end that is not a number falls here, too.
    if !(of.width() < TAU) {
        return Interval { lower: -1.0, upper: 1.0 };
    }
    if of.lower == of.upper {
        let value = function(of.lower);
        return ordered(library_down(value).max(-1.0), library_up(value).min(1.0));
    }
    let ends = [of.lower, of.upper].map(&function);
    let upper = if may_meet(of, crest, TAU) { 1.0 } else { library_up(ends[0].max(ends[1])).min(1.0) };
    let lower = if may_meet(of, crest - PI, TAU) { -1.0 } else { library_down(ends[0].min(ends[1])).max(-1.0) };
    ordered(lower, upper)
}

/// The product of two numbers that are not negative, to a whole power, rounded outward.
fn whole_power(of: Interval, exponent: u32) -> Interval {
    let (mut result, mut square, mut rest) = (Interval::exact(1.0), of, exponent);
    while rest > 0 {
        if rest & 1 == 1 {
            result = if rest == exponent { square } else { result.mul(square) };
        }
        rest >>= 1;
        if rest > 0 {
            square = square.mul(square);
        }
    }
    result
}

impl Number for Interval {
    fn constant(value: f64) -> Self {
        if value.is_finite() { Self::exact(value) } else { Self::ALL }
    }

    fn add(self, other: Self) -> Self {
        if self.is_zero() {
            return other;
        }
        if other.is_zero() {
            return self;
        }
        let mut sum = outward(self.lower + other.lower, self.upper + other.upper);
        // Rounding does not take a sum over zero.
        if self.lower >= 0.0 && other.lower >= 0.0 {
            sum.lower = sum.lower.max(0.0);
        }
        if self.upper <= 0.0 && other.upper <= 0.0 {
            sum.upper = sum.upper.min(0.0);
        }
        sum
    }

    fn sub(self, other: Self) -> Self {
        self.add(other.neg())
    }

    fn mul(self, other: Self) -> Self {
        if !(self.upper - self.lower < f64::INFINITY && other.upper - other.lower < f64::INFINITY) {
            return wide_product(self, other);
        }
        if self.is_zero() || other.is_zero() {
            return Self::exact(0.0);
        }
        let products = [self.lower * other.lower, self.lower * other.upper, self.upper * other.lower, self.upper * other.upper];
        product_of(self, other, products)
    }

    fn div(self, other: Self) -> Self {
        if !(other.lower > 0.0 || other.upper < 0.0) || self == Self::ALL {
            return Self::ALL;
        }
        if self.is_zero() {
            return self;
        }
        let quotients = [self.lower / other.lower, self.lower / other.upper, self.upper / other.lower, self.upper / other.upper];
        if quotients.iter().any(|q| q.is_nan()) {
            return Self::ALL;
        }
        let [a, b, c, d] = quotients;
        let mut quotient = outward(a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
        let positive = other.lower > 0.0;
        if self.lower >= 0.0 && positive || self.upper <= 0.0 && !positive {
            quotient.lower = quotient.lower.max(0.0);
        }
        if self.lower >= 0.0 && !positive || self.upper <= 0.0 && positive {
            quotient.upper = quotient.upper.min(0.0);
        }
        quotient
    }

    fn neg(self) -> Self {
        Self { lower: -self.upper, upper: -self.lower }
    }

    fn abs(self) -> Self {
        if self == Self::ALL || self.lower >= 0.0 {
            self
        } else if self.upper <= 0.0 {
            self.neg()
        } else {
            Self { lower: 0.0, upper: self.upper.max(-self.lower) }
        }
    }

    fn square(self) -> Self {
        let size = self.abs();
        if self == Self::ALL { self } else { size.mul(size) }
    }

    fn power(self, exponent: i32) -> Self {
        if self == Self::ALL {
            return self;
        }
        let positive = match exponent.unsigned_abs() {
            0 => Self::exact(1.0),
            n if n % 2 == 0 => whole_power(self.abs(), n),
            n => {
                let one = |end: f64| {
                    let power = whole_power(Self::exact(end.abs()), n);
                    if end < 0.0 { power.neg() } else { power }
                };
                Self { lower: one(self.lower).lower, upper: one(self.upper).upper }
            }
        };
        if exponent < 0 { Self::exact(1.0).div(positive) } else { positive }
    }

    fn sqrt(self) -> Self {
        if !(self.lower >= 0.0) {
            return Self::ALL;
        }
        let root = outward(self.lower.sqrt(), self.upper.sqrt());
        Self { lower: root.lower.max(0.0), ..root }
    }

    fn min(self, other: Self) -> Self {
        if self == Self::ALL || other == Self::ALL {
            return Self::ALL;
        }
        Self { lower: self.lower.min(other.lower), upper: self.upper.min(other.upper) }
    }

    fn max(self, other: Self) -> Self {
        if self == Self::ALL || other == Self::ALL {
            return Self::ALL;
        }
        Self { lower: self.lower.max(other.lower), upper: self.upper.max(other.upper) }
    }

    fn sin(self) -> Self {
        wave(self, FRAC_PI_2, f64::sin)
    }

    fn cos(self) -> Self {
        wave(self, 0.0, f64::cos)
    }

    fn tan(self) -> Self {
        if !(self.width() < PI) || may_meet(self, FRAC_PI_2, PI) { Self::ALL } else { increasing(self, f64::tan) }
    }

    fn atan(self) -> Self {
        increasing(self, f64::atan)
    }

    fn atan2(self, other: Self) -> Self {
        if self == Self::ALL || other == Self::ALL {
            return Self::ALL;
        }
        let whole = Self { lower: library_down(-PI), upper: library_up(PI) };
        let cut = self.contains(0.0) && other.lower <= 0.0;
        let corners = [(self.lower, other.lower), (self.lower, other.upper), (self.upper, other.lower), (self.upper, other.upper)];
        if cut || corners.iter().any(|(y, x)| !y.is_finite() || !x.is_finite()) {
            return whole;
        }
        let [a, b, c, d] = corners.map(|(y, x)| y.atan2(x));
        ordered(library_down(a.min(b).min(c.min(d))), library_up(a.max(b).max(c.max(d))))
    }

    fn exp(self) -> Self {
        let power = increasing(self, f64::exp);
        if power == Self::ALL { power } else { Self { lower: power.lower.max(0.0), ..power } }
    }

    fn ln(self) -> Self {
        if self.lower > 0.0 { increasing(self, f64::ln) } else { Self::ALL }
    }

    fn floor(self) -> Self {
        Self { lower: self.lower.floor(), upper: self.upper.floor() }
    }
}

impl Scalar for Interval {
    fn is_zero(self) -> bool {
        self.lower == 0.0 && self.upper == 0.0
    }

    fn select(self, below: Self, above: Self) -> Self {
        if self.upper < 0.0 {
            below
        } else if self.lower > 0.0 {
            above
        } else {
            below.hull(above)
        }
    }

    fn kink(self) -> Self {
        if self.contains(0.0) { Self::ALL } else { Self::exact(0.0) }
    }

    fn step(self) -> Self {
        if self.lower.floor() == self.upper.floor() && self.lower.is_finite() && self.lower != self.lower.floor() {
            Self::exact(0.0)
        } else {
            Self::ALL
        }
    }

    fn cut(self, other: Self) -> Self {
        if self.contains(0.0) && other.lower <= 0.0 { Self::ALL } else { Self::exact(0.0) }
    }
}
