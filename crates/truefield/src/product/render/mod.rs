//! Pictures without a display: a software renderer of triangles, glass, points and balls.
//!
//! Depth alone decides what hides what; transparent surfaces are sorted per sample, so they come out right
//! in any order and where they cross. The same bytes for any number of threads. No file formats and no text:
//! those are the caller's.

// The samples of a pixel are lanes of several arrays that run in step.
#![allow(clippy::needless_range_loop)]

mod bins;
mod camera;
mod crease;
mod disc;
mod draw;
mod facing;
mod field;
mod line;
mod occlusion;
mod plan;
mod sampled;
mod scene;
mod shade;
mod spacing;
mod tile;
mod visible;

pub use camera::{Camera, Lens, Projection, View};
pub use field::render_field;
pub use sampled::SurfaceSamples;
pub use scene::{Balls, Finish, Ink, Paint, Ramp, Rgb, Scene, Splats, Triangles};
pub use spacing::covering_radius;

use crate::error::{Error, Result};
use crate::run::Run;
use occlusion::Openness;
use plan::Plan;
use tile::{Area, Pattern, TILE};
use visible::Visible;

/// Samples per pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Samples {
    /// The pixel's centre alone; for tests and masks.
    One,
    /// Smooth edges.
    Nine,
    /// For print; three times the time of nine.
    TwentyFive,
}

/// What is behind the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Background {
    /// Opacity 0.
    Transparent,
    /// One opaque colour.
    Colour(Rgb),
}

/// Size and quality of a picture.
#[derive(Clone, Copy, Debug)]
pub struct Canvas {
    /// Pixels across, 1 to 16384.
    pub width: u32,
    /// Pixels down, 1 to 16384.
    pub height: u32,
    /// Samples per pixel.
    pub samples: Samples,
    /// What is behind the scene.
    pub background: Background,
    /// How much opaque surfaces darken where others are close: 0 (not at all) to 1.
    pub occlusion: f64,
}

/// A finished picture; rows from top to bottom.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Red, green, blue (sRGB) and opacity (straight, not multiplied in), 4 bytes a pixel.
    pub rgba: Vec<u8>,
    /// Depth in model units, along the camera's forward direction from its eye, of the nearest opaque surface
    /// at the pixel's centre; infinite where there is none. Glass has no depth.
    pub depth: Vec<f32>,
}

/// Largest side of a picture.
const LARGEST: u32 = 16_384;

/// How far surfaces darken each other, as a share of the scene's diagonal.
const NEIGHBOURHOOD: f64 = 0.06;

/// Draws the scene as the camera sees it.
///
/// Takes about 30 bytes per pixel, 8 bytes per element and 4 per element and tile of 32 x 32 pixels that
/// it touches. Raises [`Error::Invalid`] for a size of 0 or above 16384 and for an occlusion outside 0 to 1, and
/// [`Error::Memory`] where the tile lists would need more than 2 GiB.
pub fn render(scene: &Scene, camera: &Camera, canvas: &Canvas, run: &Run<'_>) -> Result<Picture> {
    check(canvas)?;
    let Canvas { width, height, .. } = *canvas;
    let plan = Plan::new(scene, camera.lens(width, height), run)?;
    let depth = depth_picture(&plan, run)?;
    let openness = match scene.extent() {
        Some(extent) if canvas.occlusion > 0.0 && depth.iter().any(|d| d.is_finite()) => {
            Some(Openness::estimate(&plan.lens, depth.clone(), NEIGHBOURHOOD * extent.diagonal(), canvas.occlusion, run)?)
        }
        _ => None,
    };
    let rgba = match canvas.samples {
        Samples::One => colours::<1>(&plan, openness.as_ref(), canvas.background, run),
        Samples::Nine => colours::<9>(&plan, openness.as_ref(), canvas.background, run),
        Samples::TwentyFive => colours::<25>(&plan, openness.as_ref(), canvas.background, run),
    }?;
    Ok(Picture { width, height, rgba, depth })
}

/// Refuses what cannot be drawn on.
fn check(canvas: &Canvas) -> Result<()> {
    let Canvas { width, height, .. } = *canvas;
    if !(1..=LARGEST).contains(&width) || !(1..=LARGEST).contains(&height) {
        return Err(Error::invalid(format!(
            "a picture of {width} x {height} pixels cannot be drawn; both sides must lie between 1 and {LARGEST}"
        )));
    }
    if !(0.0..=1.0).contains(&canvas.occlusion) {
        return Err(Error::invalid(format!("the occlusion must lie between 0 and 1, not {}", canvas.occlusion)));
    }
    Ok(())
}

fn tiles(plan: &Plan<'_>) -> usize {
    (plan.lens.width.div_ceil(TILE) * plan.lens.height.div_ceil(TILE)) as usize
}

fn depth_picture(plan: &Plan<'_>, run: &Run<'_>) -> Result<Vec<f32>> {
    let pattern = Pattern::<1>::new();
    let parts = run.blocks("picture: depth", tiles(plan), |tile| {
        let visible = Visible::resolve(plan, tile, &pattern);
        Ok((visible.area, visible.depth.into_iter().map(|[d]| d).collect::<Vec<_>>()))
    })?;
    Ok(assemble(&plan.lens, &parts, f32::INFINITY))
}

fn colours<const N: usize>(plan: &Plan<'_>, openness: Option<&Openness>, background: Background, run: &Run<'_>) -> Result<Vec<u8>> {
    let pattern = Pattern::<N>::new();
    let parts = run.blocks("picture: draw", tiles(plan), |tile| {
        let (area, pixels) = draw::draw(plan, tile, &pattern, openness)?;
        Ok((area, pixels.into_iter().map(|pixel| finish(pixel, background)).collect::<Vec<_>>()))
    })?;
    Ok(assemble(&plan.lens, &parts, [0; 4]).into_flattened())
}

/// Light times opacity over the background, as bytes.
fn finish([r, g, b, opacity]: [f32; 4], background: Background) -> [u8; 4] {
    match background {
        Background::Colour(colour) => {
            let under = shade::decode(colour);
            let over = |light: f32, channel: usize| shade::encode(light + (1.0 - opacity) * under[channel]);
            [over(r, 0), over(g, 1), over(b, 2), 255]
        }
        Background::Transparent if opacity <= 0.0 => [0; 4],
        Background::Transparent => {
            let [r, g, b] = [r, g, b].map(|light| shade::encode(light / opacity));
            [r, g, b, (255.0 * opacity.min(1.0) + 0.5) as u8]
        }
    }
}

fn assemble<T: Copy>(lens: &Lens, parts: &[(Area, Vec<T>)], empty: T) -> Vec<T> {
    let (width, height) = (lens.width as usize, lens.height as usize);
    let mut whole = vec![empty; width * height];
    for (area, part) in parts {
        let across = (area.x1 - area.x0) as usize;
        for (row, line) in part.chunks_exact(across).enumerate() {
            let start = (area.y0 as usize + row) * width + area.x0 as usize;
            whole[start..start + across].copy_from_slice(line);
        }
    }
    whole
}
