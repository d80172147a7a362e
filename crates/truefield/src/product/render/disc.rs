//! A point of a surface drawn as a disc, and a ball: coverage and depth.

use super::camera::Lens;
use super::tile::{Area, Pattern};
use crate::geom::DVec3;

/// A disc in camera coordinates (a surface splat: Rusinkiewicz and Levoy 2000; Zwicker et al. 2001).
pub(super) struct Disc {
    pub center: DVec3,
    /// Unit normal on the viewer's side.
    pub normal: DVec3,
    pub radius: f64,
}

impl Disc {
    /// Pixel rectangle around the disc.
    pub fn bounds(&self, lens: &Lens) -> Option<[f64; 4]> {
        if !lens.parallel() {
            return lens.ball_bounds(self.center, self.radius);
        }
        if self.center.z <= lens.near {
            return None;
        }
        let [x, y] = lens.pixel_of(self.center);
        let reach = |n: f64| self.radius * (1.0 - n * n).max(0.0).sqrt() / lens.pitch;
        let (dx, dy) = (reach(self.normal.x), reach(self.normal.y));
        Some([x - dx, y - dy, x + dx, y + dy])
    }

    /// Calls `visit(x, y, mask, depths, squared distance from the centre over squared radius)`.
    #[inline]
    pub fn cover<const N: usize>(
        &self,
        lens: &Lens,
        area: Area,
        pattern: &Pattern<N>,
        mut visit: impl FnMut(u32, u32, u32, &[f32; N], &[f32; N]),
    ) {
        let scale = 1.0 / (self.radius * self.radius);
        for y in area.y0..area.y1 {
            for x in area.x0..area.x1 {
                let mut depths = [0.0_f32; N];
                let mut reach = [0.0_f32; N];
                if lens.parallel() {
                    // Relative to the centre, so single precision is enough.
                    let (corner, _) = lens.ray(f64::from(x), f64::from(y));
                    let (u, v) = ((corner.x - self.center.x) as f32, (corner.y - self.center.y) as f32);
                    let (pitch, scale) = (lens.pitch as f32, scale as f32);
                    let (sx, sy) = ((-self.normal.x / self.normal.z) as f32, (-self.normal.y / self.normal.z) as f32);
                    let z = self.center.z as f32;
                    for k in 0..N {
                        let (du, dv) = (u + pattern.x[k] as f32 * pitch, v - pattern.y[k] as f32 * pitch);
                        let dz = sx * du + sy * dv;
                        depths[k] = z + dz;
                        reach[k] = (du * du + dv * dv + dz * dz) * scale;
                    }
                } else {
                    let height = self.normal.dot(self.center);
                    for k in 0..N {
                        let (_, d) = lens.ray(f64::from(x) + pattern.x[k], f64::from(y) + pattern.y[k]);
                        let depth = height / self.normal.dot(d);
                        depths[k] = depth as f32;
                        reach[k] = ((d * depth - self.center).length_squared() * scale) as f32;
                    }
                }
                let mut mask = 0;
                for k in 0..N {
                    mask |= u32::from((reach[k] <= 1.0) & (depths[k] > lens.near as f32)) << k;
                }
                if mask != 0 {
                    visit(x, y, mask, &depths, &reach);
                }
            }
        }
    }
}

/// Which side of a ball.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    Near,
    Far,
}

/// A ball in camera coordinates.
pub(super) struct Ball {
    pub center: DVec3,
    pub radius: f64,
}

impl Ball {
    /// Depth of one side along a pixel's ray; NaN where the ray misses.
    pub fn depth(&self, lens: &Lens, x: f64, y: f64, side: Side) -> f64 {
        let (o, d) = lens.ray(x, y);
        let (c, a) = (self.center - o, d.length_squared());
        let middle = c.dot(d) / a;
        let half = ((self.radius * self.radius - (c - d * middle).length_squared()) / a).sqrt();
        if side == Side::Near { middle - half } else { middle + half }
    }

    /// Calls `visit(x, y, mask, depths)` for every pixel of `area` with covered samples.
    pub fn cover<const N: usize>(
        &self,
        lens: &Lens,
        area: Area,
        pattern: &Pattern<N>,
        side: Side,
        mut visit: impl FnMut(u32, u32, u32, &[f32; N]),
    ) {
        for y in area.y0..area.y1 {
            for x in area.x0..area.x1 {
                let mut mask = 0;
                let mut depths = [0.0; N];
                for k in 0..N {
                    let depth = self.depth(lens, f64::from(x) + pattern.x[k], f64::from(y) + pattern.y[k], side);
                    depths[k] = depth as f32;
                    mask |= u32::from(depth > lens.near) << k;
                }
                if mask != 0 {
                    visit(x, y, mask, &depths);
                }
            }
        }
    }
}
