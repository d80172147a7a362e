//! A complete field as arrays, and back; the file around them is Python's.

use std::borrow::Cow;
use std::sync::Arc;

use numpy::{Element, IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use truefield::{CompleteField, DVec3, Error, Grid, Parts};

use crate::door::{Threads, job, raise};
use crate::field::{PyCompleteField, region};
use crate::surface::PySurface;

/// The lists of a field, by name, as fresh arrays.
#[pyfunction]
#[pyo3(name = "complete_field_parts", signature = (field, threads=None, progress=None))]
pub fn parts_of<'py>(
    py: Python<'py>,
    field: &PyCompleteField,
    threads: Option<Threads>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let parts = job(py, threads, progress, |run| field.0.to_parts(run))?;
    let out = PyDict::new(py);
    out.set_item("triangles", array(py, parts.triangles))?;
    out.set_item("triangle_counts", array(py, parts.triangle_counts))?;
    out.set_item("list_counts", array(py, parts.list_counts))?;
    out.set_item("ends", array(py, parts.ends))?;
    out.set_item("cells", array(py, parts.cells))?;
    out.set_item("wide_entries", array(py, parts.wide_entries))?;
    out.set_item("entries", array(py, parts.entries))?;
    out.set_item("varied", array(py, parts.varied))?;
    Ok(out)
}

/// The field that such arrays describe.
#[pyfunction]
#[pyo3(name = "complete_field_from_parts", signature = (surface, origin, cell_size, first, shape, region, parts, threads=None, progress=None))]
pub fn field_of(
    py: Python<'_>,
    surface: &PySurface,
    origin: [f64; 3],
    cell_size: f64,
    first: [i64; 3],
    shape: [u32; 3],
    region: &str,
    parts: &Bound<'_, PyDict>,
    threads: Option<Threads>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<PyCompleteField> {
    let grid = Grid { origin: DVec3::from_array(origin), spacing: cell_size, first, shape };
    let (surface, region) = (Arc::clone(&surface.0), self::region(region)?);
    let (triangles, triangle_counts, list_counts) =
        (named(parts, "triangles")?, named(parts, "triangle_counts")?, named(parts, "list_counts")?);
    let (ends, cells, wide_entries) = (named(parts, "ends")?, named(parts, "cells")?, named(parts, "wide_entries")?);
    let (entries, varied) = (named(parts, "entries")?, named(parts, "varied")?);
    let parts = Parts {
        triangles: items(&triangles)?,
        triangle_counts: items(&triangle_counts)?,
        list_counts: items(&list_counts)?,
        ends: items(&ends)?,
        cells: items(&cells)?,
        wide_entries: items(&wide_entries)?,
        entries: items(&entries)?,
        varied: items(&varied)?,
    };
    let field = job(py, threads, progress, |run| CompleteField::from_parts(surface, grid, region, &parts, run))?;
    Ok(PyCompleteField(Arc::new(field)))
}

/// The array of a part, which is not copied.
fn array<'py, T: Element + Clone>(py: Python<'py>, part: Cow<'static, [T]>) -> Bound<'py, PyArray1<T>> {
    part.into_owned().into_pyarray(py)
}

fn named<'py, T: Element>(parts: &Bound<'py, PyDict>, name: &str) -> PyResult<PyReadonlyArray1<'py, T>> {
    let wrong = || raise(Error::Format(format!("{name} must be an array of {} bits an item", 8 * size_of::<T>())));
    parts.get_item(name)?.and_then(|array| array.extract().ok()).ok_or_else(wrong)
}

fn items<'a, T: Element + Clone>(array: &'a PyReadonlyArray1<'_, T>) -> PyResult<Cow<'a, [T]>> {
    array.as_slice().map(Cow::Borrowed).map_err(|_| raise(Error::Format("the arrays of a field must be contiguous".into())))
}
