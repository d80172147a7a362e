//! `thickness` and `walls_at`: the report on a part's thickness, as dictionaries of numbers and arrays.

use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use truefield::product::thickness::{Across, Extreme, HeavySection, Kind, Options, Sample, Sections, Statistics, Walls};
use truefield::{DVec3, product};

use crate::convert::{column, points, rows};
use crate::door::{Threads, job};
use crate::surface::PySurface;

type Point = (f64, f64, f64);

/// Diameters, kinds: 0 wall, 1 edge, 2 inner.
type WallArrays<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<u8>>);

fn point(p: DVec3) -> Point {
    p.into()
}

/// The parts of `truefield.ThicknessReport`, under the names that its `from_native` reads.
#[pyfunction]
#[pyo3(signature = (surface, tolerance, above=None, below=None, spacing=None, threads=None, progress=None))]
pub fn thickness<'py>(
    py: Python<'py>,
    surface: &PySurface,
    tolerance: f64,
    above: Option<f64>,
    below: Option<f64>,
    spacing: Option<f64>,
    threads: Option<Threads>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let options = Options { tolerance, above, below, spacing };
    let surface = &surface.0;
    let found = job(py, threads, progress, |run| product::thickness::thickness(surface, &options, run))?;
    let out = PyDict::new(py);
    let greatest = found.greatest;
    out.set_item("greatest_depth", (point(greatest.point), greatest.depth.lower, greatest.depth.upper))?;
    out.set_item("heavy", found.heavy.map(|heavy| sections(py, &heavy)).transpose()?)?;
    out.set_item("walls", walls(py, &found.walls)?)?;
    Ok(out)
}

/// Ball diameters and kinds at given places of the surface; NaN on inner faces.
#[pyfunction]
#[pyo3(signature = (surface, points, triangles, tolerance, largest, threads=None, progress=None))]
pub fn walls_at<'py>(
    py: Python<'py>,
    surface: &PySurface,
    points: PyReadonlyArray2<'py, f64>,
    triangles: PyReadonlyArray1<'py, i64>,
    tolerance: f64,
    largest: f64,
    threads: Option<Threads>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<WallArrays<'py>> {
    let triangles = triangles.as_array();
    let places: Vec<(DVec3, u32)> =
        self::points(&points)?.into_iter().zip(triangles.iter().map(|&t| u32::try_from(t).unwrap_or(u32::MAX))).collect();
    let surface = &surface.0;
    let samples = job(py, threads, progress, |run| product::thickness::walls_at(surface, &places, tolerance, largest, run))?;
    Ok((column(py, samples.iter().map(|s| diameter(s.sphere))), column(py, samples.iter().map(|s| code(s.kind)))))
}

fn sections<'py>(py: Python<'py>, heavy: &Sections) -> PyResult<Bound<'py, PyDict>> {
    let section = |s: &HeavySection| {
        let out = PyDict::new(py);
        out.set_item("point", point(s.point))?;
        out.set_item("depth", (s.depth.lower, s.depth.upper))?;
        out.set_item("volume", (s.volume.lower, s.volume.upper))?;
        out.set_item("box", (point(s.bounds.min), point(s.bounds.max)))?;
        out.set_item("centroid", point(s.centroid))?;
        out.set_item("certain", s.certain)?;
        Ok(out)
    };
    let out = PyDict::new(py);
    out.set_item("depth", heavy.depth)?;
    out.set_item("joined", heavy.joined)?;
    out.set_item("resolution", heavy.resolution)?;
    out.set_item("sections", heavy.sections.iter().map(section).collect::<PyResult<Vec<_>>>()?)?;
    Ok(out)
}

fn walls<'py>(py: Python<'py>, walls: &Walls) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    out.set_item("spacing", walls.spacing)?;
    out.set_item("area", walls.area)?;
    out.set_item("slack", walls.slack)?;
    out.set_item("edge", walls.edge)?;
    out.set_item("inner", walls.inner)?;
    out.set_item("missed", walls.missed)?;
    out.set_item("sphere", walls.sphere.as_ref().map(|s| statistics(py, s)).transpose()?)?;
    out.set_item("ray", walls.ray.as_ref().map(|s| statistics(py, s)).transpose()?)?;
    out.set_item("samples", samples(py, &walls.samples)?)?;
    Ok(out)
}

fn statistics<'py>(py: Python<'py>, s: &Statistics) -> PyResult<Bound<'py, PyDict>> {
    let extreme = |e: &Extreme| (e.thickness, point(e.point), e.triangle, point(e.opposite), e.opposite_triangle);
    let out = PyDict::new(py);
    out.set_item("samples", s.samples)?;
    out.set_item("area", s.area)?;
    out.set_item("minimum", extreme(&s.minimum))?;
    out.set_item("maximum", extreme(&s.maximum))?;
    out.set_item("mean", s.mean)?;
    out.set_item("median", s.median)?;
    out.set_item("percentiles", s.percentiles)?;
    out.set_item("share_above", s.share_above)?;
    out.set_item("share_below", s.share_below)?;
    Ok(out)
}

fn samples<'py>(py: Python<'py>, samples: &[Sample]) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    out.set_item("point", rows(py, samples.iter().map(|s| s.point))?)?;
    out.set_item("normal", rows(py, samples.iter().map(|s| s.normal))?)?;
    out.set_item("triangle", column(py, samples.iter().map(|s| i64::from(s.triangle))))?;
    out.set_item("area", column(py, samples.iter().map(|s| s.area)))?;
    out.set_item("kind", column(py, samples.iter().map(|s| code(s.kind))))?;
    out.set_item("thickness_sphere", column(py, samples.iter().map(|s| diameter(s.sphere))))?;
    out.set_item("thickness_ray", column(py, samples.iter().map(|s| diameter(s.ray))))?;
    out.set_item("slack", column(py, samples.iter().map(|s| s.slack)))?;
    Ok(out)
}

fn diameter(across: Option<Across>) -> f64 {
    across.map_or(f64::NAN, |across| across.thickness)
}

fn code(kind: Kind) -> u8 {
    match kind {
        Kind::Wall => 0,
        Kind::Edge => 1,
        Kind::Inner => 2,
    }
}
