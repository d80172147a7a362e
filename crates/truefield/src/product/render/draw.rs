//! Colours of a tile: opaque surfaces shaded, sheets of glass and lines laid over them in order of depth.

use super::disc::Side;
use super::facing::Facing;
use super::occlusion::Openness;
use super::plan::{Look, Plan, Seen};
use super::shade::{Light, darken, decode, sheet_opacity};
use super::tile::{Area, Pattern};
use super::visible::Visible;
use crate::error::{Error, Result};

/// Something half transparent in a pixel.
struct Fragment<const N: usize> {
    depth: [f32; N],
    mask: u32,
    /// Light times opacity.
    light: Light,
    opacity: f32,
    /// Lines: two of them within this depth count once, so their joints are no darker. 0 for sheets.
    merge: f32,
    /// The pixel's fragment before this one.
    before: u32,
}

const NONE: u32 = u32::MAX;

/// Fragments of a tile that are in memory at a time; more make it go row by row.
const MOST: usize = 1 << 20;

/// Light times opacity, and opacity, of the pixels of a tile.
pub(super) fn draw<const N: usize>(
    plan: &Plan<'_>,
    tile: usize,
    pattern: &Pattern<N>,
    openness: Option<&Openness>,
) -> Result<(Area, Vec<[f32; 4]>)> {
    let mut visible = Visible::resolve(plan, tile, pattern);
    visible.blend_splats(plan, tile, pattern);
    let solid = solid(plan, &visible, pattern, openness);
    let mut pixels: Vec<[f32; 4]> = solid.iter().map(mean).collect();
    let area = visible.area;
    let mut rows = vec![(area.y0, area.y1)];
    while let Some((y0, y1)) = rows.pop() {
        match Fragments::gather(plan, tile, pattern, &visible, area.rows(y0, y1)) {
            Some(fragments) => fragments.lay_over(area, &solid, &mut pixels),
            None if y1 - y0 > 1 => rows.extend([(y0, (y0 + y1) / 2), ((y0 + y1) / 2, y1)]),
            None => {
                let size = size_of::<Fragment<N>>();
                return Err(Error::Memory {
                    what: "sorting the transparent layers of a row of pixels".into(),
                    needed: (2 * MOST * size) as u64,
                    allowed: (MOST * size) as u64,
                });
            }
        }
    }
    Ok((area, pixels))
}

fn mean<const N: usize>(samples: &[[f32; 4]; N]) -> [f32; 4] {
    let mut sum = [0.0; 4];
    for sample in samples {
        for channel in 0..4 {
            sum[channel] += sample[channel];
        }
    }
    sum.map(|s| s / N as f32)
}

/// Light and opacity (0 or 1) of the opaque surfaces, per sample; each surface is shaded once per pixel.
fn solid<const N: usize>(plan: &Plan<'_>, visible: &Visible<N>, pattern: &Pattern<N>, openness: Option<&Openness>) -> Vec<[[f32; 4]; N]> {
    let area = visible.area;
    let mut solid = vec![[[0.0; 4]; N]; area.len()];
    for y in area.y0..area.y1 {
        for x in area.x0..area.x1 {
            let pixel = area.index(x, y);
            let seen = &visible.seen[pixel];
            let mut todo = (0..N).fold(0_u32, |mask, k| mask | u32::from(seen[k] != Seen::Nothing) << k);
            while todo != 0 {
                let first = todo.trailing_zeros() as usize;
                let mask = (0..N).fold(0_u32, |mask, k| mask | u32::from(seen[k] == seen[first]) << k);
                todo &= !mask;
                let [dx, dy] = pattern.centroid(mask);
                let (px, py) = (f64::from(x) + dx, f64::from(y) + dy);
                let open = openness.map_or(1.0, |o| o.at(x, y, visible.depth[pixel][first]));
                let look = match seen[first] {
                    Seen::Nothing | Seen::Splats => None,
                    Seen::Triangle { layer, element } => {
                        let (layer, element) = (layer as usize, element as usize);
                        Facing::new(plan.corners(layer, element), &plan.lens)
                            .map(|setup| plan.triangle_look(layer, element, &setup, px, py))
                    }
                    Seen::Ball { layer, element } => Some(plan.ball_look(layer as usize, element as usize, Side::Near, px, py)),
                };
                for k in (0..N).filter(|k| mask >> k & 1 == 1) {
                    let light = match &look {
                        Some(look) => darken(look.light, open).map(|c| c + look.highlight),
                        None => {
                            let [r, g, b, weight] = visible.splats[pixel][k];
                            darken([r / weight, g / weight, b / weight], open)
                        }
                    };
                    solid[pixel][k] = [light[0], light[1], light[2], 1.0];
                }
            }
        }
    }
    solid
}

/// The transparent fragments of some rows of a tile, listed per pixel.
struct Fragments<const N: usize> {
    area: Area,
    last: Vec<u32>,
    list: Vec<Fragment<N>>,
}

impl<const N: usize> Fragments<N> {
    /// `None` where they are too many for the memory set aside.
    fn gather(plan: &Plan<'_>, tile: usize, pattern: &Pattern<N>, visible: &Visible<N>, area: Area) -> Option<Self> {
        let mut fragments = Self { area, last: vec![NONE; area.len()], list: Vec::new() };
        for (layer, bins) in plan.triangles.iter().enumerate().filter(|(l, _)| plan.scene.triangles[*l].opacity < 1.0) {
            let opacity = plan.scene.triangles[layer].opacity;
            for &element in bins.of(tile) {
                let corners = plan.corners(layer, element as usize);
                let (Some(setup), Some(bounds)) = (Facing::new(corners, &plan.lens), Facing::bounds(corners, &plan.lens)) else { continue };
                setup.cover(area.within(bounds), pattern, |x, y, mask, depths| {
                    let mask = in_front(visible, x, y, mask, depths);
                    if mask != 0 {
                        let [dx, dy] = pattern.centroid(mask);
                        let look = plan.triangle_look(layer, element as usize, &setup, f64::from(x) + dx, f64::from(y) + dy);
                        fragments.sheet(x, y, mask, depths, opacity, &look);
                    }
                });
                if fragments.list.len() > MOST {
                    return None;
                }
            }
        }
        for (layer, bins) in plan.balls.iter().enumerate().filter(|(l, _)| plan.scene.balls[*l].opacity < 1.0) {
            let opacity = plan.scene.balls[layer].opacity;
            for &element in bins.of(tile) {
                let ball = plan.ball(layer, element as usize);
                let Some(bounds) = plan.lens.ball_bounds(ball.center, ball.radius) else { continue };
                for side in [Side::Near, Side::Far] {
                    ball.cover(&plan.lens, area.within(bounds), pattern, side, |x, y, mask, depths| {
                        let mask = in_front(visible, x, y, mask, depths);
                        if mask != 0 {
                            let [dx, dy] = pattern.centroid(mask);
                            let look = plan.ball_look(layer, element as usize, side, f64::from(x) + dx, f64::from(y) + dy);
                            fragments.sheet(x, y, mask, depths, opacity, &look);
                        }
                    });
                }
                if fragments.list.len() > MOST {
                    return None;
                }
            }
        }
        for &index in plan.line_bins.of(tile) {
            let line = &plan.lines[index as usize];
            let Some(ink) = plan.scene.triangles[line.ink as usize].ink else { continue };
            let opacity = ink.opacity as f32;
            let light = decode(ink.colour).map(|c| c * opacity);
            line.cover(&plan.lens, area.within(line.bounds(&plan.lens)), pattern, |x, y, mask, depths| {
                let mask = in_front(visible, x, y, mask, depths);
                if mask != 0 {
                    let merge = 2.0 * line.lift(&plan.lens, f64::from(depths[Pattern::<N>::MIDDLE])) as f32;
                    fragments.push(x, y, Fragment { depth: *depths, mask, light, opacity, merge, before: NONE });
                }
            });
            if fragments.list.len() > MOST {
                return None;
            }
        }
        Some(fragments)
    }

    fn push(&mut self, x: u32, y: u32, mut fragment: Fragment<N>) {
        let last = &mut self.last[self.area.index(x, y)];
        fragment.before = *last;
        *last = self.list.len() as u32;
        self.list.push(fragment);
    }

    fn sheet(&mut self, x: u32, y: u32, mask: u32, depths: &[f32; N], face_on: f64, look: &Look) {
        let tint = sheet_opacity(face_on, look.cosine);
        // The highlight lies on the sheet and hides what is behind it.
        let shine = look.highlight.clamp(0.0, 1.0);
        let light = look.light.map(|c| c * tint * (1.0 - shine) + shine);
        let opacity = tint + (1.0 - tint) * shine;
        self.push(x, y, Fragment { depth: *depths, mask, light, opacity, merge: 0.0, before: NONE });
    }

    /// Composites every sample's fragments from front to back over the opaque surfaces.
    fn lay_over(&self, tile: Area, solid: &[[[f32; 4]; N]], pixels: &mut [[f32; 4]]) {
        let mut order: Vec<(f32, u32)> = Vec::new();
        for y in self.area.y0..self.area.y1 {
            for x in self.area.x0..self.area.x1 {
                let last = self.last[self.area.index(x, y)];
                if last == NONE {
                    continue;
                }
                let pixel = tile.index(x, y);
                let mut samples = solid[pixel];
                for (k, sample) in samples.iter_mut().enumerate() {
                    order.clear();
                    let mut index = last;
                    while index != NONE {
                        let fragment = &self.list[index as usize];
                        if fragment.mask >> k & 1 == 1 {
                            order.push((fragment.depth[k], index));
                        }
                        index = fragment.before;
                    }
                    order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                    *sample = self.composite(&order, *sample);
                }
                pixels[pixel] = mean(&samples);
            }
        }
    }

    fn composite(&self, order: &[(f32, u32)], solid: [f32; 4]) -> [f32; 4] {
        let mut sum = [0.0_f32; 4];
        let mut through = 1.0_f32;
        let mut line = f32::NEG_INFINITY;
        let mut add = |light: Light, opacity: f32| {
            for channel in 0..3 {
                sum[channel] += through * light[channel];
            }
            sum[3] += through * opacity;
            through *= 1.0 - opacity;
        };
        for &(depth, index) in order {
            let fragment = &self.list[index as usize];
            if fragment.merge > 0.0 {
                if depth - line < fragment.merge {
                    continue;
                }
                line = depth;
            }
            add(fragment.light, fragment.opacity);
        }
        add([solid[0], solid[1], solid[2]], solid[3]);
        sum
    }
}

/// The samples of a mask that no opaque surface hides.
fn in_front<const N: usize>(visible: &Visible<N>, x: u32, y: u32, mask: u32, depths: &[f32; N]) -> u32 {
    let solid = &visible.depth[visible.area.index(x, y)];
    (0..N).fold(0, |kept, k| kept | (mask >> k & 1 & u32::from(depths[k] < solid[k])) << k)
}
