//! `check_mesh`: what is wrong with a mesh, as a dictionary.

use numpy::PyReadonlyArray2;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use truefield::{Check, Found};

use crate::convert::mesh;
use crate::door::{Threads, job};

/// A count and the first few finds, each a tuple of indices.
fn found<const N: usize, T: Copy>(finds: &Found<T>, indices: impl Fn(T) -> [u32; N]) -> (usize, Vec<Vec<u32>>) {
    (finds.count, finds.first.iter().map(|&find| indices(find).to_vec()).collect())
}

/// The fields of `truefield.MeshCheck`: finds as `(count, first)`, all else as it is.
#[pyfunction]
#[pyo3(signature = (vertices, triangles, threads=None, progress=None))]
pub fn check_mesh<'py>(
    py: Python<'py>,
    vertices: PyReadonlyArray2<'py, f64>,
    triangles: PyReadonlyArray2<'py, i64>,
    threads: Option<Threads>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let mesh = mesh(&vertices, &triangles)?;
    let check = job(py, threads, progress, |run| Check::of(&mesh, run))?;
    let out = PyDict::new(py);
    for (name, pairs) in [
        ("open_edges", &check.open_edges),
        ("non_manifold_edges", &check.non_manifold_edges),
        ("inconsistent_edges", &check.inconsistent_edges),
        ("duplicate_triangles", &check.duplicate_triangles),
        ("opposite_triangles", &check.opposite_triangles),
        ("self_intersections", &check.self_intersections),
    ] {
        out.set_item(name, found(pairs, |pair| pair))?;
    }
    for (name, singles) in [
        ("pinched_vertices", &check.pinched_vertices),
        ("zero_area_triangles", &check.zero_area_triangles),
        ("unreferenced_vertices", &check.unreferenced_vertices),
        ("inside_out_shells", &check.inside_out_shells),
        ("nested_shells", &check.nested_shells),
        ("uncertain_shells", &check.uncertain_shells),
    ] {
        out.set_item(name, found(singles, |index| [index]))?;
    }
    out.set_item("self_intersections_complete", check.self_intersections_complete)?;
    out.set_item("shells", check.shells)?;
    out.set_item("watertight", check.watertight)?;
    out.set_item("consistent", check.consistent)?;
    out.set_item("volume", check.volume)?;
    out.set_item("area", check.area)?;
    Ok(out)
}
