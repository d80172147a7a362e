//! A function's value with its first and, if wanted, second derivatives, carried forward through every operation.

use super::number::{Number, Scalar};

/// The places of the second derivatives: xx, yy, zz, xy, xz, yz.
pub(super) const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];

/// Value and gradient (`H = 0`), and the six second derivatives in the order of [`PAIRS`] (`H = 6`).
#[derive(Clone, Copy, Debug)]
pub(super) struct Jet<N, const H: usize> {
    pub value: N,
    pub gradient: [N; 3],
    pub hessian: [N; H],
}

impl<N: Scalar, const H: usize> Jet<N, H> {
    /// The coordinate of an axis.
    pub(super) fn axis(axis: usize, value: N) -> Self {
        let mut jet = Self::still(value);
        jet.gradient[axis] = N::constant(1.0);
        jet
    }

    fn still(value: N) -> Self {
        let zero = N::constant(0.0);
        Self { value, gradient: [zero; 3], hessian: [zero; H] }
    }

    /// A function of one number with these derivatives there, by the chain rule.
    fn chain(self, value: N, first: N, second: N) -> Self {
        // A function of what stays the same stays the same, however steep it is.
        let along = |slope: N| if slope.is_zero() { slope } else { slope.mul(first) };
        let gradient = self.gradient.map(along);
        let mut hessian = self.hessian.map(along);
        for (entry, (i, j)) in hessian.iter_mut().zip(PAIRS) {
            let (a, b) = (self.gradient[i], self.gradient[j]);
            if !a.is_zero() && !b.is_zero() {
                let both = if i == j { a.square() } else { a.mul(b) };
                *entry = entry.add(second.mul(both));
            }
        }
        Self { value, gradient, hessian }
    }

    fn each(self, other: Self, value: N, combine: impl Fn(N, N) -> N) -> Self {
        Self {
            value,
            gradient: std::array::from_fn(|i| combine(self.gradient[i], other.gradient[i])),
            hessian: std::array::from_fn(|i| combine(self.hessian[i], other.hessian[i])),
        }
    }

    /// One of two, by the sign of `difference`.
    fn either(difference: N, value: N, below: Self, above: Self) -> Self {
        let mut jet = below.each(above, value, |a, b| difference.select(a, b));
        for entry in &mut jet.hessian {
            *entry = entry.add(difference.kink());
        }
        jet
    }
}

/// a b, which is 0 where a or b is nothing but 0.
fn product<N: Scalar>(a: N, b: N) -> N {
    if a.is_zero() || b.is_zero() { N::constant(0.0) } else { a.mul(b) }
}

impl<N: Scalar, const H: usize> Number for Jet<N, H> {
    fn constant(value: f64) -> Self {
        Self::still(N::constant(value))
    }

    fn add(self, other: Self) -> Self {
        self.each(other, self.value.add(other.value), N::add)
    }

    fn sub(self, other: Self) -> Self {
        self.each(other, self.value.sub(other.value), N::sub)
    }

    fn mul(self, other: Self) -> Self {
        let mut jet = self.each(other, self.value.mul(other.value), |_, _| N::constant(0.0));
        for i in 0..3 {
            jet.gradient[i] = product(self.value, other.gradient[i]).add(product(other.value, self.gradient[i]));
        }
        for (k, (i, j)) in PAIRS.into_iter().enumerate().take(H) {
            let cross = product(self.gradient[i], other.gradient[j]).add(product(self.gradient[j], other.gradient[i]));
            jet.hessian[k] = product(self.value, other.hessian[k]).add(product(other.value, self.hessian[k])).add(cross);
        }
        jet
    }

    fn div(self, other: Self) -> Self {
        let one = N::constant(1.0);
        let inverse = one.div(other.value);
        let square = inverse.square().neg();
        let reciprocal = other.chain(inverse, square, square.mul(inverse).mul(N::constant(-2.0)));
        Self { value: self.value.div(other.value), ..self.mul(reciprocal) }
    }

    fn neg(self) -> Self {
        Self { value: self.value.neg(), gradient: self.gradient.map(N::neg), hessian: self.hessian.map(N::neg) }
    }

    fn abs(self) -> Self {
        Self::either(self.value, self.value.abs(), self.neg(), self)
    }

    fn square(self) -> Self {
        let two = N::constant(2.0);
        self.chain(self.value.square(), self.value.mul(two), two)
    }

    fn power(self, exponent: i32) -> Self {
        let n = N::constant(f64::from(exponent));
        match exponent {
            0 => Self::constant(1.0),
            1 => self,
            _ => {
                let lower = N::constant(f64::from(exponent - 1));
                let second = if exponent == 2 { N::constant(2.0) } else { n.mul(lower).mul(self.value.power(exponent - 2)) };
                self.chain(self.value.power(exponent), n.mul(self.value.power(exponent - 1)), second)
            }
        }
    }

    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        let first = N::constant(0.5).div(root);
        self.chain(root, first, first.div(self.value).mul(N::constant(-0.5)))
    }

    fn min(self, other: Self) -> Self {
        Self::either(self.value.sub(other.value), self.value.min(other.value), self, other)
    }

    fn max(self, other: Self) -> Self {
        Self::either(self.value.sub(other.value), self.value.max(other.value), other, self)
    }

    fn sin(self) -> Self {
        let sin = self.value.sin();
        self.chain(sin, self.value.cos(), sin.neg())
    }

    fn cos(self) -> Self {
        let cos = self.value.cos();
        self.chain(cos, self.value.sin().neg(), cos.neg())
    }

    fn tan(self) -> Self {
        let tan = self.value.tan();
        let first = tan.square().add(N::constant(1.0));
        self.chain(tan, first, tan.mul(first).mul(N::constant(2.0)))
    }

    fn atan(self) -> Self {
        let first = N::constant(1.0).div(self.value.square().add(N::constant(1.0)));
        self.chain(self.value.atan(), first, first.square().mul(self.value).mul(N::constant(-2.0)))
    }

    fn atan2(self, other: Self) -> Self {
        // The gradient of the angle is (-y, x) / (x x + y y), whichever branch.
        let (y, x) = (Jet::<N, H>::still(self.value), Jet::<N, H>::still(other.value));
        let square = x.value.square().add(y.value.square());
        let (dx, dy) = (y.value.neg().div(square), x.value.div(square));
        let fourth = square.square();
        let two = N::constant(2.0);
        let dxx = two.mul(x.value).mul(y.value).div(fourth);
        let dxy = y.value.square().sub(x.value.square()).div(fourth);
        let jump = self.value.cut(other.value);
        let gradient = std::array::from_fn(|i| {
            let slope = product(dx, other.gradient[i]).add(product(dy, self.gradient[i]));
            if other.gradient[i].is_zero() && self.gradient[i].is_zero() { slope } else { slope.add(jump) }
        });
        let hessian = std::array::from_fn(|k| {
            let (i, j) = PAIRS[k];
            let (xi, xj, yi, yj) = (other.gradient[i], other.gradient[j], self.gradient[i], self.gradient[j]);
            let bent = product(dxx, product(xi, xj).sub(product(yi, yj)));
            let mixed = product(dxy, product(xi, yj).add(product(xj, yi)));
            let straight = product(dx, other.hessian[k]).add(product(dy, self.hessian[k]));
            bent.add(mixed).add(straight).add(jump)
        });
        Self { value: self.value.atan2(other.value), gradient, hessian }
    }

    fn exp(self) -> Self {
        let power = self.value.exp();
        self.chain(power, power, power)
    }

    fn ln(self) -> Self {
        let first = N::constant(1.0).div(self.value);
        self.chain(self.value.ln(), first, first.square().neg())
    }

    fn floor(self) -> Self {
        let step = self.value.step();
        self.chain(self.value.floor(), step, step)
    }
}
