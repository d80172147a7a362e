//! On which side of the plane of a triangle a point lies, to twice the usual precision.

use std::ops::{Add, Mul, Sub};

use super::DVec3;

/// No less than what the sums below are off by, of the product of the three vectors' lengths: each step adds less than 2^-100.
const ROUNDING: f64 = 5e-29;

/// A number and what its rounding left.
#[derive(Clone, Copy)]
struct Double {
    high: f64,
    low: f64,
}

impl Double {
    /// The sum of two numbers, exactly (Knuth).
    fn sum(a: f64, b: f64) -> Self {
        let high = a + b;
        let back = high - a;
        Self { high, low: (a - (high - back)) + (b - back) }
    }
}

impl Add for Double {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        let (high, low) = (Self::sum(self.high, other.high), Self::sum(self.low, other.low));
        let first = Self::sum(high.high, high.low + low.high);
        Self::sum(first.high, first.low + low.low)
    }
}

impl Sub for Double {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + Self { high: -other.high, low: -other.low }
    }
}

impl Mul for Double {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let high = self.high * other.high;
        let rest = self.high.mul_add(other.high, -high);
        Self::sum(high, rest + (self.high * other.low + self.low * other.high))
    }
}

/// Positive where `a`, `b` and `c` run counter-clockwise seen from `p`, negative where they run clockwise; `None` where `p` is on
/// their plane, or as good as on it.
pub(crate) fn side_of_plane([a, b, c]: [DVec3; 3], p: DVec3) -> Option<f64> {
    let from_a = |q: DVec3| [0, 1, 2].map(|axis| Double::sum(q[axis], -a[axis]));
    let (u, v, w) = (from_a(b), from_a(c), from_a(p));
    let along = |i: usize, j: usize, k: usize| (u[i] * v[j] - u[j] * v[i]) * w[k];
    let volume = along(1, 2, 0) + along(2, 0, 1) + along(0, 1, 2);
    let length = |v: &[Double; 3]| v.iter().map(|x| x.high.abs()).sum::<f64>();
    (volume.high.abs() > ROUNDING * (length(&u) * length(&v) * length(&w))).then_some(volume.high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_bigint::BigInt;

    /// Coordinates as whole numbers of 2^-80.
    fn whole(x: f64) -> BigInt {
        let bits = x.to_bits();
        let (exponent, fraction) = ((bits >> 52 & 0x7ff) as i64, bits & ((1 << 52) - 1));
        let (mantissa, power) = if exponent == 0 { (fraction, -1074) } else { (fraction | 1 << 52, exponent - 1075) };
        let shift = power + 80;
        let size = BigInt::from(mantissa);
        let size = if shift >= 0 { size << shift } else { size >> -shift };
        if x < 0.0 { -size } else { size }
    }

    #[test]
    fn agrees_with_whole_numbers() {
        let mut state = 3u64;
        let mut random = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        let (mut sides, mut on) = ([0; 2], 0);
        for round in 0..20_000 {
            // Far from the origin, and as near to the plane as coordinates allow.
            let far = DVec3::splat([0.0, 1.0, 1e6, -3e4][round % 4]);
            let mut point = || far + DVec3::new(random(), random(), random());
            let [a, b, c] = [point(), point(), point()];
            let p = a + (b - a) * 0.3 + (c - a) * 0.4;
            let exact = {
                let from_a = |q: DVec3| [0, 1, 2].map(|axis| whole(q[axis]) - whole(a[axis]));
                let (u, v, w) = (from_a(b), from_a(c), from_a(p));
                let along = |i: usize, j: usize, k: usize| (&u[i] * &v[j] - &u[j] * &v[i]) * &w[k];
                along(1, 2, 0) + along(2, 0, 1) + along(0, 1, 2)
            };
            match side_of_plane([a, b, c], p) {
                Some(side) => {
                    assert_eq!(side < 0.0, exact < BigInt::ZERO, "{a} {b} {c} {p}: {side}");
                    assert!(exact != BigInt::ZERO);
                    sides[usize::from(side < 0.0)] += 1;
                }
                None => on += 1,
            }
        }
        assert!(sides[0] > 5000 && sides[1] > 5000 && on < 1000, "{sides:?} {on}");
        let face = [DVec3::ZERO, DVec3::X, DVec3::Y];
        assert!(side_of_plane(face, DVec3::new(0.2, 0.2, 1e-25)).is_some_and(|side| side > 0.0));
        assert_eq!(side_of_plane(face, DVec3::new(0.2, 0.3, 0.0)), None);
    }
}
