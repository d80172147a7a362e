//! What people want from adaptive fields: rays, surfaces, contact, pictures.

use std::sync::Arc;

use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;
use truefield::product::collide::{Contact, collide};
use truefield::product::dual;
use truefield::product::nearest::nearest;
use truefield::product::raycast::Method;
use truefield::product::render::{Background, Canvas, Finish, render_field};
use truefield::{Aabb, Distance, Error};

use crate::adaptive::PyAdaptiveField;
use crate::convert::{column, flat_rows, points, rows};
use crate::door::{Threads, job, raise};
use crate::render::{PyCamera, samples};
use crate::shape::PyShape;

type Floats<'py> = Bound<'py, PyArray1<f64>>;
type Rows<'py> = Bound<'py, PyArray2<f64>>;
type MeshArrays<'py> = (Rows<'py>, Bound<'py, PyArray2<i64>>, [f64; 3], [f64; 3]);

fn method(name: &str) -> PyResult<Method> {
    match name {
        "linear" => Ok(Method::Linear),
        "cubic" => Ok(Method::Cubic),
        _ => Err(raise(Error::invalid(format!("method is {name:?}; choose \"linear\" or \"cubic\"")))),
    }
}

/// `(distance, point, normal)` of what rays meet first.
#[pyfunction]
#[pyo3(name = "cast_rays", signature = (field, origins, directions, method, distance, threads=None, progress=None))]
pub fn cast_rays<'py>(
    py: Python<'py>,
    field: &PyAdaptiveField,
    origins: PyReadonlyArray2<'py, f64>,
    directions: PyReadonlyArray2<'py, f64>,
    method: &str,
    distance: f64,
    threads: Option<Threads>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<(Floats<'py>, Rows<'py>, Rows<'py>)> {
    let (origins, directions, method) = (points(&origins)?, points(&directions)?, self::method(method)?);
    let hits = job(py, threads, progress, |run| field.caster(distance, run)?.cast(&origins, &directions, method, run))?;
    Ok((hits.distances.into_pyarray(py), flat_rows(py, hits.points)?, flat_rows(py, hits.normals)?))
}

/// Whether rays meet anything within a length.
#[pyfunction]
#[pyo3(name = "occluded_rays", signature = (field, origins, directions, length, method, distance, threads=None, progress=None))]
pub fn occluded_rays<'py>(
    py: Python<'py>,
    field: &PyAdaptiveField,
    origins: PyReadonlyArray2<'py, f64>,
    directions: PyReadonlyArray2<'py, f64>,
    length: f64,
    method: &str,
    distance: f64,
    threads: Option<Threads>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyArray1<bool>>> {
    let (origins, directions, method) = (points(&origins)?, points(&directions)?, self::method(method)?);
    let found = job(py, threads, progress, |run| field.caster(distance, run)?.occluded(&origins, &directions, length, method, run))?;
    Ok(column(py, found.into_iter()))
}

type Places<'py> = (Rows<'py>, Bound<'py, PyArray1<i64>>, Bound<'py, PyArray1<u8>>);

/// `(point, triangle, feature)`: where the surface is nearest; without a triangle -1 and 0.
#[pyfunction]
#[pyo3(name = "adaptive_nearest", signature = (field, points, threads=None, progress=None))]
pub fn adaptive_nearest<'py>(
    py: Python<'py>,
    field: &PyAdaptiveField,
    points: PyReadonlyArray2<'py, f64>,
    threads: Option<Threads>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Places<'py>> {
    let points = self::points(&points)?;
    let feet = job(py, threads, progress, |run| nearest(&field.field, &points, run))?;
    Ok((
        rows(py, feet.iter().map(|foot| foot.point))?,
        column(py, feet.iter().map(|foot| foot.on.map_or(-1, |(triangle, _)| i64::from(triangle)))),
        column(py, feet.iter().map(|foot| foot.on.map_or(0, |(_, feature)| feature.code()))),
    ))
}

/// `(vertices, triangles, lowest corner, highest corner)` of the surface at a distance.
#[pyfunction]
#[pyo3(name = "adaptive_surface", signature = (field, distance, shape, memory, threads=None, progress=None))]
pub fn adaptive_surface<'py>(
    py: Python<'py>,
    field: &PyAdaptiveField,
    distance: f64,
    shape: Option<&PyShape>,
    memory: u64,
    threads: Option<Threads>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<MeshArrays<'py>> {
    let shape = shape.map(|shape| Arc::clone(&shape.0));
    let mesh = job(py, threads, progress, |run| dual::surface(&field.field, distance, shape.as_deref(), memory, run))?;
    let Aabb { min, max } = mesh.extent();
    let triangles: Vec<i64> = mesh.triangles().iter().flatten().map(|&v| i64::from(v)).collect();
    let triangles = triangles.into_pyarray(py).reshape([mesh.triangles().len(), 3])?;
    Ok((rows(py, mesh.vertices().iter().copied())?, triangles, min.to_array(), max.to_array()))
}

/// Anything that answers distances.
fn solid(given: &Bound<'_, PyAny>) -> PyResult<Arc<dyn Distance>> {
    if let Ok(field) = given.cast::<PyAdaptiveField>() {
        return Ok(Arc::clone(&field.get().field) as Arc<dyn Distance>);
    }
    Ok(Arc::clone(&given.cast::<PyShape>()?.get().0) as Arc<dyn Distance>)
}

/// `(state, lower, upper, point on the first, point on the second, boxes)`.
type Found = (&'static str, f64, f64, [f64; 3], [f64; 3], usize);

/// How two solids lie to each other.
#[pyfunction]
#[pyo3(name = "collide", signature = (first, second, tolerance, budget, threads=None, progress=None))]
pub fn collide_solids(
    py: Python<'_>,
    first: &Bound<'_, PyAny>,
    second: &Bound<'_, PyAny>,
    tolerance: f64,
    budget: usize,
    threads: Option<Threads>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Found> {
    let (f, g) = (solid(first)?, solid(second)?);
    let shapes: Vec<_> = [first, second].iter().filter_map(|given| Some(Arc::clone(&given.cast::<PyShape>().ok()?.get().0))).collect();
    let found = job(py, threads, progress, |run| {
        let found = collide(&*f, &*g, tolerance, budget, run)?;
        // A shape that failed answers that nothing is known; its values say what it failed with.
        let mut values = [0.0; 2];
        shapes.iter().try_for_each(|shape| shape.values(&[found.first, found.second], &mut values))?;
        Ok(found)
    })?;
    let state = match found.contact {
        Contact::Separated => "separated",
        Contact::Penetrating => "penetrating",
        Contact::Undecided => "touching or undecided",
    };
    Ok((state, found.separation.lower, found.separation.upper, found.first.to_array(), found.second.to_array(), found.boxes))
}

/// Outermost corners of the cells that the surface at a distance meets.
#[pyfunction]
#[pyo3(name = "field_outline", signature = (field, distance, threads=None, progress=None))]
pub fn field_outline<'py>(
    py: Python<'py>,
    field: &PyAdaptiveField,
    distance: f64,
    threads: Option<Threads>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Rows<'py>> {
    rows(py, job(py, threads, progress, |run| field.caster(distance, run)?.outline(run))?.into_iter())
}

type Drawn<'py> = (Bound<'py, PyArray3<u8>>, Bound<'py, PyArray2<f32>>);

/// Draws a field by rays: (height, width, 4) uint8 colours with straight opacity, and (height, width) float32 depths.
#[pyfunction]
#[pyo3(name = "render_field", signature = (field, camera, width, height, colour, distance, samples = 9, background = None, occlusion = 0.0, threads = None, progress = None))]
pub fn draw_field<'py>(
    py: Python<'py>,
    field: &PyAdaptiveField,
    camera: &PyCamera,
    width: u32,
    height: u32,
    colour: (u8, u8, u8),
    distance: f64,
    samples: u32,
    background: Option<(u8, u8, u8)>,
    occlusion: f64,
    threads: Option<Threads>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Drawn<'py>> {
    let background = background.map_or(Background::Transparent, |(r, g, b)| Background::Colour([r, g, b]));
    let canvas = Canvas { width, height, samples: self::samples(samples)?, background, occlusion };
    let colour = [colour.0, colour.1, colour.2];
    let picture =
        job(py, threads, progress, |run| render_field(&*field.caster(distance, run)?, &camera.0, &canvas, colour, Finish::SATIN, run))?;
    let (width, height) = (width as usize, height as usize);
    Ok((picture.rgba.into_pyarray(py).reshape([height, width, 4])?, picture.depth.into_pyarray(py).reshape([height, width])?))
}
