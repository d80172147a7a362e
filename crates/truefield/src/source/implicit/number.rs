//! What expressions are computed in: plain numbers, or intervals that prove something.

/// A number or a set of numbers; every operation of a set contains the operation of each of its members.
pub(super) trait Number: Copy {
    fn constant(value: f64) -> Self;
    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    fn div(self, other: Self) -> Self;
    fn neg(self) -> Self;
    fn abs(self) -> Self;
    fn square(self) -> Self;
    fn power(self, exponent: i32) -> Self;
    fn sqrt(self) -> Self;
    fn min(self, other: Self) -> Self;
    fn max(self, other: Self) -> Self;
    fn sin(self) -> Self;
    fn cos(self) -> Self;
    fn tan(self) -> Self;
    fn atan(self) -> Self;
    /// The angle of (other, self), from -pi to pi.
    fn atan2(self, other: Self) -> Self;
    fn exp(self) -> Self;
    fn ln(self) -> Self;
    fn floor(self) -> Self;
}

/// A [`Number`] that derivatives are made of.
pub(super) trait Scalar: Number {
    /// Whether it is 0 and nothing else.
    fn is_zero(self) -> bool;

    /// `below` where `self` is negative, `above` where positive, all of both where that is open.
    fn select(self, below: Self, above: Self) -> Self;

    /// What a derivative has in addition where the sign of `self` may change: nothing, or anything.
    fn kink(self) -> Self;

    /// What a derivative has where `self` may cross a whole number: nothing, or anything.
    fn step(self) -> Self;

    /// What a derivative has where the angle of (other, self) may jump: nothing, or anything.
    fn cut(self, other: Self) -> Self;
}

impl Number for f64 {
    fn constant(value: f64) -> Self {
        value
    }
    fn add(self, other: Self) -> Self {
        self + other
    }
    fn sub(self, other: Self) -> Self {
        self - other
    }
    fn mul(self, other: Self) -> Self {
        self * other
    }
    fn div(self, other: Self) -> Self {
        self / other
    }
    fn neg(self) -> Self {
        -self
    }
    fn abs(self) -> Self {
        self.abs()
    }
    fn square(self) -> Self {
        self * self
    }
    fn power(self, exponent: i32) -> Self {
        self.powi(exponent)
    }
    fn sqrt(self) -> Self {
        self.sqrt()
    }
    // Not a number stays not a number.
    fn min(self, other: Self) -> Self {
        if self < other || self.is_nan() { self } else { other }
    }
    fn max(self, other: Self) -> Self {
        if self > other || self.is_nan() { self } else { other }
    }
    fn sin(self) -> Self {
        self.sin()
    }
    fn cos(self) -> Self {
        self.cos()
    }
    fn tan(self) -> Self {
        self.tan()
    }
    fn atan(self) -> Self {
        self.atan()
    }
    fn atan2(self, other: Self) -> Self {
        self.atan2(other)
    }
    fn exp(self) -> Self {
        self.exp()
    }
    fn ln(self) -> Self {
        self.ln()
    }
    fn floor(self) -> Self {
        self.floor()
    }
}

impl Scalar for f64 {
    fn is_zero(self) -> bool {
        self == 0.0
    }
    fn select(self, below: Self, above: Self) -> Self {
        if self < 0.0 { below } else { above }
    }
    fn kink(self) -> Self {
        0.0
    }
    fn step(self) -> Self {
        0.0
    }
    fn cut(self, _: Self) -> Self {
        0.0
    }
}
