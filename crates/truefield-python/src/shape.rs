//! `Shape`: anything that fields can be built from.

use std::sync::Arc;

use numpy::{PyArray1, PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;
use truefield::field::adaptive::Solid;
use truefield::source::csg::{self, BlendKind, Placement};
use truefield::{DVec3, Error, Source, source};

use crate::adaptive::PyAdaptiveField;
use crate::convert::{column, points, rows};
use crate::door::{Threads, job, raise};
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

    fn placed(&self, placement: truefield::Result<Placement>) -> PyResult<Self> {
        placement.and_then(|placement| csg::Placed::new(Arc::clone(&self.0), placement)).map(Self::of).map_err(raise)
    }
}

#[pymethods]
impl PyShape {
    /// A mesh with its tree and sign rule.
    #[staticmethod]
    fn mesh(surface: &PySurface) -> Self {
        Self(Arc::clone(&surface.0) as Arc<dyn Source>)
    }

    /// The solid of an adaptive field.
    #[staticmethod]
    fn field(py: Python<'_>, field: &PyAdaptiveField) -> PyResult<Self> {
        let field = Arc::clone(&field.field);
        py.detach(|| Solid::new(field)).map(Self::of).map_err(raise)
    }

    /// What is not in the shape.
    fn complement(&self) -> Self {
        Self::of(csg::Complement::new(Arc::clone(&self.0)))
    }

    fn translate(&self, by: [f64; 3]) -> PyResult<Self> {
        self.placed(Placement::translate(DVec3::from_array(by)))
    }

    fn rotate(&self, axis: [f64; 3], degrees: f64) -> PyResult<Self> {
        self.placed(Placement::rotate(DVec3::from_array(axis), degrees))
    }

    fn scale(&self, factor: f64) -> PyResult<Self> {
        self.placed(Placement::scale(factor))
    }

    fn offset(&self, distance: f64) -> PyResult<Self> {
        csg::Offset::new(&self.0, distance).map(Self::of).map_err(raise)
    }

    fn shell(&self, thickness: f64) -> PyResult<Self> {
        csg::shell(&self.0, thickness).map(Self::of).map_err(raise)
    }

    fn blend(&self, other: &Self, radius: f64, kind: &str) -> PyResult<Self> {
        let kind = match kind {
            "polynomial" => BlendKind::Polynomial,
            "circular" => BlendKind::Circular,
            _ => return Err(raise(Error::invalid(format!("kind is {kind:?}; choose \"circular\" or \"polynomial\"")))),
        };
        csg::Blend::new([&self.0, &other.0], radius, kind).map(Self::of).map_err(raise)
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
        threads: Option<Threads>,
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
        threads: Option<Threads>,
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
        threads: Option<Threads>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let points = self::points(&points)?;
        rows(py, job(py, threads, progress, |run| source::gradients(&*self.0, &points, run))?.into_iter())
    }
}
