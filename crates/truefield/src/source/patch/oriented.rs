//! Boxes turned to lie along a piece of a patch: thin where the piece is nearly flat.

use crate::geom::DVec3;

/// A box along three axes of its own that holds some points.
#[derive(Clone, Copy, Debug)]
pub(super) struct Oriented {
    center: DVec3,
    axes: [DVec3; 3],
    half: DVec3,
    /// The largest coordinate of the points.
    size: f64,
}

impl Oriented {
    /// Around points, and along the directions as far as they differ.
    pub(super) fn around(points: impl Iterator<Item = DVec3> + Clone, [u, v]: [DVec3; 2]) -> Self {
        let x = u.try_normalize().unwrap_or(DVec3::X);
        let across = x.cross(v);
        // Of directions that nearly agree the product is rounding.
        let z = if across.length() > 1e-6 * v.length() { across.normalize() } else { x.any_orthonormal_vector() };
        let axes = [x, z.cross(x), z];
        let local = |p: DVec3| DVec3::from_array(axes.map(|axis| axis.dot(p)));
        let (low, high) =
            points.clone().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(local(p)), high.max(local(p))));
        let middle = 0.5 * (low + high);
        let center = axes.iter().zip(middle.to_array()).map(|(&axis, along)| axis * along).sum();
        let size = points.fold(0.0_f64, |size, p| size.max(p.abs().max_element()));
        Self { center, axes, half: 0.5 * (high - low), size }
    }

    /// No more than the squared distance of `p` to what is in the box.
    #[inline(always)]
    pub(super) fn distance_squared(&self, p: DVec3) -> f64 {
        let way = p - self.center;
        let local = DVec3::new(self.axes[0].dot(way), self.axes[1].dot(way), self.axes[2].dot(way));
        // The axes are of unit length and across each other to a few units, the box as exact as its points.
        let rounding = 64.0 * f64::EPSILON * (self.size + p.abs().max_element());
        let distance = ((local.abs() - self.half).max(DVec3::ZERO).length() - rounding).max(0.0);
        distance * distance * (1.0 - 8.0 * f64::EPSILON)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laws::Random;

    #[test]
    fn no_point_in_the_box_is_nearer() {
        let mut random = Random::new(31);
        let mut thin = 0;
        for round in 0..20_000 {
            let size = random.length(1e-6, 1e6);
            let center = random.direction() * (size * random.length(1e-3, 1e6));
            let u = if round % 7 == 0 { DVec3::ZERO } else { random.direction() * size };
            let v = if round % 5 == 0 { u * random.between(-3.0, 3.0) } else { random.direction() * size };
            let points: Vec<DVec3> =
                (0..16).map(|_| center + u * random.unit() + v * random.unit() + random.direction() * (1e-3 * size)).collect();
            let around = Oriented::around(points.iter().copied(), [u, v]);
            for _ in 0..4 {
                let p = center + random.direction() * (size * random.length(1e-3, 1e3));
                // Anything between the points.
                let weights: Vec<f64> = points.iter().map(|_| random.unit()).collect();
                let inner: DVec3 = points.iter().zip(&weights).map(|(&q, &w)| q * w).sum::<DVec3>() / weights.iter().sum::<f64>();
                let least = points.iter().chain([&inner]).map(|&q| (p - q).length()).fold(f64::INFINITY, f64::min);
                let slack = 4.0 * f64::EPSILON * (p.abs().max_element() + around.size);
                assert!(
                    around.distance_squared(p).sqrt() <= least + slack,
                    "{p}: {} is more than {least}",
                    around.distance_squared(p).sqrt()
                );
                thin += usize::from(around.distance_squared(p).sqrt() > 0.9 * least);
            }
        }
        assert!(thin > 30_000, "{thin}");
    }
}
