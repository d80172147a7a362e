//! `CompleteField` and `SampledField`.

use std::sync::Arc;

use numpy::ndarray::ArrayView3;
use numpy::{IntoPyArray, PyArray1, PyArray3, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use truefield::build::complete::complete;
use truefield::build::sampled::sample;
use truefield::field::complete::Region;
use truefield::{CompleteField, DVec3, Distance, Error, Grid, SampledField};

use crate::convert::column;
use crate::door::{job, raise};
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
        threads: Option<usize>,
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
        threads: Option<usize>,
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
        threads: Option<usize>,
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
        threads: Option<usize>,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<NearestArrays<'py>> {
        let points = crate::convert::points(&points)?;
        nearest_arrays(py, &job(py, threads, progress, |run| self.0.nearest_many(&points, run))?)
    }
}

/// Samples on a lattice; see `truefield.SampledField`.
#[pyclass(name = "SampledField", module = "truefield._truefield", frozen)]
pub struct PySampledField(pub Arc<SampledField>);

#[pymethods]
impl PySampledField {
    #[new]
    #[pyo3(signature = (surface, origin, spacing, shape, band, memory, threads=None, progress=None))]
    fn new(
        py: Python<'_>,
        surface: &PySurface,
        origin: [f64; 3],
        spacing: f64,
        shape: [u32; 3],
        band: Option<f64>,
        memory: u64,
        threads: Option<usize>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let lattice = Grid { origin: DVec3::from_array(origin), spacing, first: [0; 3], shape };
        let surface = Arc::clone(&surface.0);
        Ok(Self(Arc::new(job(py, threads, progress, |run| sample(&surface, &lattice, band, memory, run))?)))
    }

    /// `(origin, spacing, shape)`.
    #[getter]
    fn lattice(&self) -> ([f64; 3], f64, [u32; 3]) {
        let lattice = self.0.lattice();
        (lattice.origin.to_array(), lattice.spacing, lattice.shape)
    }

    /// A read-only view, not a copy; it keeps the field alive.
    #[getter]
    #[allow(unsafe_code)]
    fn values(this: Bound<'_, Self>) -> PyResult<Bound<'_, PyArray3<f32>>> {
        let field = Arc::clone(&this.get().0);
        let shape = field.lattice().shape.map(|n| n as usize);
        let view = ArrayView3::from_shape(shape, field.values())
            .map_err(|error| raise(Error::invalid(format!("the samples do not fit their shape: {error}"))))?;
        // SAFETY: the frozen object `this` holds the samples, never changes them, and becomes the array's base.
        let array = unsafe { PyArray3::borrow_from_array(&view, this.into_any()) };
        array.readwrite().make_nonwriteable();
        Ok(array)
    }

    #[getter]
    fn lower<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f32>>> {
        self.0.lower().into_pyarray(py).reshape(self.0.lattice().shape.map(|n| n as usize))
    }

    #[getter]
    fn upper<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f32>>> {
        self.0.upper().into_pyarray(py).reshape(self.0.lattice().shape.map(|n| n as usize))
    }

    /// Trilinear values, NaN outside the lattice.
    fn distance<'py>(&self, py: Python<'py>, points: PyReadonlyArray2<'py, f64>) -> PyResult<Floats<'py>> {
        let points = crate::convert::points(&points)?;
        Ok(column(py, points.iter().map(|&p| self.0.interpolate(p).unwrap_or(f64::NAN))))
    }

    fn bounds<'py>(&self, py: Python<'py>, points: PyReadonlyArray2<'py, f64>) -> PyResult<(Floats<'py>, Floats<'py>)> {
        let points = crate::convert::points(&points)?;
        let bounds: Vec<_> = points.iter().map(|&p| self.0.at(p)).collect();
        Ok(interval_arrays(py, &bounds))
    }
}
