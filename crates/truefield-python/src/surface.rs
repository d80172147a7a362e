//! `Surface`: a mesh ready to be asked.

use std::sync::Arc;

use numpy::{PyArray1, PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;
use truefield::{Error, Interval, Nearest, SignChoice, SignKind, Surface};

use crate::convert::{column, mesh, points, rows};
use crate::door::{Threads, job, raise};

type Floats<'py> = Bound<'py, PyArray1<f64>>;

/// `(distance, point, triangle, feature, normal)`.
pub type NearestArrays<'py> =
    (Floats<'py>, Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<i64>>, Bound<'py, PyArray1<u8>>, Bound<'py, PyArray2<f64>>);

/// A triangle mesh with its tree and sign rule; see `truefield.Surface`.
#[pyclass(name = "Surface", module = "truefield._truefield", frozen)]
pub struct PySurface(pub Arc<Surface>);

/// The rule that a name stands for.
pub fn sign_choice(name: &str) -> PyResult<SignChoice> {
    Ok(match name {
        "auto" => SignChoice::Auto,
        "pseudonormal" => SignChoice::Pseudonormal,
        "winding" => SignChoice::Winding,
        "unsigned" => SignChoice::Unsigned,
        _ => {
            return Err(raise(Error::invalid(format!("sign is {name:?}; choose \"auto\", \"pseudonormal\", \"winding\" or \"unsigned\""))));
        }
    })
}

/// The name of a rule.
pub fn sign_name(kind: SignKind) -> &'static str {
    match kind {
        SignKind::Pseudonormal => "pseudonormal",
        SignKind::Winding => "winding",
        SignKind::Unsigned => "unsigned",
    }
}

#[pymethods]
impl PySurface {
    #[new]
    #[pyo3(signature = (vertices, triangles, sign, threads=None, progress=None))]
    fn new(
        py: Python<'_>,
        vertices: PyReadonlyArray2<'_, f64>,
        triangles: PyReadonlyArray2<'_, i64>,
        sign: &str,
        threads: Option<Threads>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let (mesh, sign) = (Arc::new(mesh(&vertices, &triangles)?), sign_choice(sign)?);
        Ok(Self(Arc::new(job(py, threads, progress, |run| Surface::new(mesh, sign, run))?)))
    }

    /// `(name, reason)`.
    #[getter]
    fn sign_rule(&self) -> (&'static str, String) {
        let rule = self.0.sign_rule();
        (sign_name(rule.kind), rule.reason.clone())
    }

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
    fn nearest<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
        threads: Option<Threads>,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<NearestArrays<'py>> {
        let points = self::points(&points)?;
        nearest_arrays(py, &job(py, threads, progress, |run| self.0.nearest_many(&points, run))?)
    }
}

/// `(lower, upper)`.
pub fn interval_arrays<'py>(py: Python<'py>, bounds: &[Interval]) -> (Floats<'py>, Floats<'py>) {
    (column(py, bounds.iter().map(|b| b.lower)), column(py, bounds.iter().map(|b| b.upper)))
}

/// One array for each part of the answers.
pub fn nearest_arrays<'py>(py: Python<'py>, found: &[Nearest]) -> PyResult<NearestArrays<'py>> {
    Ok((
        column(py, found.iter().map(|n| n.distance)),
        rows(py, found.iter().map(|n| n.point))?,
        column(py, found.iter().map(|n| i64::from(n.element))),
        column(py, found.iter().map(|n| n.feature.code())),
        rows(py, found.iter().map(|n| n.normal))?,
    ))
}
