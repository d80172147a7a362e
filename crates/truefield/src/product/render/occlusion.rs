//! Soft darkening where surfaces are close to each other, estimated from the depth picture
//! (scalable ambient obscurance: McGuire, Mara and Luebke 2012).

use super::camera::Lens;
use crate::error::Result;
use crate::geom::DVec3;
use crate::run::Run;

const SAMPLES: usize = 24;
const ROWS: usize = 8;
/// Half the width of the smoothing, in pixels: the pattern of sample directions repeats every four.
const REACH: i64 = 3;

/// How open the sky is over what each pixel's centre sees: 1 for a free surface, less in corners.
pub(super) struct Openness {
    width: i64,
    height: i64,
    depth: Vec<f32>,
    open: Vec<f32>,
}

impl Openness {
    /// From depths of pixel centres, row by row; `radius` (model units) is how far neighbours matter.
    pub fn estimate(lens: &Lens, depth: Vec<f32>, radius: f64, strength: f64, run: &Run<'_>) -> Result<Self> {
        let (width, height) = (i64::from(lens.width), i64::from(lens.height));
        let mut map = Self { width, height, depth, open: Vec::new() };
        let bands = (height as usize).div_ceil(ROWS);
        let band = |index: usize| (index * ROWS) as i64..(((index + 1) * ROWS) as i64).min(height);
        let raw = run.blocks("picture: shade", bands, |index| {
            Ok(band(index)
                .flat_map(|y| (0..width).map(move |x| (x, y)))
                .map(|(x, y)| map.obscurance(lens, x, y, radius))
                .collect::<Vec<_>>())
        })?;
        map.open = raw.concat();
        // Smoothed along rows, then along columns, where depth is alike.
        for axis in [[1, 0], [0, 1]] {
            let smooth = run.blocks("picture: shade", bands, |index| {
                Ok(band(index)
                    .flat_map(|y| (0..width).map(move |x| (x, y)))
                    .map(|(x, y)| map.smoothed(x, y, axis, radius as f32))
                    .collect::<Vec<_>>())
            })?;
            map.open = smooth.concat();
        }
        for open in &mut map.open {
            *open = 1.0 - strength as f32 * (1.0 - *open);
        }
        Ok(map)
    }

    /// Openness at a pixel for a surface at `depth`, taken from the neighbour whose depth is most alike.
    pub fn at(&self, x: u32, y: u32, depth: f32) -> f32 {
        let (x, y) = (i64::from(x), i64::from(y));
        let own = self.index(x, y);
        let (mut best, mut gap) = (self.open[own], (self.depth[own] - depth).abs());
        for (dx, dy) in [(-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, -1), (-1, 1), (1, 1)] {
            if self.holds(x + dx, y + dy) {
                let other = self.index(x + dx, y + dy);
                // Only clearly better neighbours: a smooth surface keeps its own.
                if (self.depth[other] - depth).abs() < 0.25 * gap {
                    gap = (self.depth[other] - depth).abs();
                    best = self.open[other];
                }
            }
        }
        best
    }

    fn holds(&self, x: i64, y: i64) -> bool {
        (0..self.width).contains(&x) && (0..self.height).contains(&y)
    }

    fn index(&self, x: i64, y: i64) -> usize {
        (y * self.width + x) as usize
    }

    fn point(&self, lens: &Lens, x: i64, y: i64) -> Option<DVec3> {
        if !self.holds(x, y) {
            return None;
        }
        let depth = f64::from(self.depth[self.index(x, y)]);
        let (origin, direction) = lens.ray(x as f64 + 0.5, y as f64 + 0.5);
        depth.is_finite().then(|| origin + direction * depth)
    }

    fn obscurance(&self, lens: &Lens, x: i64, y: i64, radius: f64) -> f32 {
        let Some(here) = self.point(lens, x, y) else { return 1.0 };
        // The flatter of the differences to both sides belongs to this surface.
        let slope = |dx: i64, dy: i64| {
            let ahead = self.point(lens, x + dx, y + dy).map(|p| p - here);
            let behind = self.point(lens, x - dx, y - dy).map(|p| here - p);
            match (ahead, behind) {
                (Some(a), Some(b)) => Some(if a.z.abs() < b.z.abs() { a } else { b }),
                (a, b) => a.or(b),
            }
        };
        let (Some(along), Some(down)) = (slope(1, 0), slope(0, 1)) else { return 1.0 };
        let Some(normal) = along.cross(down).try_normalize() else { return 1.0 };
        let normal = if normal.dot(here) > 0.0 && !lens.parallel() || normal.z > 0.0 && lens.parallel() { -normal } else { normal };
        let reach = radius / lens.pixel_size(here.z);
        if reach < 1.5 {
            return 1.0;
        }
        // Rays of a spiral, turned from pixel to pixel in a pattern of 4 x 4.
        let turn = f64::from(((x & 3) * 4 + (y & 3)) as u8 * 7 % 16) / 16.0;
        let bias = 0.01 * radius + 0.5 * lens.pixel_size(here.z);
        let mut sum = 0.0;
        for k in 0..SAMPLES {
            let share = (k as f64 + 0.5 + turn * 0.9) / SAMPLES as f64;
            let angle = std::f64::consts::TAU * (share * 7.0 + turn);
            let distance = reach * share.min(1.0);
            let (sin, cos) = angle.sin_cos();
            let Some(p) = self.point(lens, x + (cos * distance).round() as i64, y + (sin * distance).round() as i64) else { continue };
            let v = p - here;
            let squared = v.length_squared();
            let falloff = (1.0 - squared / (radius * radius)).max(0.0);
            sum += falloff * falloff * falloff * (v.dot(normal) - bias).max(0.0) / (squared.sqrt() + 0.02 * radius);
        }
        (1.0 - 4.0 * sum / SAMPLES as f64).max(0.0) as f32
    }

    fn smoothed(&self, x: i64, y: i64, [dx, dy]: [i64; 2], radius: f32) -> f32 {
        let own = self.index(x, y);
        if !self.depth[own].is_finite() {
            return 1.0;
        }
        let (mut sum, mut weights) = (0.0, 0.0);
        for step in -REACH..=REACH {
            let (px, py) = (x + dx * step, y + dy * step);
            if self.holds(px, py) {
                let other = self.index(px, py);
                let gap = (self.depth[other] - self.depth[own]).abs() / (0.15 * radius);
                let weight = (1.0 - gap).max(0.0);
                sum += weight * if weight > 0.0 { self.open[other] } else { 0.0 };
                weights += weight;
            }
        }
        sum / weights
    }
}
