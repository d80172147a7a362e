//! A triangle as pixels see it: edge functions, coverage and depth.

use super::camera::Lens;
use super::tile::{Area, Pattern};
use crate::geom::DVec3;

/// A triangle set up for coverage in pixel coordinates.
///
/// Edge functions are taken from homogeneous coordinates (Olano and Greer 1997), so a triangle that
/// reaches behind the eye needs no clipping. Neighbours compute exactly opposite values on their common
/// edge and a tie rule gives samples on it to one of them: no gaps, nothing drawn twice.
pub(super) struct Facing {
    edges: [DVec3; 3],
    /// Whether samples exactly on the edge belong to this triangle.
    owns: [bool; 3],
    /// Depth is `top / below`, both linear in the pixel.
    top: DVec3,
    below: DVec3,
    range: [f64; 2],
}

fn at(plane: DVec3, x: f64, y: f64) -> f64 {
    plane.x * x + plane.y * y + plane.z
}

impl Facing {
    /// From camera coordinates; `None` where the triangle is seen edge-on or is all behind the eye.
    pub fn new(corners: [DVec3; 3], lens: &Lens) -> Option<Self> {
        let depths = corners.map(|c| c.z);
        let furthest = depths[0].max(depths[1]).max(depths[2]);
        if furthest <= lens.near {
            return None;
        }
        let parallel = lens.parallel();
        let w = corners.map(|c| {
            let v = lens.raster_point(c);
            if parallel { DVec3::new(v.x, v.y, 1.0) } else { v }
        });
        let edges = [w[1].cross(w[2]), w[2].cross(w[0]), w[0].cross(w[1])];
        let volume = w[0].dot(edges[0]);
        if !volume.is_finite() || volume == 0.0 {
            return None;
        }
        let edges = edges.map(|e| e * volume.signum());
        let volume = volume.abs();
        let constant = DVec3::new(0.0, 0.0, volume);
        let (top, below) = if parallel {
            (edges[0] * depths[0] + edges[1] * depths[1] + edges[2] * depths[2], constant)
        } else {
            (constant, edges[0] + edges[1] + edges[2])
        };
        let owns = edges.map(|e| e.x > 0.0 || (e.x == 0.0 && e.y > 0.0));
        Some(Self { edges, owns, top, below, range: [depths[0].min(depths[1]).min(depths[2]).max(lens.near), furthest] })
    }

    /// Pixel rectangle around a triangle given in camera coordinates.
    pub fn bounds(corners: [DVec3; 3], lens: &Lens) -> Option<[f64; 4]> {
        let behind = corners.iter().filter(|c| c.z <= lens.near).count();
        if behind == 3 {
            return None;
        }
        if behind > 0 {
            return Some([0.0, 0.0, f64::from(lens.width), f64::from(lens.height)]);
        }
        let p = corners.map(|c| lens.pixel_of(c));
        let low = |axis: usize| p[0][axis].min(p[1][axis]).min(p[2][axis]);
        let high = |axis: usize| p[0][axis].max(p[1][axis]).max(p[2][axis]);
        Some([low(0), low(1), high(0), high(1)])
    }

    /// Calls `visit(x, y, mask, depths)` for every pixel of `area` with covered samples.
    pub fn cover<const N: usize>(&self, area: Area, pattern: &Pattern<N>, mut visit: impl FnMut(u32, u32, u32, &[f32; N])) {
        let all = (1_u32 << N) - 1;
        for y in area.y0..area.y1 {
            for x in area.x0..area.x1 {
                let (fx, fy) = (f64::from(x), f64::from(y));
                let mut mask = all;
                let mut partial = false;
                for e in &self.edges {
                    let corner = at(*e, fx, fy);
                    if corner + e.x.max(0.0) + e.y.max(0.0) < 0.0 {
                        mask = 0;
                        break;
                    }
                    partial |= corner + e.x.min(0.0) + e.y.min(0.0) <= 0.0;
                }
                if mask == 0 {
                    continue;
                }
                if partial {
                    for (e, owns) in self.edges.iter().zip(self.owns) {
                        let mut inside = 0;
                        for k in 0..N {
                            let value = at(*e, fx + pattern.x[k], fy + pattern.y[k]);
                            inside |= u32::from(value > 0.0 || (value == 0.0 && owns)) << k;
                        }
                        mask &= inside;
                    }
                    if mask == 0 {
                        continue;
                    }
                }
                let mut depths = [0.0; N];
                for k in 0..N {
                    let (sx, sy) = (fx + pattern.x[k], fy + pattern.y[k]);
                    // Slivers divide small by small; the corners bound what can come out.
                    depths[k] = (at(self.top, sx, sy) / at(self.below, sx, sy)).max(self.range[0]).min(self.range[1]) as f32;
                }
                visit(x, y, mask, &depths);
            }
        }
    }

    /// Barycentric coordinates of the point that a pixel coordinate sees.
    pub fn barycentric(&self, x: f64, y: f64) -> [f64; 3] {
        let weights = self.edges.map(|e| at(e, x, y).max(0.0));
        let sum = weights[0] + weights[1] + weights[2];
        if sum > 0.0 { weights.map(|w| w / sum) } else { [1.0 / 3.0; 3] }
    }
}
