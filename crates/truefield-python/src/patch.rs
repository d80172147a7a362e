//! Shapes of Bezier patches.

use numpy::{PyReadonlyArray4, PyUntypedArrayMethods};
use pyo3::prelude::*;
use truefield::source::patch::{Bezier, Patches, Sides};
use truefield::{DVec3, Error};

use crate::door::{Threads, job, raise};
use crate::shape::PyShape;

/// (n, 4, 4, 3) control points as a shape; `sides` is "closed" or "unsigned".
#[pyfunction]
#[pyo3(signature = (controls, sides, threads=None, progress=None))]
pub fn patch_shape(
    py: Python<'_>,
    controls: PyReadonlyArray4<'_, f64>,
    sides: &str,
    threads: Option<Threads>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<PyShape> {
    let sides = match sides {
        "closed" => Sides::Closed,
        "unsigned" => Sides::Unsigned,
        _ => return Err(raise(Error::invalid(format!("sides is {sides:?}; choose \"closed\" or \"unsigned\"")))),
    };
    if controls.shape()[1..] != [4, 4, 3] {
        return Err(raise(Error::invalid("control points must have shape (n, 4, 4, 3)")));
    }
    let flat = controls.as_slice().map_err(|_| raise(Error::invalid("control points must be C-contiguous")))?;
    let patches: Vec<Bezier> = flat
        .as_chunks::<48>()
        .0
        .iter()
        .map(|patch| Bezier(std::array::from_fn(|i| std::array::from_fn(|j| DVec3::from_slice(&patch[12 * i + 3 * j..][..3])))))
        .collect();
    job(py, threads, progress, |run| Patches::new(&patches, sides, run)).map(PyShape::of)
}
