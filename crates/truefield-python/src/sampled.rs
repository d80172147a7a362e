//! `SampledField`.

use std::sync::Arc;

use numpy::ndarray::ArrayView3;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::prelude::*;
use truefield::build::sampled::sample;
use truefield::op::boolean::{complement, difference, intersection, union};
use truefield::op::offset::offset;
use truefield::op::resample::resample;
use truefield::product::medial::{Where, medial_axis};
use truefield::product::sampled::contour;
use truefield::product::surface::{Border, Triangulation, triangulate};
use truefield::{Continuity, DVec3, Error, Grid, Known, Lattice, Run, SampledField};

use crate::convert::{column, points, rows};
use crate::door::{Threads, job, raise};
use crate::surface::{PySurface, interval_arrays};

type Floats<'py> = Bound<'py, PyArray1<f64>>;
type Volume<'py> = Bound<'py, PyArray3<f32>>;
type Points<'py> = Bound<'py, PyArray2<f64>>;
type MeshArrays<'py> = (Points<'py>, Bound<'py, PyArray2<i64>>, [f64; 3], [f64; 3]);

/// Samples on a lattice; see `truefield.SampledField`.
#[pyclass(name = "SampledField", module = "truefield._truefield", frozen)]
pub struct PySampledField(pub Arc<SampledField>);

/// The signed distances of a surface at the points of a lattice.
#[pyfunction]
#[pyo3(name = "sample", signature = (surface, origin, spacing, shape, band, memory, threads=None, progress=None))]
pub fn sample_of(
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
    Ok(PySampledField(Arc::new(job(py, threads, progress, |run| sample(&surface.0, &lattice, band, memory, run))?)))
}

fn flat(array: &PyReadonlyArray3<'_, f32>) -> PyResult<Vec<f32>> {
    Ok(array.as_slice().map_err(|_| raise(Error::invalid("samples must be C-contiguous")))?.to_vec())
}

impl PySampledField {
    fn shape(&self) -> [usize; 3] {
        self.0.lattice().shape.map(|n| n as usize)
    }

    fn derived(
        &self,
        py: Python<'_>,
        threads: Option<Threads>,
        progress: Option<&Bound<'_, PyAny>>,
        work: impl FnOnce(&SampledField, &Run<'_>) -> truefield::Result<SampledField> + Send,
    ) -> PyResult<Self> {
        Ok(Self(Arc::new(job(py, threads, progress, |run| work(&self.0, run))?)))
    }
}

#[pymethods]
impl PySampledField {
    /// From samples with an error for all, with bounds, or, with neither, of exact distances within a band.
    #[new]
    #[pyo3(signature = (values, origin, spacing, error=None, lower=None, upper=None, band=None, doubtful=None, continuous=true))]
    fn new(
        values: PyReadonlyArray3<'_, f32>,
        origin: [f64; 3],
        spacing: [f64; 3],
        error: Option<f64>,
        lower: Option<PyReadonlyArray3<'_, f32>>,
        upper: Option<PyReadonlyArray3<'_, f32>>,
        band: Option<f64>,
        doubtful: Option<PyReadonlyArray1<'_, u64>>,
        continuous: bool,
    ) -> PyResult<Self> {
        let mut shape = [0u32; 3];
        for (count, &length) in shape.iter_mut().zip(values.as_array().shape()) {
            *count = u32::try_from(length).map_err(|_| raise(Error::invalid("a lattice has fewer than 2^32 samples a side")))?;
        }
        let lattice = Lattice { origin: DVec3::from_array(origin), spacing: DVec3::from_array(spacing), first: [0; 3], shape };
        let known = match (error, lower, upper) {
            (Some(error), None, None) => Known::Within(error),
            (None, Some(lower), Some(upper)) => Known::Between { lower: flat(&lower)?, upper: flat(&upper)? },
            (None, None, None) => Known::Rounded {
                band: band.unwrap_or(f64::INFINITY),
                doubtful: doubtful.map_or_else(Vec::new, |numbers| numbers.as_array().to_vec()),
            },
            _ => return Err(raise(Error::invalid("give an error, or lower and upper bounds, or neither"))),
        };
        let continuity = if continuous { Continuity::Everywhere } else { Continuity::ExceptOpenings };
        Ok(Self(Arc::new(SampledField::new(lattice, flat(&values)?, known, continuity).map_err(raise)?)))
    }

    /// `(origin, spacing, shape)`.
    #[getter]
    fn lattice(&self) -> ([f64; 3], [f64; 3], [u32; 3]) {
        let Lattice { origin, spacing, first, shape } = *self.0.lattice();
        (if first == [0; 3] { origin } else { self.0.lattice().point(first) }.to_array(), spacing.to_array(), shape)
    }

    /// A read-only view, not a copy; it keeps the field alive.
    #[getter]
    #[allow(unsafe_code)]
    fn values(this: Bound<'_, Self>) -> PyResult<Volume<'_>> {
        let field = Arc::clone(&this.get().0);
        let view = ArrayView3::from_shape(this.get().shape(), field.values())
            .map_err(|error| raise(Error::invalid(format!("the samples do not fit their shape: {error}"))))?;
        // SAFETY: the frozen object `this` holds the samples, never changes them, and becomes the array's base.
        let array = unsafe { PyArray3::borrow_from_array(&view, this.into_any()) };
        array.readwrite().make_nonwriteable();
        Ok(array)
    }

    #[getter]
    fn lower<'py>(&self, py: Python<'py>) -> PyResult<Volume<'py>> {
        py.detach(|| self.0.lower()).into_pyarray(py).reshape(self.shape())
    }

    #[getter]
    fn upper<'py>(&self, py: Python<'py>) -> PyResult<Volume<'py>> {
        py.detach(|| self.0.upper()).into_pyarray(py).reshape(self.shape())
    }

    /// How the truth is known, as the constructor takes it: "error" and the length, "bounds", or "exact", the band and
    /// the doubtful samples.
    #[getter]
    fn known<'py>(&self, py: Python<'py>) -> (&'static str, f64, Bound<'py, PyArray1<u64>>) {
        let (name, length, doubtful) = match self.0.known() {
            Known::Rounded { band, doubtful } => ("exact", *band, doubtful.as_slice()),
            Known::Within(error) => ("error", *error, [].as_slice()),
            Known::Between { .. } => ("bounds", f64::INFINITY, [].as_slice()),
        };
        (name, length, column(py, doubtful.iter().copied()))
    }

    /// Whether the sign changes at the surface only.
    #[getter]
    fn continuous(&self) -> bool {
        self.0.continuity() == Continuity::Everywhere
    }

    /// Trilinear values, NaN outside the lattice.
    #[pyo3(signature = (points, threads=None, progress=None))]
    fn distance<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
        threads: Option<Threads>,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Floats<'py>> {
        let points = self::points(&points)?;
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
        let points = self::points(&points)?;
        Ok(interval_arrays(py, &job(py, threads, progress, |run| self.0.bounds(&points, run))?))
    }

    #[pyo3(signature = (points, threads=None, progress=None))]
    fn gradient<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
        threads: Option<Threads>,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Points<'py>> {
        let points = self::points(&points)?;
        rows(py, job(py, threads, progress, |run| self.0.gradients(&points, run))?.into_iter())
    }

    #[pyo3(signature = (points, threads=None, progress=None))]
    fn foot<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
        threads: Option<Threads>,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Points<'py>> {
        let points = self::points(&points)?;
        rows(py, job(py, threads, progress, |run| self.0.feet(&points, run))?.into_iter())
    }

    fn complement(&self, py: Python<'_>) -> PyResult<Self> {
        self.derived(py, Some(Threads::ONE), None, |field, _| complement(field))
    }

    #[pyo3(signature = (distance, memory, threads=None, progress=None))]
    fn offset(
        &self,
        py: Python<'_>,
        distance: f64,
        memory: u64,
        threads: Option<Threads>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        self.derived(py, threads, progress, |field, run| offset(field, distance, memory, run))
    }

    /// "union", "intersection" or "difference" with another field.
    #[pyo3(signature = (name, other, memory, threads=None, progress=None))]
    fn combine(
        &self,
        py: Python<'_>,
        name: &str,
        other: &Self,
        memory: u64,
        threads: Option<Threads>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let operation = match name {
            "union" => union,
            "intersection" => intersection,
            "difference" => difference,
            _ => {
                return Err(raise(Error::invalid(format!(
                    "{name:?} is no operation; choose \"union\", \"intersection\" or \"difference\""
                ))));
            }
        };
        self.derived(py, threads, progress, |field, run| operation(field, &other.0, memory, run))
    }

    /// `(vertices, triangles, lower, upper)`: a mesh and its box.
    #[pyo3(signature = (distance, border, memory, threads=None, progress=None))]
    fn surface<'py>(
        &self,
        py: Python<'py>,
        distance: f64,
        border: &str,
        memory: u64,
        threads: Option<Threads>,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<MeshArrays<'py>> {
        let border = match border {
            "closed" => Border::Closed,
            "open" => Border::Open,
            _ => return Err(raise(Error::invalid(format!("border is {border:?}; choose \"closed\" or \"open\"")))),
        };
        let made = job(py, threads, progress, |run| triangulate::<i64>(&self.0, distance, border, memory, run))?;
        let Triangulation { vertices, triangles, extent } = made;
        let (vertex_count, triangle_count) = (vertices.len(), triangles.len());
        let vertices = vertices.into_flattened().into_pyarray(py).reshape([vertex_count, 3])?;
        let triangles = triangles.into_flattened().into_pyarray(py).reshape([triangle_count, 3])?;
        Ok((vertices, triangles, extent.min.to_array(), extent.max.to_array()))
    }

    /// `(points, normals, lower, upper)` of the contour at signed `distance`.
    #[pyo3(signature = (distance, tolerance, placement, memory, threads=None, progress=None))]
    fn contour<'py>(
        &self,
        py: Python<'py>,
        distance: f64,
        tolerance: f64,
        placement: &str,
        memory: u64,
        threads: Option<Threads>,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<(Points<'py>, Points<'py>, Floats<'py>, Floats<'py>)> {
        let placement = crate::contour::placement(placement)?;
        let found = job(py, threads, progress, |run| contour(&self.0, distance, tolerance, placement, memory, run))?;
        let (lower, upper) = interval_arrays(py, &found.bounds);
        Ok((rows(py, found.points.into_iter())?, rows(py, found.normals.into_iter())?, lower, upper))
    }

    /// `(points, radii, angles)` of the medial axis.
    #[pyo3(signature = (side, angle, threads=None, progress=None))]
    fn medial_axis<'py>(
        &self,
        py: Python<'py>,
        side: &str,
        angle: f64,
        threads: Option<Threads>,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<(Points<'py>, Floats<'py>, Floats<'py>)> {
        let side = match side {
            "inside" => Where::Inside,
            "outside" => Where::Outside,
            _ => return Err(raise(Error::invalid(format!("side is {side:?}; choose \"inside\" or \"outside\"")))),
        };
        let found = job(py, threads, progress, |run| medial_axis(&self.0, side, angle, run))?;
        Ok((rows(py, found.points.into_iter())?, column(py, found.radii.into_iter()), column(py, found.angles.into_iter())))
    }

    #[pyo3(signature = (origin, spacing, shape, memory, threads=None, progress=None))]
    fn resample(
        &self,
        py: Python<'_>,
        origin: [f64; 3],
        spacing: [f64; 3],
        shape: [u32; 3],
        memory: u64,
        threads: Option<Threads>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let lattice = Lattice { origin: DVec3::from_array(origin), spacing: DVec3::from_array(spacing), first: [0; 3], shape };
        self.derived(py, threads, progress, |field, run| resample(field, lattice, memory, run))
    }
}
