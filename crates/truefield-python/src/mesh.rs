//! What readers of meshes need.

use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;
use truefield::Error;
use truefield::mesh::Distinct;

use crate::convert::{flat_rows, points};
use crate::door::raise;

/// Positions in order of first appearance, each once; -0 becomes 0.
#[pyclass(name = "Distinct", module = "truefield._truefield")]
#[derive(Default)]
pub struct PyDistinct(Distinct);

#[pymethods]
impl PyDistinct {
    #[new]
    fn new() -> Self {
        Self::default()
    }

    /// The numbers of positions, (n,) int64; the next ones for those that are new.
    fn numbers<'py>(&mut self, py: Python<'py>, points: PyReadonlyArray2<'py, f64>) -> PyResult<Bound<'py, PyArray1<i64>>> {
        let points = self::points(&points)?;
        let distinct = &mut self.0;
        let numbers: Option<Vec<i64>> = py.detach(|| points.into_iter().map(|p| distinct.number(p).map(i64::from)).collect());
        let full = || raise(Error::invalid("there are more than 2^32 - 1 different vertices; split the mesh"));
        Ok(numbers.ok_or_else(full)?.into_pyarray(py))
    }

    /// The positions, by number, (n, 3); leaves none behind.
    fn take<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        flat_rows(py, std::mem::take(&mut self.0).into_points())
    }
}
