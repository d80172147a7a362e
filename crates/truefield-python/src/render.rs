//! `Scene` and `Camera`: pictures as arrays.

use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use truefield::product::render::{
    Background, Camera, Canvas, Finish, Ink, Paint, Picture, Projection, Ramp, Rgb, Samples, Scene, SurfaceSamples, View, covering_radius,
    render,
};
use truefield::{Aabb, Error, Result};

use crate::convert::{mesh, points as vectors};
use crate::door::{Threads, job, raise};

fn colours(array: &PyReadonlyArray2<'_, u8>) -> Result<Vec<Rgb>> {
    let view = array.as_array();
    if view.ncols() != 3 || view.nrows() == 0 {
        return Err(Error::invalid(format!("the colours have shape {:?}; give at least one row of red, green and blue", view.shape())));
    }
    Ok(view.rows().into_iter().map(|row| [row[0], row[1], row[2]]).collect())
}

/// Where colours or values sit, and the range of the ramp.
type Span = Option<(f64, f64)>;

fn paint(per: &str, colours_given: &PyReadonlyArray2<'_, u8>, values: Option<PyReadonlyArray1<'_, f64>>, span: Span) -> Result<Paint> {
    let colours = colours(colours_given)?;
    let Some(values) = values else {
        return match per {
            "whole" => Ok(Paint::Uniform(colours[0])),
            "element" => Ok(Paint::PerElement(colours)),
            "vertex" => Ok(Paint::PerVertex(colours)),
            _ => Err(Error::invalid(format!("colours go per whole, element or vertex, not per {per:?}"))),
        };
    };
    let (low, high) = span.ok_or_else(|| Error::invalid("values need the span of the colour ramp"))?;
    let ramp = Ramp { colours, low, high };
    let values: Vec<f64> = values.as_array().iter().copied().collect();
    match per {
        "element" => Ok(Paint::ValuePerElement(values, ramp)),
        "vertex" => Ok(Paint::ValuePerVertex(values, ramp)),
        "corner" if values.len().is_multiple_of(3) => {
            Ok(Paint::ValuePerCorner(values.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(), ramp))
        }
        _ => Err(Error::invalid(format!("values go per element, vertex or corner, not {} of them per {per:?}", values.len()))),
    }
}

fn finish(name: &str) -> Result<Finish> {
    match name {
        "satin" => Ok(Finish::SATIN),
        "chart" => Ok(Finish::CHART),
        "polished" => Ok(Finish::POLISHED),
        _ => Err(Error::invalid(format!("there is no finish called {name:?}; use satin, chart or polished"))),
    }
}

/// How many samples a pixel has.
pub fn samples(count: u32) -> PyResult<Samples> {
    match count {
        1 => Ok(Samples::One),
        9 => Ok(Samples::Nine),
        25 => Ok(Samples::TwentyFive),
        _ => Err(raise(Error::invalid(format!("a pixel takes 1, 9 or 25 samples, not {count}")))),
    }
}

type Pen = Option<((u8, u8, u8), f64, f64)>;

fn ink(pen: Pen) -> Option<Ink> {
    pen.map(|((r, g, b), opacity, width)| Ink { colour: [r, g, b], opacity, width })
}

/// Where the viewer stands.
#[pyclass(name = "Camera", module = "truefield._truefield", frozen)]
pub struct PyCamera(pub Camera);

#[pymethods]
impl PyCamera {
    #[new]
    #[pyo3(signature = (points, view = None, direction = None, up = None, field_of_view = None, margin = 0.06))]
    fn new(
        points: PyReadonlyArray2<'_, f64>,
        view: Option<&str>,
        direction: Option<(f64, f64, f64)>,
        up: Option<(f64, f64, f64)>,
        field_of_view: Option<f64>,
        margin: f64,
    ) -> PyResult<Self> {
        let points = vectors(&points)?;
        let make = || {
            let view = match direction {
                Some(direction) => View::Along { direction: direction.into(), up: up.unwrap_or((0.0, 0.0, 1.0)).into() },
                None => View::named(view.unwrap_or("isometric"))?,
            };
            let projection = field_of_view.map_or(Projection::Orthographic, |field_of_view| Projection::Perspective { field_of_view });
            Camera::fit(points, view, projection, margin)
        };
        make().map(Self).map_err(raise)
    }

    /// Unit vector into the scene.
    #[getter]
    fn forward(&self) -> (f64, f64, f64) {
        self.0.forward().into()
    }

    /// The point from which depth is measured.
    #[getter]
    fn eye(&self) -> (f64, f64, f64) {
        self.0.eye().into()
    }

    /// Width and height of the fitted points, in model units or, in perspective, at unit depth.
    #[getter]
    fn span(&self) -> (f64, f64) {
        self.0.span().into()
    }

    /// Pixel coordinates and depth (n, 3) of points; NaN behind the eye.
    fn project<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
        width: u32,
        height: u32,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let lens = self.0.lens(width, height);
        let points = vectors(&points)?;
        let pixels: Vec<f64> = points.iter().flat_map(|p| lens.pixel(*p).unwrap_or([f64::NAN; 3])).collect();
        pixels.into_pyarray(py).reshape([points.len(), 3])
    }
}

/// Triangles, points and balls to be drawn.
#[pyclass(name = "Scene", module = "truefield._truefield")]
pub struct PyScene(Scene);

type Corners<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>);
type Drawn<'py> = (Bound<'py, PyArray3<u8>>, Bound<'py, PyArray2<f32>>);

#[pymethods]
impl PyScene {
    #[new]
    fn new() -> Self {
        Self(Scene::new())
    }

    /// Adds a mesh: `colours` are the paint, or the ramp of `values`; `ink` is colour, opacity and width in pixels of its lines.
    #[pyo3(signature = (vertices, triangles, colours, per = "whole", values = None, span = None, finish = "satin", opacity = 1.0, ink = None))]
    fn add_mesh(
        &mut self,
        vertices: PyReadonlyArray2<'_, f64>,
        triangles: PyReadonlyArray2<'_, i64>,
        colours: PyReadonlyArray2<'_, u8>,
        per: &str,
        values: Option<PyReadonlyArray1<'_, f64>>,
        span: Span,
        finish: &str,
        opacity: f64,
        ink: Pen,
    ) -> PyResult<()> {
        let mesh = mesh(&vertices, &triangles)?;
        let add = || self.0.add_mesh(&mesh, paint(per, &colours, values, span)?, self::finish(finish)?, opacity, self::ink(ink));
        add().map_err(raise)
    }

    /// Adds a mesh whose colours come from values at points of it.
    #[pyo3(signature = (vertices, triangles, points, normals, values, colours, span, finish = "chart", ink = None))]
    #[allow(clippy::too_many_arguments)]
    fn add_sampled_mesh(
        &mut self,
        vertices: PyReadonlyArray2<'_, f64>,
        triangles: PyReadonlyArray2<'_, i64>,
        points: PyReadonlyArray2<'_, f64>,
        normals: PyReadonlyArray2<'_, f64>,
        values: PyReadonlyArray1<'_, f64>,
        colours: PyReadonlyArray2<'_, u8>,
        span: (f64, f64),
        finish: &str,
        ink: Pen,
    ) -> PyResult<()> {
        let mesh = mesh(&vertices, &triangles)?;
        let (points, normals) = (vectors(&points)?, vectors(&normals)?);
        let values: Vec<f64> = values.as_array().iter().copied().collect();
        let mut add = || {
            let ramp = Ramp { colours: self::colours(&colours)?, low: span.0, high: span.1 };
            let paint = Paint::Sampled(SurfaceSamples::new(&points, &normals, &values)?, ramp);
            self.0.add_mesh(&mesh, paint, self::finish(finish)?, 1.0, self::ink(ink))
        };
        add().map_err(raise)
    }

    /// Adds points as discs that face along their normals; without a radius it is taken from their distances.
    #[pyo3(signature = (points, normals, colours, per = "whole", values = None, span = None, finish = "satin", radius = None))]
    fn add_points(
        &mut self,
        points: PyReadonlyArray2<'_, f64>,
        normals: PyReadonlyArray2<'_, f64>,
        colours: PyReadonlyArray2<'_, u8>,
        per: &str,
        values: Option<PyReadonlyArray1<'_, f64>>,
        span: Span,
        finish: &str,
        radius: Option<f64>,
    ) -> PyResult<()> {
        let (points, normals) = (vectors(&points)?, vectors(&normals)?);
        let normals = normals.into_iter().map(|n| [n.x as f32, n.y as f32, n.z as f32]).collect();
        let add = || {
            let radius = match radius {
                Some(radius) => radius,
                None => covering_radius(&points)?,
            };
            self.0.add_points(points, normals, radius, paint(per, &colours, values, span)?, self::finish(finish)?)
        };
        add().map_err(raise)
    }

    /// Adds balls.
    #[pyo3(signature = (centers, radii, colours, per = "whole", values = None, span = None, finish = "polished", opacity = 1.0))]
    fn add_balls(
        &mut self,
        centers: PyReadonlyArray2<'_, f64>,
        radii: PyReadonlyArray1<'_, f64>,
        colours: PyReadonlyArray2<'_, u8>,
        per: &str,
        values: Option<PyReadonlyArray1<'_, f64>>,
        span: Span,
        finish: &str,
        opacity: f64,
    ) -> PyResult<()> {
        let centers = vectors(&centers)?;
        let add = || {
            self.0.add_balls(
                centers,
                radii.as_array().iter().copied().collect(),
                paint(per, &colours, values, span)?,
                self::finish(finish)?,
                opacity,
            )
        };
        add().map_err(raise)
    }

    /// Lower and upper corner of all that is in the scene; None for an empty scene.
    #[getter]
    fn extent<'py>(&self, py: Python<'py>) -> Option<Corners<'py>> {
        let Aabb { min, max } = self.0.extent()?;
        Some((PyArray1::from_slice(py, &min.to_array()), PyArray1::from_slice(py, &max.to_array())))
    }

    /// Draws: (height, width, 4) uint8 colours with straight opacity, and (height, width) float32 depths.
    #[pyo3(signature = (camera, width, height, samples = 9, background = None, occlusion = 0.0, threads = None, progress = None))]
    fn render<'py>(
        &self,
        py: Python<'py>,
        camera: &PyCamera,
        width: u32,
        height: u32,
        samples: u32,
        background: Option<(u8, u8, u8)>,
        occlusion: f64,
        threads: Option<Threads>,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Drawn<'py>> {
        let samples = self::samples(samples)?;
        let background = background.map_or(Background::Transparent, |(r, g, b)| Background::Colour([r, g, b]));
        let canvas = Canvas { width, height, samples, background, occlusion };
        let Picture { rgba, depth, .. } = job(py, threads, progress, |run| render(&self.0, &camera.0, &canvas, run))?;
        let (width, height) = (width as usize, height as usize);
        Ok((rgba.into_pyarray(py).reshape([height, width, 4])?, depth.into_pyarray(py).reshape([height, width])?))
    }
}
