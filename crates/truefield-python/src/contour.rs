//! Contours of a surface.

use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use truefield::Error;
use truefield::product::contour::{Placement, contour};

use crate::convert::{column, rows};
use crate::door::{Threads, job, raise};
use crate::surface::PySurface;

type Points<'py> = Bound<'py, PyArray2<f64>>;

/// The placement that a name stands for.
pub fn placement(name: &str) -> PyResult<Placement> {
    match name {
        "lattice" => Ok(Placement::Lattice),
        "projected" => Ok(Placement::Projected),
        _ => Err(raise(Error::invalid(format!("placement is {name:?}; choose \"lattice\" or \"projected\"")))),
    }
}

/// `(points, normals, triangle)` of the contour at signed `distance`.
#[pyfunction]
#[pyo3(name = "contour", signature = (surface, distance, tolerance, placement, memory, threads=None, progress=None))]
pub fn contour_of<'py>(
    py: Python<'py>,
    surface: &PySurface,
    distance: f64,
    tolerance: f64,
    placement: &str,
    memory: u64,
    threads: Option<Threads>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<(Points<'py>, Points<'py>, Bound<'py, PyArray1<i64>>)> {
    let placement = self::placement(placement)?;
    let found = job(py, threads, progress, |run| contour(&surface.0, distance, tolerance, placement, memory, run))?;
    let triangles = column(py, found.triangles.into_iter().map(i64::from));
    Ok((rows(py, found.points.into_iter())?, rows(py, found.normals.into_iter())?, triangles))
}
