//! A picture of an adaptively sampled field, ray by ray: no triangles between the field and the eye.

use super::camera::{Camera, Lens};
use super::occlusion::Openness;
use super::scene::{Finish, Rgb};
use super::shade::{darken, decode, facing, lit};
use super::tile::{Area, Pattern, TILE};
use super::{Canvas, NEIGHBOURHOOD, Picture, Samples, assemble, check, finish};
use crate::error::Result;
use crate::geom::{Aabb, DVec3};
use crate::product::raycast::{Caster, Hit, Method};
use crate::run::Run;

/// Draws the surface that a caster looks for, as the camera sees it: several rays a pixel, as the canvas' samples say.
///
/// Takes a ray for each sample and one more for each pixel. Refuses what [`super::render`] refuses of a canvas.
pub fn render_field(caster: &Caster, camera: &Camera, canvas: &Canvas, colour: Rgb, surface: Finish, run: &Run<'_>) -> Result<Picture> {
    check(canvas)?;
    let view = View { caster, lens: camera.lens(canvas.width, canvas.height), colour, surface };
    let depth = view.depth(run)?;
    let openness = if canvas.occlusion > 0.0 && depth.iter().any(|d| d.is_finite()) {
        let radius = NEIGHBOURHOOD * Aabb::around(caster.outline(run)?).diagonal();
        Some(Openness::estimate(&view.lens, depth.clone(), radius, canvas.occlusion, run)?)
    } else {
        None
    };
    let rgba = match canvas.samples {
        Samples::One => view.colours::<1>(openness.as_ref(), canvas, run),
        Samples::Nine => view.colours::<9>(openness.as_ref(), canvas, run),
        Samples::TwentyFive => view.colours::<25>(openness.as_ref(), canvas, run),
    }?;
    Ok(Picture { width: canvas.width, height: canvas.height, rgba, depth })
}

struct View<'a> {
    caster: &'a Caster,
    lens: Lens,
    colour: Rgb,
    surface: Finish,
}

impl View<'_> {
    fn tiles(&self) -> usize {
        (self.lens.width.div_ceil(TILE) * self.lens.height.div_ceil(TILE)) as usize
    }

    /// What a pixel coordinate sees, and the direction to the viewer in camera coordinates.
    fn look(&self, x: f64, y: f64) -> (Option<Hit>, DVec3) {
        let (origin, direction) = self.lens.ray(x, y);
        let toward = direction.normalize();
        let (from, along) = (self.lens.model_point(origin), self.lens.model_vector(toward));
        (self.caster.first(from, along, f64::INFINITY, Method::Cubic), -toward)
    }

    fn depth(&self, run: &Run<'_>) -> Result<Vec<f32>> {
        let parts = run.blocks("picture: depth", self.tiles(), |tile| {
            let area = Area::of_tile(tile, self.lens.width, self.lens.height);
            let mut depth = Vec::with_capacity(area.len());
            for y in area.y0..area.y1 {
                for x in area.x0..area.x1 {
                    let (hit, _) = self.look(f64::from(x) + 0.5, f64::from(y) + 0.5);
                    depth.push(hit.map_or(f32::INFINITY, |hit| self.lens.camera_point(hit.point).z as f32));
                }
            }
            Ok((area, depth))
        })?;
        Ok(assemble(&self.lens, &parts, f32::INFINITY))
    }

    fn colours<const N: usize>(&self, openness: Option<&Openness>, canvas: &Canvas, run: &Run<'_>) -> Result<Vec<u8>> {
        let pattern = Pattern::<N>::new();
        let base = decode(self.colour);
        let parts = run.blocks("picture: draw", self.tiles(), |tile| {
            let area = Area::of_tile(tile, self.lens.width, self.lens.height);
            let mut pixels = Vec::with_capacity(area.len());
            for y in area.y0..area.y1 {
                for x in area.x0..area.x1 {
                    let mut sum = [0.0; 4];
                    for k in 0..N {
                        let (hit, toward) = self.look(f64::from(x) + pattern.x[k], f64::from(y) + pattern.y[k]);
                        let Some(hit) = hit else { continue };
                        let depth = self.lens.camera_point(hit.point).z as f32;
                        let open = openness.map_or(1.0, |o| o.at(x, y, depth));
                        let normal = facing(self.lens.camera_vector(hit.normal), toward);
                        let (light, highlight) = lit(base, normal, toward, self.surface);
                        let light = darken(light, open).map(|c| c + highlight);
                        sum = [sum[0] + light[0], sum[1] + light[1], sum[2] + light[2], sum[3] + 1.0];
                    }
                    pixels.push(finish(sum.map(|s| s / N as f32), canvas.background));
                }
            }
            Ok((area, pixels))
        })?;
        Ok(assemble(&self.lens, &parts, [0; 4]).into_flattened())
    }
}
