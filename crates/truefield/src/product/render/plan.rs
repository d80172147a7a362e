//! A scene made ready for one camera: camera coordinates, and which tile sees what.

use super::bins::Bins;
use super::camera::Lens;
use super::disc::{Ball, Disc, Side};
use super::facing::Facing;
use super::line::Line;
use super::scene::Scene;
use super::shade::{Light, facing, lit};
use super::tile::TILE;
use crate::error::Result;
use crate::geom::DVec3;
use crate::run::Run;

const BLOCK: usize = 1 << 14;

/// What a sample sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Seen {
    Nothing,
    /// Blended discs; their colour is kept beside.
    Splats,
    Triangle {
        layer: u16,
        element: u32,
    },
    Ball {
        layer: u16,
        element: u32,
    },
}

/// Light of a surface point, its highlight, and the cosine between its normal and the direction to the viewer.
pub(super) struct Look {
    pub light: Light,
    pub highlight: f32,
    pub cosine: f64,
}

pub(super) struct Plan<'a> {
    pub scene: &'a Scene,
    pub lens: Lens,
    /// Camera coordinates of the vertices of each triangle layer.
    vertices: Vec<Vec<DVec3>>,
    pub triangles: Vec<Bins>,
    pub splats: Vec<Bins>,
    pub balls: Vec<Bins>,
    pub lines: Vec<Line>,
    pub line_bins: Bins,
}

impl<'a> Plan<'a> {
    pub fn new(scene: &'a Scene, lens: Lens, run: &Run<'_>) -> Result<Self> {
        let tiles = [lens.width.div_ceil(TILE), lens.height.div_ceil(TILE)];
        let mut plan = Self {
            scene,
            lens,
            vertices: Vec::new(),
            triangles: Vec::new(),
            splats: Vec::new(),
            balls: Vec::new(),
            lines: Vec::new(),
            line_bins: Bins::sort(run, 0, tiles, |_| None)?,
        };
        for layer in &scene.triangles {
            let blocks = run.blocks("picture: place", layer.vertices.len().div_ceil(BLOCK), |block| {
                let end = ((block + 1) * BLOCK).min(layer.vertices.len());
                Ok(layer.vertices[block * BLOCK..end].iter().map(|&v| lens.camera_point(v)).collect::<Vec<_>>())
            })?;
            plan.vertices.push(blocks.concat());
        }
        for (index, layer) in scene.triangles.iter().enumerate() {
            let bins = Bins::sort(run, layer.triangles.len(), tiles, |t| Facing::bounds(plan.corners(index, t), &lens))?;
            plan.triangles.push(bins);
            let Some(ink) = layer.ink else { continue };
            for [a, b] in &layer.creases {
                let [a, b] = [a, b].map(|&v| plan.vertices[index][v as usize]);
                plan.lines.extend(Line::new(a, b, index as u32, ink.width, &lens));
            }
        }
        plan.line_bins = Bins::sort(run, plan.lines.len(), tiles, |index| Some(plan.lines[index].bounds(&lens)))?;
        for (index, layer) in scene.splats.iter().enumerate() {
            let bins = Bins::sort(run, layer.points.len(), tiles, |i| plan.disc(index, i).bounds(&lens))?;
            plan.splats.push(bins);
        }
        for (index, layer) in scene.balls.iter().enumerate() {
            let bins = Bins::sort(run, layer.centers.len(), tiles, |i| {
                let ball = plan.ball(index, i);
                lens.ball_bounds(ball.center, ball.radius)
            })?;
            plan.balls.push(bins);
        }
        Ok(plan)
    }

    /// Camera coordinates of a triangle.
    pub fn corners(&self, layer: usize, triangle: usize) -> [DVec3; 3] {
        self.scene.triangles[layer].triangles[triangle].map(|v| self.vertices[layer][v as usize])
    }

    /// The disc of a point.
    pub fn disc(&self, layer: usize, point: usize) -> Disc {
        let splats = &self.scene.splats[layer];
        let center = self.lens.camera_point(splats.points[point]);
        let toward = if self.lens.parallel() { DVec3::NEG_Z } else { (-center).normalize_or(DVec3::NEG_Z) };
        let [x, y, z] = splats.normals[point].map(f64::from);
        let normal = self.lens.camera_vector(DVec3::new(x, y, z)).normalize_or(toward);
        Disc { center, normal: facing(normal, toward), radius: splats.radius }
    }

    /// Light of a disc.
    pub fn disc_light(&self, layer: usize, point: usize, disc: &Disc) -> Light {
        let splats = &self.scene.splats[layer];
        let toward = if self.lens.parallel() { DVec3::NEG_Z } else { (-disc.center).normalize_or(DVec3::NEG_Z) };
        let (light, highlight) = lit(splats.paint.element(point), disc.normal, toward, splats.finish);
        light.map(|c| c + highlight)
    }

    /// A ball in camera coordinates.
    pub fn ball(&self, layer: usize, element: usize) -> Ball {
        let balls = &self.scene.balls[layer];
        Ball { center: self.lens.camera_point(balls.centers[element]), radius: balls.radii[element] }
    }

    fn to_viewer(&self, x: f64, y: f64) -> DVec3 {
        let (_, direction) = self.lens.ray(x, y);
        -direction.normalize()
    }

    /// How a triangle looks at a pixel coordinate.
    pub fn triangle_look(&self, layer: usize, element: usize, setup: &Facing, x: f64, y: f64) -> Look {
        let triangles = &self.scene.triangles[layer];
        let at = setup.barycentric(x, y);
        let normals = triangles.normals[element];
        let blend = |axis: usize| (0..3).map(|corner| f64::from(normals[corner][axis]) * at[corner]).sum::<f64>();
        let toward = self.to_viewer(x, y);
        let blended = DVec3::new(blend(0), blend(1), blend(2));
        let smooth = self.lens.camera_vector(blended).normalize_or(toward);
        // The flat normal says which side is seen; a smoothed one may point away near the outline.
        let [a, b, c] = self.corners(layer, element);
        let flat = (b - a).cross(c - a);
        let aligned = if flat.dot(smooth) < 0.0 { -flat } else { flat };
        let normal = if aligned.dot(toward) < 0.0 { -smooth } else { smooth };
        let paint = triangles.paint.inside(element, triangles.triangles[element], &triangles.vertices, at, blended);
        let (light, highlight) = lit(paint, normal, toward, triangles.finish);
        Look { light, highlight, cosine: normal.dot(toward) }
    }

    /// How one side of a ball looks at a pixel coordinate that sees it.
    pub fn ball_look(&self, layer: usize, element: usize, side: Side, x: f64, y: f64) -> Look {
        let balls = &self.scene.balls[layer];
        let ball = self.ball(layer, element);
        let (origin, direction) = self.lens.ray(x, y);
        let depth = ball.depth(&self.lens, x, y, side);
        let toward = self.to_viewer(x, y);
        let normal = facing((origin + direction * depth - ball.center).normalize_or(toward), toward);
        let (light, highlight) = lit(balls.paint.element(element), normal, toward, balls.finish);
        Look { light, highlight, cosine: normal.dot(toward) }
    }
}
