//! `AdaptiveField`.

use std::sync::{Arc, Mutex, PoisonError};

use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use truefield::build::adaptive::{Leaves, Reconstruction, Rule, Rules, adaptive, adaptive_mesh, root};
use truefield::field::adaptive::{AdaptiveField, Division};
use truefield::product::raycast::Caster;
use truefield::{Aabb, Error, Run};

use crate::convert::{column, points, rows};
use crate::door::{Threads, job, raise};
use crate::shape::PyShape;
use crate::surface::{PySurface, interval_arrays, sign_name};

type Floats<'py> = Bound<'py, PyArray1<f64>>;
type MeshOf<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<i64>>, &'static str);

type Points<'py> = Bound<'py, PyArray2<f64>>;
type LeafArrays<'py> = (Points<'py>, Points<'py>, Floats<'py>, Floats<'py>);

/// An adaptively sampled field; see `truefield.AdaptiveField`.
#[pyclass(name = "AdaptiveField", module = "truefield._truefield", frozen)]
pub struct PyAdaptiveField {
    pub field: Arc<AdaptiveField>,
    /// What rays were last cast at, with its distance.
    caster: Mutex<Option<(f64, Arc<Caster>)>>,
}

impl PyAdaptiveField {
    /// A field as Python has it.
    pub fn of(field: AdaptiveField) -> Self {
        Self { field: Arc::new(field), caster: Mutex::new(None) }
    }

    /// The field ready for rays; made once for all rays at the same distance.
    pub fn caster(&self, distance: f64, run: &Run<'_>) -> truefield::Result<Arc<Caster>> {
        let mut kept = self.caster.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((at, caster)) = &*kept
            && *at == distance
        {
            return Ok(Arc::clone(caster));
        }
        let caster = Arc::new(Caster::new(&self.field, distance, run)?);
        *kept = Some((distance, Arc::clone(&caster)));
        Ok(caster)
    }
}

fn reconstruction(name: &str) -> PyResult<Reconstruction> {
    match name {
        "linear" => Ok(Reconstruction::Linear),
        "cubic" => Ok(Reconstruction::Cubic),
        "exact" | "mixed" => {
            Err(raise(Error::invalid(format!("method {name:?} is for meshes; choose \"linear\" or \"cubic\" for a shape"))))
        }
        _ => Err(unknown_method(name)),
    }
}

fn unknown_method(name: &str) -> PyErr {
    raise(Error::invalid(format!("method is {name:?}; choose \"linear\", \"cubic\", \"exact\" or \"mixed\"")))
}

/// The rule that a name stands for.
pub fn rule(name: &str) -> PyResult<Rule> {
    match name {
        "verified" => Ok(Rule::Verified),
        "samples" => Ok(Rule::Samples),
        _ => Err(raise(Error::invalid(format!("rule is {name:?}; choose \"verified\" or \"samples\"")))),
    }
}

/// What a rule is called.
pub fn rule_name(rule: Rule) -> &'static str {
    match rule {
        Rule::Verified => "verified",
        Rule::Samples => "samples",
    }
}

#[pymethods]
impl PyAdaptiveField {
    #[new]
    #[pyo3(signature = (shape, tolerance, growth, max_depth, domain, method, rule, memory, threads=None, progress=None))]
    fn new(
        py: Python<'_>,
        shape: &PyShape,
        tolerance: f64,
        growth: f64,
        max_depth: u32,
        domain: Option<([f64; 3], [f64; 3])>,
        method: &str,
        rule: &str,
        memory: u64,
        threads: Option<Threads>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let rules = Rules { tolerance, growth, max_depth, rule: self::rule(rule)?, reconstruction: reconstruction(method)?, memory };
        let domain = domain.map(|(low, high)| Aabb::new(low.into(), high.into()));
        let source = Arc::clone(&shape.0);
        let field = job(py, threads, progress, |run| {
            adaptive(&*source, root(&*source, domain, if source.is_flat() { Division::Quadtree } else { Division::Octree })?, &rules, run)
        })?;
        Ok(Self::of(field))
    }

    /// The field of a mesh, from its triangles: "linear", "exact" or "mixed" leaves.
    #[staticmethod]
    #[pyo3(signature = (surface, tolerance, growth, max_depth, domain, method, rule, memory, threads=None, progress=None))]
    fn of_surface(
        py: Python<'_>,
        surface: &PySurface,
        tolerance: f64,
        growth: f64,
        max_depth: u32,
        domain: Option<([f64; 3], [f64; 3])>,
        method: &str,
        rule: &str,
        memory: u64,
        threads: Option<Threads>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let rules = Rules { tolerance, growth, max_depth, rule: self::rule(rule)?, reconstruction: Reconstruction::Linear, memory };
        let leaves = match method {
            "linear" => Leaves::Linear,
            "exact" => Leaves::Exact,
            "mixed" => Leaves::Mixed,
            _ => return Err(unknown_method(method)),
        };
        let domain = domain.map(|(low, high)| Aabb::new(low.into(), high.into()));
        let source = &surface.0;
        let made = job(py, threads, progress, |run| adaptive_mesh(source, root(&**source, domain, Division::Octree)?, leaves, &rules, run));
        Ok(Self::of(made?))
    }

    /// Children of a cell: 8, or 4 in a quadtree.
    #[getter]
    fn children(&self) -> usize {
        self.field.division().children()
    }

    /// `(vertices, triangles, sign rule)` of the mesh whose triangles exact leaves name.
    #[getter]
    fn mesh<'py>(&self, py: Python<'py>) -> PyResult<Option<MeshOf<'py>>> {
        let Some(surface) = self.field.surface() else { return Ok(None) };
        let mesh = surface.mesh();
        let triangles: Vec<i64> = mesh.triangles().iter().flatten().map(|&v| i64::from(v)).collect();
        let count = mesh.triangles().len();
        let triangles = triangles.into_pyarray(py).reshape([count, 3])?;
        Ok(Some((rows(py, mesh.vertices().iter().copied())?, triangles, sign_name(surface.sign_rule().kind))))
    }

    /// Lowest and highest corner of the domain.
    #[getter]
    fn extent(&self) -> ([f64; 3], [f64; 3]) {
        let Aabb { min, max } = self.field.extent_box();
        (min.to_array(), max.to_array())
    }

    /// `(low, high, lower, upper)` of all leaves: their corners and the bounds of their error.
    fn leaves<'py>(&self, py: Python<'py>) -> PyResult<LeafArrays<'py>> {
        let mut leaves = Vec::new();
        py.detach(|| {
            self.field.walk(&mut |cell| {
                if cell.is_leaf() {
                    leaves.push((cell.extent(), cell.error()));
                }
                true
            });
        });
        let (low, high) = (rows(py, leaves.iter().map(|leaf| leaf.0.min))?, rows(py, leaves.iter().map(|leaf| leaf.0.max))?);
        Ok((low, high, column(py, leaves.iter().map(|leaf| leaf.1.lower)), column(py, leaves.iter().map(|leaf| leaf.1.upper))))
    }

    fn statistics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let s = py.detach(|| self.field.statistics());
        let out = PyDict::new(py);
        for (name, count) in [
            ("cells", s.cells),
            ("leaves", s.leaves),
            ("cubic", s.cubic),
            ("exact", s.exact),
            ("entries", s.entries),
            ("depth", u64::from(s.depth)),
            ("bytes", s.bytes),
        ] {
            out.set_item(name, count)?;
        }
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
        let points = self::points(&points)?;
        Ok(column(py, job(py, threads, progress, |run| self.field.distances(&points, run))?.into_iter()))
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
        Ok(interval_arrays(py, &job(py, threads, progress, |run| self.field.bounds(&points, run))?))
    }

    #[pyo3(signature = (points, threads=None, progress=None))]
    fn gradient<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
        threads: Option<Threads>,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let points = self::points(&points)?;
        rows(py, job(py, threads, progress, |run| self.field.gradients(&points, run))?.into_iter())
    }
}
