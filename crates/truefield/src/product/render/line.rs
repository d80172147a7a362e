//! Lines along sharp edges, of constant width in pixels.

use super::camera::Lens;
use super::tile::{Area, Pattern};
use crate::geom::DVec3;

/// A piece of a line in camera coordinates, all of it before the eye.
pub(super) struct Line {
    pub from: DVec3,
    pub to: DVec3,
    /// Which ink of the scene.
    pub ink: u32,
    /// Half the width in pixels.
    pub half: f64,
}

impl Line {
    /// Cut to what lies before the eye; `None` where nothing does.
    pub fn new(from: DVec3, to: DVec3, ink: u32, width: f64, lens: &Lens) -> Option<Self> {
        let near = 2.0 * lens.near;
        let cut = |inside: DVec3, outside: DVec3| inside + (outside - inside) * ((inside.z - near) / (inside.z - outside.z));
        let (from, to) = match (from.z > near, to.z > near) {
            (true, true) => (from, to),
            (true, false) => (from, cut(from, to)),
            (false, true) => (cut(to, from), to),
            (false, false) => return None,
        };
        Some(Self { from, to, ink, half: 0.5 * width })
    }

    /// Pixel rectangle around the line.
    pub fn bounds(&self, lens: &Lens) -> [f64; 4] {
        let ([ax, ay], [bx, by]) = (lens.pixel_of(self.from), lens.pixel_of(self.to));
        [ax.min(bx) - self.half, ay.min(by) - self.half, ax.max(bx) + self.half, ay.max(by) + self.half]
    }

    /// Calls `visit(x, y, mask, depths)` for every pixel of `area` with covered samples.
    pub fn cover<const N: usize>(&self, lens: &Lens, area: Area, pattern: &Pattern<N>, mut visit: impl FnMut(u32, u32, u32, &[f32; N])) {
        let ([ax, ay], [bx, by]) = (lens.pixel_of(self.from), lens.pixel_of(self.to));
        let (dx, dy) = (bx - ax, by - ay);
        let length_squared = dx * dx + dy * dy;
        let along = |x: f64, y: f64| {
            let s = if length_squared > 0.0 { (((x - ax) * dx + (y - ay) * dy) / length_squared).clamp(0.0, 1.0) } else { 0.0 };
            (s, (x - ax - s * dx).powi(2) + (y - ay - s * dy).powi(2))
        };
        // A long slanted line misses most tiles of its rectangle, and most pixels of a tile.
        let (wide, high) = (f64::from(area.x1 - area.x0), f64::from(area.y1 - area.y0));
        let (_, away) = along(f64::from(area.x0) + 0.5 * wide, f64::from(area.y0) + 0.5 * high);
        if away > (self.half + 0.5 * wide.hypot(high)).powi(2) {
            return;
        }
        for y in area.y0..area.y1 {
            for x in area.x0..area.x1 {
                let (_, away) = along(f64::from(x) + 0.5, f64::from(y) + 0.5);
                if away > (self.half + 0.75).powi(2) {
                    continue;
                }
                let mut mask = 0;
                let mut depths = [0.0; N];
                for k in 0..N {
                    let (s, away) = along(f64::from(x) + pattern.x[k], f64::from(y) + pattern.y[k]);
                    let depth = if lens.parallel() {
                        self.from.z + (self.to.z - self.from.z) * s
                    } else {
                        1.0 / (1.0 / self.from.z + (1.0 / self.to.z - 1.0 / self.from.z) * s)
                    };
                    depths[k] = (depth - self.lift(lens, depth)) as f32;
                    mask |= u32::from(away <= self.half * self.half) << k;
                }
                if mask != 0 {
                    visit(x, y, mask, &depths);
                }
            }
        }
    }

    /// Lines are drawn this much nearer than they are, or the faces beside them would bury half their width.
    pub fn lift(&self, lens: &Lens, depth: f64) -> f64 {
        (4.0 * self.half).max(2.0) * lens.pixel_size(depth)
    }
}
