//! Makers of shapes: primitives, and what is made of several.

use std::sync::Arc;

use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use truefield::source::csg::{self, Exact, Placement};
use truefield::{DVec3, Result, Source};

use crate::convert::points;
use crate::door::{Threads, job, raise};
use crate::shape::PyShape;

#[pyfunction]
pub fn sphere(radius: f64, center: [f64; 3]) -> PyResult<PyShape> {
    made(csg::Sphere::new(DVec3::from_array(center), radius))
}

#[pyfunction]
pub fn cuboid(size: [f64; 3], radius: f64, center: [f64; 3]) -> PyResult<PyShape> {
    made(csg::Cuboid::rounded(DVec3::from_array(center), DVec3::from_array(size), radius))
}

#[pyfunction]
pub fn capsule(start: [f64; 3], end: [f64; 3], radius: f64) -> PyResult<PyShape> {
    made(csg::Capsule::new(DVec3::from_array(start), DVec3::from_array(end), radius))
}

#[pyfunction]
pub fn half_space(point: [f64; 3], normal: [f64; 3]) -> PyResult<PyShape> {
    made(csg::HalfSpace::new(DVec3::from_array(point), DVec3::from_array(normal)))
}

#[pyfunction]
pub fn frustum(bottom: f64, top: f64, height: f64, axis: [f64; 3], center: [f64; 3]) -> PyResult<PyShape> {
    along(csg::Frustum::new(bottom, top, height), axis, center)
}

#[pyfunction]
pub fn torus(major: f64, minor: f64, axis: [f64; 3], center: [f64; 3]) -> PyResult<PyShape> {
    along(csg::Torus::new(major, minor), axis, center)
}

#[pyfunction]
pub fn ellipsoid(axes: [f64; 3], center: [f64; 3]) -> PyResult<PyShape> {
    along(csg::Ellipsoid::new(DVec3::from_array(axes)), [0.0, 0.0, 1.0], center)
}

#[pyfunction]
pub fn menger_sponge(level: u32, size: f64, center: [f64; 3]) -> PyResult<PyShape> {
    along(csg::Sponge::new(level, size), [0.0, 0.0, 1.0], center)
}

#[pyfunction]
pub fn molecule(centers: PyReadonlyArray2<'_, f64>, radii: PyReadonlyArray1<'_, f64>, sharpness: f64) -> PyResult<PyShape> {
    let radii = radii.as_slice().map_err(|_| raise(truefield::Error::invalid("radii must be C-contiguous")))?;
    made(csg::Molecule::new(points(&centers)?, radii.to_vec(), sharpness))
}

#[pyfunction]
pub fn union_of(py: Python<'_>, shapes: Vec<PyRef<'_, PyShape>>) -> PyResult<PyShape> {
    let shapes = sources(&shapes);
    job(py, Some(Threads::ONE), None, |_| csg::Union::new(shapes)).map(PyShape::of)
}

#[pyfunction]
pub fn intersection_of(py: Python<'_>, shapes: Vec<PyRef<'_, PyShape>>) -> PyResult<PyShape> {
    let shapes = sources(&shapes);
    job(py, Some(Threads::ONE), None, |_| csg::intersection(&shapes)).map(PyShape::of)
}

#[pyfunction]
pub fn difference_of(py: Python<'_>, shape: &PyShape, others: Vec<PyRef<'_, PyShape>>) -> PyResult<PyShape> {
    let others = sources(&others);
    job(py, Some(Threads::ONE), None, |_| csg::difference(&shape.0, &others)).map(PyShape::of)
}

#[pyfunction]
pub fn tube(path: PyReadonlyArray2<'_, f64>, radius: f64) -> PyResult<PyShape> {
    made(csg::tube(&points(&path)?, radius))
}

/// `turns` holds three rows for each pose: the columns of its rotation.
#[pyfunction]
pub fn sweep(tool: &PyShape, positions: PyReadonlyArray2<'_, f64>, turns: Option<PyReadonlyArray2<'_, f64>>) -> PyResult<PyShape> {
    let positions = points(&positions)?;
    let poses: Result<Vec<Placement>> = match turns {
        None => positions.into_iter().map(Placement::translate).collect(),
        Some(turns) => points(&turns)?.as_chunks::<3>().0.iter().zip(positions).map(|(&turn, at)| Placement::rigid(turn, at)).collect(),
    };
    made(poses.and_then(|poses| csg::sweep(&tool.0, &poses)))
}

fn made(shape: Result<impl Source + 'static>) -> PyResult<PyShape> {
    shape.map(PyShape::of).map_err(raise)
}

/// A shape around the z axis, turned to another one and moved; as it is where nothing changes.
fn along(shape: Result<impl Exact + 'static>, axis: [f64; 3], center: [f64; 3]) -> PyResult<PyShape> {
    let placement = Placement::along(DVec3::from_array(axis), DVec3::from_array(center)).map_err(raise)?;
    if placement == Placement::IDENTITY {
        return made(shape);
    }
    made(shape.and_then(|shape| csg::Placed::new(Arc::new(shape), placement)))
}

fn sources(shapes: &[PyRef<'_, PyShape>]) -> Vec<Arc<dyn Source>> {
    shapes.iter().map(|shape| Arc::clone(&shape.0)).collect()
}
