//! Arrays to points and back.

use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;
use truefield::{DVec3, Error, TriangleMesh};

use crate::door::raise;

/// The rows of an (n, 3) array; the Python side has made it C-contiguous.
pub fn points(array: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<DVec3>> {
    let (rows, rest) = array.as_slice().map_err(|_| raise(Error::invalid("points must be C-contiguous")))?.as_chunks::<3>();
    if !rest.is_empty() {
        return Err(raise(Error::invalid("points must have shape (n, 3)")));
    }
    Ok(rows.iter().map(|&row| DVec3::from_array(row)).collect())
}

/// A mesh from (n, 3) float64 vertices and (m, 3) int64 triangles.
pub fn mesh(vertices: &PyReadonlyArray2<'_, f64>, triangles: &PyReadonlyArray2<'_, i64>) -> PyResult<TriangleMesh> {
    let vertices = points(vertices)?;
    let rows = triangles.as_slice().map_err(|_| raise(Error::invalid("triangles must be C-contiguous")))?.as_chunks::<3>().0;
    let triangles = rows.iter().map(|row| row.map(|v| u32::try_from(v).unwrap_or(u32::MAX))).collect();
    TriangleMesh::new(vertices, triangles).map_err(raise)
}

/// An (n, 3) float64 array.
pub fn rows<'py>(py: Python<'py>, points: impl ExactSizeIterator<Item = DVec3>) -> PyResult<Bound<'py, PyArray2<f64>>> {
    flat_rows(py, points.map(|p| p.to_array()).collect())
}

/// The same of rows that are arrays already, without a copy.
pub fn flat_rows(py: Python<'_>, rows: Vec<[f64; 3]>) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let count = rows.len();
    rows.into_flattened().into_pyarray(py).reshape([count, 3])
}

/// An (n,) array.
pub fn column<'py, T: numpy::Element>(py: Python<'py>, values: impl Iterator<Item = T>) -> Bound<'py, PyArray1<T>> {
    values.collect::<Vec<_>>().into_pyarray(py)
}
