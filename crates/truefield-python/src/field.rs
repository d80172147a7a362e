//! `CompleteField`.

use std::sync::Arc;

use numpy::{PyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use truefield::build::complete::complete;
use truefield::field::complete::Region;
use truefield::{CompleteField, DVec3, Error, Grid};

use crate::convert::column;
use crate::door::{Threads, job, raise};
use crate::surface::{NearestArrays, PySurface, interval_arrays, nearest_arrays};

type Floats<'py> = Bound<'py, PyArray1<f64>>;

/// A complete distance field; see `truefield.CompleteField`.
#[pyclass(name = "CompleteField", module = "truefield._truefield", frozen)]
pub struct PyCompleteField(pub Arc<CompleteField>);

/// The region that a name stands for.
pub fn region(name: &str) -> PyResult<Region> {
    match name {
        "everywhere" => Ok(Region::Everywhere),
        "inside" => Ok(Region::Inside),
        _ => Err(raise(Error::invalid(format!("region is {name:?}; choose \"everywhere\" or \"inside\"")))),
    }
}

#[pymethods]
impl PyCompleteField {
    #[new]
    #[pyo3(signature = (surface, origin, cell_size, shape, region, memory, threads=None, progress=None))]
    fn new(
        py: Python<'_>,
        surface: &PySurface,
        origin: [f64; 3],
        cell_size: f64,
        shape: [u32; 3],
        region: &str,
        memory: u64,
        threads: Option<Threads>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let grid = Grid { origin: DVec3::from_array(origin), spacing: cell_size, first: [0; 3], shape };
        let (surface, region) = (Arc::clone(&surface.0), self::region(region)?);
        Ok(Self(Arc::new(job(py, threads, progress, |run| complete(&surface, &grid, region, memory, run))?)))
    }

    #[getter]
    fn surface(&self) -> PySurface {
        PySurface(Arc::clone(self.0.surface()))
    }

    /// `(origin, cell_size, shape)`.
    #[getter]
    fn grid(&self) -> ([f64; 3], f64, [u32; 3]) {
        let grid = self.0.grid();
        (grid.origin.to_array(), grid.spacing, grid.shape)
    }

    /// Global index of the grid's first cell.
    #[getter]
    fn first(&self) -> [i64; 3] {
        self.0.grid().first
    }

    #[getter]
    fn region(&self) -> &'static str {
        match self.0.region() {
            Region::Everywhere => "everywhere",
            Region::Inside => "inside",
        }
    }

    fn statistics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let s = py.detach(|| self.0.statistics());
        let out = PyDict::new(py);
        let counts = [
            ("inside", s.inside),
            ("surface", s.surface),
            ("outside", s.outside),
            ("listed", s.listed),
            ("long", s.long),
            ("longest", s.longest),
            ("bytes", s.bytes),
            ("paper_bytes", s.paper_bytes),
        ];
        for (name, count) in counts {
            out.set_item(name, count)?;
        }
        out.set_item("surface_mean", s.surface_mean)?;
        out.set_item("inside_mean", s.inside_mean)?;
        Ok(out)
    }

    #[pyo3(signature = (points, threads=None, progress=None))]
    fn distance<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
        threads: Option<Threads>,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Floats<'py>> {
        let points = crate::convert::points(&points)?;
        Ok(column(py, job(py, threads, progress, |run| self.0.distances(&points, run))?.into_iter()))
    }

    #[pyo3(signature = (points, threads=None, progress=None))]
    fn bounds<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
        threads: Option<Threads>,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<(Floats<'py>, Floats<'py>)> {
        let points = crate::convert::points(&points)?;
        Ok(interval_arrays(py, &job(py, threads, progress, |run| self.0.bounds(&points, run))?))
    }

    #[pyo3(signature = (points, threads=None, progress=None))]
    fn nearest<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
        threads: Option<Threads>,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<NearestArrays<'py>> {
        let points = crate::convert::points(&points)?;
        nearest_arrays(py, &job(py, threads, progress, |run| self.0.nearest_many(&points, run))?)
    }
}
