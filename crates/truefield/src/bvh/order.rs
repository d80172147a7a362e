//! Visiting scattered points so that neighbours follow each other.

use crate::geom::{Aabb, DVec3};

/// A permutation of points along a space-filling (Morton) curve.
pub(crate) struct Order(Vec<u32>);

const BITS: u32 = 10;

impl Order {
    /// Orders `points`; where those go that are not finite does not matter.
    pub fn along_curve(points: &[DVec3]) -> Self {
        let extent = Aabb::around(points.iter().copied().filter(|p| p.is_finite()));
        let cells = f64::from(1u32 << BITS);
        let scale = extent.size().max(DVec3::splat(f64::MIN_POSITIVE)).recip() * (cells * (1.0 - 1e-9));
        let key = |p: DVec3| {
            let q = (p - extent.min) * scale;
            let spread = |x: f64| spread_bits((x as u32).min((1 << BITS) - 1));
            spread(q.x) | spread(q.y) << 1 | spread(q.z) << 2
        };
        let mut pairs: Vec<(u32, u32)> = points.iter().enumerate().map(|(i, &p)| (key(p), i as u32)).collect();
        let mut other = vec![(0, 0); pairs.len()];
        for shift in [0, 10, 20] {
            pass(&pairs, &mut other, shift);
            std::mem::swap(&mut pairs, &mut other);
        }
        Self(pairs.into_iter().map(|(_, index)| index).collect())
    }

    pub fn indices(&self) -> &[u32] {
        &self.0
    }
}

/// One stable counting pass over ten bits.
fn pass(from: &[(u32, u32)], to: &mut [(u32, u32)], shift: u32) {
    let mut starts = [0usize; 1025];
    for (key, _) in from {
        starts[((key >> shift) & 1023) as usize + 1] += 1;
    }
    for i in 1..starts.len() {
        starts[i] += starts[i - 1];
    }
    for pair in from {
        let slot = &mut starts[((pair.0 >> shift) & 1023) as usize];
        to[*slot] = *pair;
        *slot += 1;
    }
}

/// Puts two zero bits after each of the ten lowest bits.
fn spread_bits(x: u32) -> u32 {
    let x = (x | x << 16) & 0x0300_00ff;
    let x = (x | x << 8) & 0x0300_f00f;
    let x = (x | x << 4) & 0x030c_30c3;
    (x | x << 2) & 0x0924_9249
}
