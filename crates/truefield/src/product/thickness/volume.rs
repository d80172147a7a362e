//! How much of a cell lies above a limit, from the values of a function at its corners.

use crate::geom::{Aabb, DVec3};

/// Slopes below this share of the steepest sum are taken as level, and paid for in the bound.
const LEVEL: f64 = 1e-4;

/// Covers rounding in the volume formula, as a share of the cell.
const SLACK: f64 = 1e-8;

/// A linear function over the unit cell `[-1/2, 1/2]^3` and how far it is off at the corners.
///
/// The trilinear interpolant differs from it by a trilinear function, which is largest at a
/// corner: so `residual` bounds the difference everywhere in the cell.
#[derive(Clone, Copy, Debug)]
pub(super) struct Linear {
    middle: f64,
    slope: DVec3,
    residual: f64,
}

impl Linear {
    /// Fits the eight corner values, corner `k` at the high x, y, z side for bits 0, 1, 2 of `k`.
    pub fn fit(values: &[f64; 8]) -> Self {
        let sign = |k: usize, axis: usize| if k >> axis & 1 == 1 { 1.0 } else { -1.0 };
        let middle = values.iter().sum::<f64>() / 8.0;
        let slope =
            DVec3::from_array(std::array::from_fn(|axis| values.iter().enumerate().map(|(k, v)| v * sign(k, axis)).sum::<f64>() / 4.0));
        let at = |k: usize| middle + 0.5 * (slope.x * sign(k, 0) + slope.y * sign(k, 1) + slope.z * sign(k, 2));
        let residual = values.iter().enumerate().map(|(k, v)| (v - at(k)).abs()).fold(0.0, f64::max);
        Self { middle, slope, residual }
    }

    /// At least this share of the cell lies above `limit`.
    pub fn surely_above(&self, limit: f64) -> f64 {
        let (slope, lost) = self.level();
        (share(self.middle - self.residual - lost - limit, slope) - SLACK).max(0.0)
    }

    /// At most this share of the cell lies above `limit`.
    pub fn possibly_above(&self, limit: f64) -> f64 {
        let (slope, lost) = self.level();
        (share(self.middle + self.residual + lost - limit, slope) + SLACK).min(1.0)
    }

    /// A box around the part of `cell` that may lie above `limit`; `None` if there is none.
    pub fn possible_box(&self, cell: &Aabb, limit: f64) -> Option<Aabb> {
        let over = self.middle + self.residual - limit;
        let reach = 0.5 * self.slope.abs();
        let total = reach.element_sum();
        if over + total < 0.0 {
            return None;
        }
        let (mut low, mut high) = (DVec3::splat(-0.5), DVec3::splat(0.5));
        for axis in 0..3 {
            // The other two axes at their best leave this one the freedom to go down to here.
            let margin = over + total - reach[axis];
            let steep = self.slope[axis].abs();
            if margin < 0.5 * steep {
                let cut = (-margin / steep).clamp(-0.5, 0.5);
                if self.slope[axis] > 0.0 {
                    low[axis] = cut;
                } else {
                    high[axis] = -cut;
                }
            }
        }
        let (center, size) = (cell.center(), cell.size());
        let grown = 1e-12 * size.max_element();
        Some(Aabb::new((center + low * size - grown).max(cell.min), (center + high * size + grown).min(cell.max)))
    }

    /// The slopes with the nearly level ones removed, and the most they could have added.
    fn level(&self) -> (DVec3, f64) {
        let least = LEVEL * self.slope.abs().element_sum();
        let mut slope = self.slope;
        let mut lost = 0.0;
        for axis in 0..3 {
            if slope[axis].abs() < least {
                lost += 0.5 * slope[axis].abs();
                slope[axis] = 0.0;
            }
        }
        (slope, lost)
    }
}

/// Share of `[-1/2, 1/2]^3` where `middle + slope . x > 0` (Scardovelli and Zaleski 2000, eq. 10).
fn share(middle: f64, slope: DVec3) -> f64 {
    let total = slope.abs().element_sum();
    if 2.0 * middle <= -total {
        return 0.0;
    }
    if 2.0 * middle >= total {
        return 1.0;
    }
    let mut m = (slope.abs() / total).to_array();
    m.sort_unstable_by(f64::total_cmp);
    let alpha = middle / total + 0.5;
    if alpha <= 0.5 { below(alpha, m) } else { 1.0 - below(1.0 - alpha, m) }
}

/// Volume of the unit cube with `m . x < alpha`, for `alpha <= 1/2` and ascending `m` of sum 1.
fn below(alpha: f64, [m1, m2, m3]: [f64; 3]) -> f64 {
    let m12 = m1 + m2;
    let cube = |x: f64| x * x * x;
    let volume = if alpha < m1 {
        cube(alpha) / (6.0 * m1 * m2 * m3)
    } else if alpha < m2 {
        alpha * (alpha - m1) / (2.0 * m2 * m3) + m1 * m1 / (6.0 * m2 * m3)
    } else if alpha < m12.min(m3) {
        (cube(alpha) - cube(alpha - m1) - cube(alpha - m2)) / (6.0 * m1 * m2 * m3)
    } else if m3 < m12 {
        (cube(alpha) - cube(alpha - m1) - cube(alpha - m2) - cube(alpha - m3)) / (6.0 * m1 * m2 * m3)
    } else {
        (alpha - 0.5 * m12) / m3
    };
    volume.clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corners(f: impl Fn(DVec3) -> f64) -> [f64; 8] {
        let cell = Aabb::new(DVec3::splat(-0.5), DVec3::splat(0.5));
        std::array::from_fn(|k| f(cell.corner(k)))
    }

    /// Share of the unit cell where `f` is positive, by counting midpoints.
    fn counted(f: impl Fn(DVec3) -> f64) -> f64 {
        let n = 64;
        let at = |i: usize| (i as f64 + 0.5) / f64::from(n) - 0.5;
        let n = n as usize;
        let count = (0..n * n * n).filter(|i| f(DVec3::new(at(i % n), at(i / n % n), at(i / n / n))) > 0.0).count();
        count as f64 / (n * n * n) as f64
    }

    #[test]
    fn half_spaces_match_counting() {
        let slopes =
            [(1.0, 0.0, 0.0), (1.0, 1.0, 1.0), (0.3, -2.0, 0.7), (1e-5, 1.0, -0.2), (5.0, 4.0, 1.5), (1.0, 1e-9, -1e-9), (2.0, -2.0, 1e-3)];
        for (x, y, z) in slopes {
            let slope = DVec3::new(x, y, z);
            for step in -12..=12 {
                let middle = f64::from(step) / 20.0 * slope.abs().element_sum();
                let f = |p: DVec3| middle + slope.dot(p);
                let linear = Linear::fit(&corners(f));
                let (lower, upper, truth) = (linear.surely_above(0.0), linear.possibly_above(0.0), counted(f));
                assert!(upper - lower < 1e-3, "{slope} {middle}: {lower} {upper}");
                assert!(lower - 0.02 <= truth && truth <= upper + 0.02, "{slope} {middle}: {lower} {truth} {upper}");
            }
        }
    }

    #[test]
    fn twisted_functions_are_enclosed_and_so_is_their_box() {
        let mut state = 3u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        };
        let cell = Aabb::new(DVec3::splat(-0.5), DVec3::splat(0.5));
        for _ in 0..200 {
            let c: [f64; 8] = std::array::from_fn(|_| random());
            let f = |p: DVec3| {
                c[0] + c[1] * p.x
                    + c[2] * p.y
                    + c[3] * p.z
                    + 0.3 * (c[4] * p.x * p.y + c[5] * p.y * p.z + c[6] * p.z * p.x + c[7] * p.x * p.y * p.z)
            };
            let linear = Linear::fit(&corners(f));
            let truth = counted(f);
            assert!(linear.surely_above(0.0) <= truth + 0.01 && truth <= linear.possibly_above(0.0) + 0.01);
            let bounds = linear.possible_box(&cell, 0.0);
            for i in 0..1000 {
                let p = DVec3::new(f64::from(i % 10), f64::from(i / 10 % 10), f64::from(i / 100)) / 9.0 - 0.5;
                assert!(f(p) <= 0.0 || bounds.is_some_and(|b| b.contains(p)), "{p} is not in {bounds:?}");
            }
        }
    }
}
