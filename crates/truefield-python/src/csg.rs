//! Makers of shapes: primitives.

use pyo3::prelude::*;
use truefield::DVec3;
use truefield::source::csg;

use crate::door::raise;
use crate::shape::PyShape;

#[pyfunction]
pub fn sphere(radius: f64, center: [f64; 3]) -> PyResult<PyShape> {
    csg::Sphere::new(DVec3::from_array(center), radius).map(PyShape::of).map_err(raise)
}

#[pyfunction]
pub fn cuboid(size: [f64; 3], radius: f64, center: [f64; 3]) -> PyResult<PyShape> {
    csg::Cuboid::rounded(DVec3::from_array(center), DVec3::from_array(size), radius).map(PyShape::of).map_err(raise)
}
