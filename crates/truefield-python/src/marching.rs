//! Voxels of surfaces, and what marches through voxels.

use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use std::sync::Arc;
use truefield::build::difference::difference;
use truefield::build::march::march_sites;
use truefield::build::marched::sample_marched;
use truefield::build::voxelize::{Rule, voxelize};
use truefield::build::wavefront::wavefront;
use truefield::{DVec3, Error, Grid};

use crate::convert::column;
use crate::door::{Threads, job, raise};
use crate::sampled::PySampledField;
use crate::surface::PySurface;

type Sites<'py> = Bound<'py, PyArray1<u32>>;
type Singles<'py> = Bound<'py, PyArray1<f32>>;

/// `(marks, index, triangle, distance, doubtful)`.
type VoxelArrays<'py> = (Bound<'py, PyArray3<bool>>, Bound<'py, PyArray2<i64>>, Bound<'py, PyArray1<i64>>, Bound<'py, PyArray1<f64>>, u64);

/// Voxels of a surface by a rule; `origin` is the centre of the first.
#[pyfunction]
#[pyo3(name = "voxelize", signature = (surface, origin, spacing, shape, rule, memory, threads=None, progress=None))]
pub fn voxels_of<'py>(
    py: Python<'py>,
    surface: &PySurface,
    origin: [f64; 3],
    spacing: f64,
    shape: [u32; 3],
    rule: &str,
    memory: u64,
    threads: Option<Threads>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<VoxelArrays<'py>> {
    let rule = match rule {
        "conservative" => Rule::Conservative,
        "separating_6" => Rule::Separating6,
        "separating_26" => Rule::Separating26,
        "solid" => Rule::Solid,
        other => {
            let known = "\"conservative\", \"separating_6\", \"separating_26\" or \"solid\"";
            return Err(raise(Error::invalid(format!("the rule is {other:?}; choose {known}"))));
        }
    };
    let grid = Grid { origin: DVec3::from_array(origin) - 0.5 * spacing, spacing, first: [0; 3], shape };
    let found = job(py, threads, progress, |run| voxelize(&surface.0, &grid, rule, memory, run))?;
    let index: Vec<[i64; 3]> = found.near.iter().map(|near| found.index(near.voxel).map(|i| i as i64)).collect();
    Ok((
        found.marks.into_pyarray(py).reshape(shape.map(|n| n as usize))?,
        index.into_flattened().into_pyarray(py).reshape([found.near.len(), 3])?,
        column(py, found.near.iter().map(|near| i64::from(near.triangle))),
        column(py, found.near.iter().map(|near| near.distance)),
        found.doubtful,
    ))
}

/// The signed distances of a surface at the points of a lattice, carried on by a wavefront.
#[pyfunction]
#[pyo3(name = "sample_marched", signature = (surface, origin, spacing, shape, band, memory, threads=None, progress=None))]
pub fn marched_samples_of(
    py: Python<'_>,
    surface: &PySurface,
    origin: [f64; 3],
    spacing: f64,
    shape: [u32; 3],
    band: Option<f64>,
    memory: u64,
    threads: Option<Threads>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<PySampledField> {
    let lattice = Grid { origin: DVec3::from_array(origin), spacing, first: [0; 3], shape };
    Ok(PySampledField(Arc::new(job(py, threads, progress, |run| sample_marched(&surface.0, &lattice, band, memory, run))?)))
}

fn flat<'a, T: numpy::Element>(array: &'a PyReadonlyArray1<'_, T>) -> PyResult<&'a [T]> {
    array.as_slice().map_err(|_| raise(Error::invalid("sites must be C-contiguous")))
}

/// `(sites, distance, changed)` of a wavefront from the marked voxels.
#[pyfunction]
#[pyo3(name = "wavefront", signature = (sites, shape, sampling, memory, threads=None, progress=None))]
pub fn wavefront_from<'py>(
    py: Python<'py>,
    sites: PyReadonlyArray1<'py, bool>,
    shape: Vec<usize>,
    sampling: Vec<f64>,
    memory: u64,
    threads: Option<Threads>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<(Sites<'py>, Singles<'py>, Bound<'py, PyArray1<u64>>)> {
    let marks = flat(&sites)?;
    let found = job(py, threads, progress, |run| wavefront(&shape, &sampling, marks, f64::INFINITY, memory, run))?;
    Ok((found.sites.into_pyarray(py), found.distance.into_pyarray(py), found.changed.into_pyarray(py)))
}

/// `(sites, distance)` of a march in order of distance from the marked voxels.
#[pyfunction]
#[pyo3(name = "march", signature = (sites, shape, sampling, memory, progress=None))]
pub fn march_from<'py>(
    py: Python<'py>,
    sites: PyReadonlyArray1<'py, bool>,
    shape: Vec<usize>,
    sampling: Vec<f64>,
    memory: u64,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<(Sites<'py>, Singles<'py>)> {
    let marks = flat(&sites)?;
    let found = job(py, Some(Threads::ONE), progress, |run| march_sites(&shape, &sampling, marks, f64::INFINITY, memory, run))?;
    Ok((found.points.into_pyarray(py), found.distance.into_pyarray(py)))
}

/// `(voxels, largest)` by which marched sites are farther than exact ones.
#[pyfunction]
#[pyo3(name = "site_difference", signature = (marched, exact, shape, sampling, threads=None, progress=None))]
pub fn site_difference_of<'py>(
    py: Python<'py>,
    marched: PyReadonlyArray1<'py, u32>,
    exact: PyReadonlyArray1<'py, u32>,
    shape: Vec<usize>,
    sampling: Vec<f64>,
    threads: Option<Threads>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<(u64, f64)> {
    let (marched, exact) = (flat(&marched)?, flat(&exact)?);
    let found = job(py, threads, progress, |run| difference(&shape, &sampling, marched, exact, run))?;
    Ok((found.voxels, found.largest))
}
