//! `Shape`: anything that fields can be built from.

use std::sync::Arc;

use numpy::{PyArray1, PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;
use truefield::{Source, source};

use crate::convert::{column, points, rows};
use crate::door::job;
use crate::surface::{PySurface, interval_arrays};

type Floats<'py> = Bound<'py, PyArray1<f64>>;

/// A source; see `truefield.shape.Shape`.
#[pyclass(name = "Shape", module = "truefield._truefield", frozen)]
pub struct PyShape(pub Arc<dyn Source>);

impl PyShape {
    /// Any source as a shape.
    pub fn of(source: impl Source + 'static) -> Self {
        Self(Arc::new(source))
    }
}

#[pymethods]
impl PyShape {
    /// A mesh with its tree and sign rule.
    #[staticmethod]
    fn mesh(surface: &PySurface) -> Self {
        Self(Arc::clone(&surface.0) as Arc<dyn Source>)
    }

    /// Lowest and highest corner, `None` where the shape has no end.
    #[getter]
    fn extent(&self) -> Option<([f64; 3], [f64; 3])> {
        self.0.extent().map(|extent| (extent.min.to_array(), extent.max.to_array()))
    }

    #[pyo3(signature = (points, threads=None, progress=None))]
    fn distance<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
        threads: Option<usize>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Floats<'py>> {
        let points = self::points(&points)?;
        Ok(column(py, job(py, threads, progress, |run| source::values(&*self.0, &points, run))?.into_iter()))
    }

    #[pyo3(signature = (points, threads=None, progress=None))]
    fn bounds<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
        threads: Option<usize>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<(Floats<'py>, Floats<'py>)> {
        let points = self::points(&points)?;
        Ok(interval_arrays(py, &job(py, threads, progress, |run| source::bounds(&*self.0, &points, run))?))
    }

    #[pyo3(signature = (points, threads=None, progress=None))]
    fn gradient<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
        threads: Option<usize>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let points = self::points(&points)?;
        rows(py, job(py, threads, progress, |run| source::gradients(&*self.0, &points, run))?.into_iter())
    }
}
