//! What is in a picture: triangles, points and balls, with their paint.

use super::crease;
use super::sampled::SurfaceSamples;
use crate::error::{Error, Result};
use crate::geom::{Aabb, DVec3};
use crate::mesh::TriangleMesh;

/// A colour as screens take it: red, green and blue, sRGB, 0 to 255.
pub type Rgb = [u8; 3];

/// Colours for values from `low` to `high`, evenly spaced; values beyond take the end colours, NaN takes grey.
#[derive(Clone, Debug)]
pub struct Ramp {
    /// At least two colours.
    pub colours: Vec<Rgb>,
    /// Value of the first colour.
    pub low: f64,
    /// Value of the last colour; above `low`.
    pub high: f64,
}

impl Ramp {
    fn check(&self) -> Result<()> {
        if self.colours.len() < 2 {
            return Err(Error::invalid("a colour ramp needs at least two colours"));
        }
        if !(self.low < self.high && self.low.is_finite() && self.high.is_finite()) {
            return Err(Error::invalid(format!("a colour ramp needs a finite range with low < high, not {} to {}", self.low, self.high)));
        }
        Ok(())
    }
}

/// How triangles, points or balls (the elements) are coloured.
#[derive(Clone, Debug)]
pub enum Paint {
    /// One colour for all.
    Uniform(Rgb),
    /// One colour per element.
    PerElement(Vec<Rgb>),
    /// One colour per vertex, interpolated; triangles only.
    PerVertex(Vec<Rgb>),
    /// One value per element, coloured by the ramp.
    ValuePerElement(Vec<f64>, Ramp),
    /// One value per vertex, interpolated and then coloured by the ramp; triangles only.
    ValuePerVertex(Vec<f64>, Ramp),
    /// One value per corner of each triangle, interpolated and then coloured by the ramp; triangles only.
    ValuePerCorner(Vec<[f64; 3]>, Ramp),
    /// Values at points of the surface, averaged where a pixel sees it and coloured by the ramp; triangles only.
    Sampled(SurfaceSamples, Ramp),
}

impl Paint {
    fn check(&self, what: &str, elements: usize, vertices: Option<usize>) -> Result<()> {
        let (given, expected, per) = match self {
            Self::Uniform(_) => return Ok(()),
            Self::PerElement(colours) => (colours.len(), Some(elements), "element"),
            Self::PerVertex(colours) => (colours.len(), vertices, "vertex"),
            Self::Sampled(_, ramp) => {
                ramp.check()?;
                return vertices
                    .map(drop)
                    .ok_or_else(|| Error::invalid(format!("{what} cannot be painted from samples; only triangles can")));
            }
            Self::ValuePerElement(values, ramp) => {
                ramp.check()?;
                (values.len(), Some(elements), "element")
            }
            Self::ValuePerVertex(values, ramp) => {
                ramp.check()?;
                (values.len(), vertices, "vertex")
            }
            Self::ValuePerCorner(values, ramp) => {
                ramp.check()?;
                (values.len(), vertices.map(|_| elements), "triangle")
            }
        };
        match expected {
            Some(expected) if expected == given => Ok(()),
            Some(expected) => Err(Error::invalid(format!("{what} need {expected} colours or values, one per {per}, not {given}"))),
            None => Err(Error::invalid(format!("{what} have no vertices; give them one colour or value per element"))),
        }
    }
}

/// How a surface answers light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finish {
    /// Light from everywhere, 0 to 1; occluded in corners.
    pub ambient: f32,
    /// Light from the lamps, 0 to 1.
    pub diffuse: f32,
    /// Strength of the highlight, 0 to 1.
    pub specular: f32,
    /// Sharpness of the highlight.
    pub shininess: f32,
}

impl Finish {
    /// Cast metal, plaster: form reads by light alone.
    pub const SATIN: Self = Self { ambient: 0.30, diffuse: 0.70, specular: 0.10, shininess: 24.0 };
    /// Flatter light, so that colours that mean numbers stay readable.
    pub const CHART: Self = Self { ambient: 0.52, diffuse: 0.48, specular: 0.04, shininess: 20.0 };
    /// A clear highlight.
    pub const POLISHED: Self = Self { ambient: 0.32, diffuse: 0.66, specular: 0.55, shininess: 60.0 };
}

/// Lines drawn on a triangle layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ink {
    /// Colour of the lines.
    pub colour: Rgb,
    /// 0 (invisible) to 1.
    pub opacity: f64,
    /// Width in pixels.
    pub width: f64,
}

/// Triangles of one paint and finish.
#[derive(Clone, Debug)]
pub struct Triangles {
    pub(super) vertices: Vec<DVec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) normals: Vec<[[f32; 3]; 3]>,
    pub(super) creases: Vec<[u32; 2]>,
    pub(super) paint: Paint,
    pub(super) finish: Finish,
    pub(super) opacity: f64,
    pub(super) ink: Option<Ink>,
}

/// Points drawn as round discs that face along their normals.
#[derive(Clone, Debug)]
pub struct Splats {
    pub(super) points: Vec<DVec3>,
    pub(super) normals: Vec<[f32; 3]>,
    pub(super) radius: f64,
    pub(super) paint: Paint,
    pub(super) finish: Finish,
}

/// Balls with a highlight.
#[derive(Clone, Debug)]
pub struct Balls {
    pub(super) centers: Vec<DVec3>,
    pub(super) radii: Vec<f64>,
    pub(super) paint: Paint,
    pub(super) finish: Finish,
    pub(super) opacity: f64,
}

/// The layers of a picture. Depth alone decides what hides what; the order of the layers does not matter.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    pub(super) triangles: Vec<Triangles>,
    pub(super) splats: Vec<Splats>,
    pub(super) balls: Vec<Balls>,
}

/// Sharper edges than this are shaded as edges and drawn as lines.
const CREASE_DEGREES: f64 = 32.0;

impl Scene {
    /// An empty scene.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a mesh.
    ///
    /// `opacity` 1 hides what lies behind; below 1 the triangles are thin sheets of tinted glass that
    /// let `1 - opacity` of the light through where they are seen face on, and less at grazing angles.
    /// Edges sharper than 32 degrees, and open ones, get lines where `ink` is given.
    pub fn add_mesh(&mut self, mesh: &TriangleMesh, paint: Paint, finish: Finish, opacity: f64, ink: Option<Ink>) -> Result<()> {
        paint.check("triangles", mesh.triangles().len(), Some(mesh.vertices().len()))?;
        check_opacity("triangles", opacity)?;
        if let Some(ink) = ink {
            check_opacity("lines", ink.opacity)?;
            if !(ink.width > 0.0 && ink.width <= 100.0) {
                return Err(Error::invalid(format!("the width of lines must lie between 0 and 100 pixels, not {}", ink.width)));
            }
        }
        let shape = crease::Shape::of(mesh.vertices(), mesh.triangles(), CREASE_DEGREES);
        self.triangles.push(Triangles {
            vertices: mesh.vertices().to_vec(),
            triangles: mesh.triangles().to_vec(),
            normals: shape.normals,
            creases: if ink.is_some() { shape.creases } else { Vec::new() },
            paint,
            finish,
            opacity,
            ink,
        });
        Ok(())
    }

    /// Adds points as discs of `radius` (model units) that face along `normals`, blended where they overlap.
    ///
    /// A radius of 0.7 to 1 times the distance of neighbouring points leaves no holes. Normals need no
    /// unit length; a normal of length zero makes a disc that faces the viewer.
    pub fn add_points(&mut self, points: Vec<DVec3>, normals: Vec<[f32; 3]>, radius: f64, paint: Paint, finish: Finish) -> Result<()> {
        paint.check("points", points.len(), None)?;
        if points.len() != normals.len() {
            return Err(Error::invalid(format!("{} points need as many normals, not {}", points.len(), normals.len())));
        }
        check_count("points", points.len())?;
        check_finite("point", &points)?;
        if let Some(index) = normals.iter().position(|n| !n.iter().all(|x| x.is_finite())) {
            return Err(Error::invalid(format!("the normal of point {index} is {:?}; all normals must be finite", normals[index])));
        }
        if !(radius > 0.0 && radius.is_finite()) {
            return Err(Error::invalid(format!("the radius of points must be a positive length, not {radius}")));
        }
        self.splats.push(Splats { points, normals, radius, paint, finish });
        Ok(())
    }

    /// Adds balls; `opacity` as for [`Scene::add_mesh`].
    pub fn add_balls(&mut self, centers: Vec<DVec3>, radii: Vec<f64>, paint: Paint, finish: Finish, opacity: f64) -> Result<()> {
        paint.check("balls", centers.len(), None)?;
        check_opacity("balls", opacity)?;
        if centers.len() != radii.len() {
            return Err(Error::invalid(format!("{} balls need as many radii, not {}", centers.len(), radii.len())));
        }
        check_count("balls", centers.len())?;
        check_finite("ball centre", &centers)?;
        if let Some(index) = radii.iter().position(|r| !(*r > 0.0 && r.is_finite())) {
            return Err(Error::invalid(format!("the radius of ball {index} is {}; it must be a positive length", radii[index])));
        }
        self.balls.push(Balls { centers, radii, paint, finish, opacity });
        Ok(())
    }

    /// The box of all that is in the scene; `None` for an empty scene.
    pub fn extent(&self) -> Option<Aabb> {
        let mut extent = Aabb::EMPTY;
        for layer in &self.triangles {
            extent = extent.union(Aabb::around(layer.triangles.iter().flatten().map(|&v| layer.vertices[v as usize])));
        }
        for layer in &self.splats {
            extent = extent.union(Aabb::around(layer.points.iter().copied()));
        }
        for layer in &self.balls {
            for (center, radius) in layer.centers.iter().zip(&layer.radii) {
                extent = extent.union(Aabb::new(*center, *center).grow(*radius));
            }
        }
        (extent.min.x <= extent.max.x).then_some(extent)
    }
}

fn check_opacity(what: &str, opacity: f64) -> Result<()> {
    if opacity > 0.0 && opacity <= 1.0 {
        return Ok(());
    }
    Err(Error::invalid(format!("the opacity of {what} must be above 0 and at most 1, not {opacity}")))
}

fn check_finite(what: &str, points: &[DVec3]) -> Result<()> {
    match points.iter().position(|p| !p.is_finite()) {
        Some(index) => Err(Error::invalid(format!("{what} {index} is {}; all coordinates must be finite numbers", points[index]))),
        None => Ok(()),
    }
}

fn check_count(what: &str, count: usize) -> Result<()> {
    if count < (1 << 31) { Ok(()) } else { Err(Error::invalid(format!("{count} {what} are too many for one picture; thin them out"))) }
}
