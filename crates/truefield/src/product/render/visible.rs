//! What each sample of a tile sees first: opaque triangles, balls and discs by depth.

use super::disc::Side;
use super::facing::Facing;
use super::plan::{Plan, Seen};
use super::tile::{Area, Pattern};

/// Discs blend with those behind them up to this many radii.
const BLEND: f64 = 2.5;

/// Nearest opaque surfaces of a tile, per pixel and sample.
pub(super) struct Visible<const N: usize> {
    pub area: Area,
    /// Infinite where nothing is seen.
    pub depth: Vec<[f32; N]>,
    pub seen: Vec<[Seen; N]>,
    /// Sums of weighted light and of weights of the discs; empty without discs.
    pub splats: Vec<[[f32; 4]; N]>,
}

impl<const N: usize> Visible<N> {
    /// Depth and identity of what is nearest.
    pub fn resolve(plan: &Plan<'_>, tile: usize, pattern: &Pattern<N>) -> Self {
        let area = Area::of_tile(tile, plan.lens.width, plan.lens.height);
        let mut visible =
            Self { area, depth: vec![[f32::INFINITY; N]; area.len()], seen: vec![[Seen::Nothing; N]; area.len()], splats: Vec::new() };
        visible.triangles(plan, tile, pattern);
        visible.balls(plan, tile, pattern);
        visible.splat_depth(plan, tile, pattern);
        visible
    }

    fn keep(&mut self, x: u32, y: u32, mask: u32, depths: &[f32; N], seen: Seen) {
        let pixel = self.area.index(x, y);
        let (depth, who) = (&mut self.depth[pixel], &mut self.seen[pixel]);
        for k in 0..N {
            if mask >> k & 1 == 1 && depths[k] < depth[k] {
                depth[k] = depths[k];
                who[k] = seen;
            }
        }
    }

    fn triangles(&mut self, plan: &Plan<'_>, tile: usize, pattern: &Pattern<N>) {
        for (layer, bins) in plan.triangles.iter().enumerate().filter(|(l, _)| plan.scene.triangles[*l].opacity >= 1.0) {
            for &element in bins.of(tile) {
                let corners = plan.corners(layer, element as usize);
                let (Some(setup), Some(bounds)) = (Facing::new(corners, &plan.lens), Facing::bounds(corners, &plan.lens)) else { continue };
                let seen = Seen::Triangle { layer: layer as u16, element };
                setup.cover(self.area.within(bounds), pattern, |x, y, mask, depths| self.keep(x, y, mask, depths, seen));
            }
        }
    }

    fn balls(&mut self, plan: &Plan<'_>, tile: usize, pattern: &Pattern<N>) {
        for (layer, bins) in plan.balls.iter().enumerate().filter(|(l, _)| plan.scene.balls[*l].opacity >= 1.0) {
            for &element in bins.of(tile) {
                let ball = plan.ball(layer, element as usize);
                let Some(bounds) = plan.lens.ball_bounds(ball.center, ball.radius) else { continue };
                let seen = Seen::Ball { layer: layer as u16, element };
                ball.cover(&plan.lens, self.area.within(bounds), pattern, Side::Near, |x, y, mask, depths| {
                    self.keep(x, y, mask, depths, seen);
                });
            }
        }
    }

    fn splat_depth(&mut self, plan: &Plan<'_>, tile: usize, pattern: &Pattern<N>) {
        for (layer, bins) in plan.splats.iter().enumerate() {
            for &element in bins.of(tile) {
                let disc = plan.disc(layer, element as usize);
                let Some(bounds) = disc.bounds(&plan.lens) else { continue };
                disc.cover(&plan.lens, self.area.within(bounds), pattern, |x, y, mask, depths, _| {
                    self.keep(x, y, mask, depths, Seen::Splats);
                });
            }
        }
    }

    /// Blends the light of all discs close behind the nearest one, heavier near their centres: where a disc sticks out
    /// over a sharp edge, the surface behind it outweighs its rim.
    pub fn blend_splats(&mut self, plan: &Plan<'_>, tile: usize, pattern: &Pattern<N>) {
        if plan.splats.iter().all(|bins| bins.of(tile).is_empty()) {
            return;
        }
        let mut sums = vec![[[0.0_f32; 4]; N]; self.area.len()];
        for (layer, bins) in plan.splats.iter().enumerate() {
            let reach = (BLEND * plan.scene.splats[layer].radius) as f32;
            for &element in bins.of(tile) {
                let disc = plan.disc(layer, element as usize);
                let Some(bounds) = disc.bounds(&plan.lens) else { continue };
                let mut light = None;
                disc.cover(&plan.lens, self.area.within(bounds), pattern, |x, y, mask, depths, away| {
                    let pixel = self.area.index(x, y);
                    for k in 0..N {
                        if mask >> k & 1 == 1 && self.seen[pixel][k] == Seen::Splats && depths[k] <= self.depth[pixel][k] + reach {
                            let [r, g, b] = *light.get_or_insert_with(|| plan.disc_light(layer, element as usize, &disc));
                            let weight = (1.0 - away[k]).powi(2).max(1e-4);
                            let sum = &mut sums[pixel][k];
                            sum[0] += r * weight;
                            sum[1] += g * weight;
                            sum[2] += b * weight;
                            sum[3] += weight;
                        }
                    }
                });
            }
        }
        self.splats = sums;
    }
}
