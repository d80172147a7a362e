//! Adaptive fields edited, cut to less detail, made of samples, and as arrays for files.

use std::sync::Arc;

use numpy::{Element, IntoPyArray, PyArray1, PyArrayMethods, PyReadonlyArray1, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyIterator, PyList};
use truefield::build::adaptive::{Rules, coalesce};
use truefield::field::adaptive::{
    Accuracy, AdaptiveField, Change, Coverage, Division, Edit, Edits, Level, LevelKind, Levels, ListSide, Lists, Record, Root,
};
use truefield::op::edit::{Operation, edit};
use truefield::op::level_of_detail::{Detail, level_of_detail};
use truefield::source::polygon::{Fill, Polygon};
use truefield::{Aabb, Continuity, DVec3, Error};

use crate::adaptive::PyAdaptiveField;
use crate::door::{Threads, job, raise};
use crate::sampled::PySampledField;
use crate::shape::PyShape;
use crate::surface::PySurface;

/// Numbers of a cell in a file: eight corners, lower and upper error.
const RECORD: usize = 10;

/// Numbers of an edit in a file: 0 where the shape shrank or 1 where it grew, two boxes and an anchor.
const EDIT: usize = 16;

/// The field edited with a tool.
#[pyfunction]
#[pyo3(signature = (field, tool, operation, radius, memory, threads=None, progress=None))]
pub fn edit_field(
    py: Python<'_>,
    field: &PyAdaptiveField,
    tool: &PyShape,
    operation: &str,
    radius: f64,
    memory: u64,
    threads: Option<Threads>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<PyAdaptiveField> {
    let operation = match operation {
        "carve" => Operation::Carve,
        "fill" => Operation::Fill,
        "intersect" => Operation::Intersect,
        "blend" => Operation::Blend(radius),
        _ => {
            return Err(raise(Error::invalid(format!(
                "operation is {operation:?}; choose \"carve\", \"fill\", \"intersect\" or \"blend\""
            ))));
        }
    };
    let (field, tool) = (&field.field, Arc::clone(&tool.0));
    let edited = job(py, threads, progress, |run| edit(field, &*tool, operation, memory, run))?;
    Ok(PyAdaptiveField::of(edited))
}

/// The field cut below cells that are good enough, or below a depth.
#[pyfunction]
#[pyo3(name = "level_of_detail", signature = (field, tolerance, depth, threads=None, progress=None))]
pub fn less_detail(
    py: Python<'_>,
    field: &PyAdaptiveField,
    tolerance: Option<f64>,
    depth: Option<u32>,
    threads: Option<Threads>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<PyAdaptiveField> {
    let detail = match (tolerance, depth) {
        (Some(tolerance), None) => Detail::Tolerance(tolerance),
        (None, Some(depth)) => Detail::Depth(depth),
        _ => return Err(raise(Error::invalid("give a tolerance or a depth, one of both"))),
    };
    let field = &field.field;
    Ok(PyAdaptiveField::of(job(py, threads, progress, |run| level_of_detail(field, detail, run))?))
}

/// The adaptive field of samples.
#[pyfunction]
#[pyo3(signature = (samples, tolerance, growth, max_depth, memory, threads=None, progress=None))]
pub fn merged_samples(
    py: Python<'_>,
    samples: &PySampledField,
    tolerance: f64,
    growth: f64,
    max_depth: u32,
    memory: u64,
    threads: Option<Threads>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<PyAdaptiveField> {
    let rules = Rules { growth, max_depth, memory, ..Rules::within(tolerance) };
    let samples = &samples.0;
    Ok(PyAdaptiveField::of(job(py, threads, progress, |run| coalesce(samples, &rules, run))?))
}

/// Loops of corners in the plane, as a shape that is the same at every height.
#[pyfunction]
pub fn polygon(loops: Vec<Vec<[f64; 2]>>, fill: &str) -> PyResult<PyShape> {
    let fill = match fill {
        "even_odd" => Fill::EvenOdd,
        "winding" => Fill::Winding,
        _ => return Err(raise(Error::invalid(format!("fill is {fill:?}; choose \"even_odd\" or \"winding\"")))),
    };
    Polygon::new(&loops, fill).map(PyShape::of).map_err(raise)
}

/// Everything of a field: a dictionary of what is said once, and one of arrays for every level.
#[pyfunction]
#[pyo3(name = "adaptive_field_levels", signature = (field, threads=None, progress=None))]
pub fn levels_of<'py>(
    py: Python<'py>,
    field: &PyAdaptiveField,
    threads: Option<Threads>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<(Bound<'py, PyDict>, Bound<'py, PyList>)> {
    let inner = &field.field;
    let levels = job(py, threads, progress, |_| Ok(inner.to_levels()))?;
    let about = PyDict::new(py);
    about.set_item("extent", [levels.root.extent.min.to_array(), levels.root.extent.max.to_array()])?;
    about.set_item("children", levels.root.division.children())?;
    about.set_item("continuous", levels.continuity == Continuity::Everywhere)?;
    about.set_item("coverage", coverage_name(levels.coverage))?;
    about.set_item("tolerance", levels.accuracy.tolerance)?;
    about.set_item("growth", levels.accuracy.growth)?;
    about.set_item("max_depth", levels.accuracy.max_depth)?;
    about.set_item("rule", crate::adaptive::rule_name(levels.accuracy.rule))?;
    let edits: Vec<f64> = levels.edits.list().iter().flat_map(written).collect();
    about.set_item("edits", edits.into_pyarray(py))?;
    let out = PyList::empty(py);
    for level in levels.levels {
        let one = PyDict::new(py);
        let records = level.records.iter().flat_map(|r| r.corners.into_iter().chain([r.lower, r.upper]));
        one.set_item("records", records.collect::<Vec<f32>>().into_pyarray(py))?;
        one.set_item("cubics", level.cubics.into_flattened().into_pyarray(py))?;
        one.set_item("ends", level.lists.ends.into_pyarray(py))?;
        one.set_item("triangles", level.lists.triangles.into_pyarray(py))?;
        one.set_item("kinds", level.kinds.iter().map(|kind| *kind as u8).collect::<Vec<u8>>().into_pyarray(py))?;
        one.set_item("sides", level.lists.sides.iter().map(|side| *side as u8).collect::<Vec<u8>>().into_pyarray(py))?;
        out.append(one)?;
    }
    Ok((about, out))
}

/// The field that such dictionaries describe, each let go when it was read; what is deeper than the last was left out.
#[pyfunction]
#[pyo3(name = "adaptive_field_from_levels", signature = (about, levels, surface, threads=None, progress=None))]
pub fn field_of_levels(
    py: Python<'_>,
    about: &Bound<'_, PyDict>,
    levels: &Bound<'_, PyIterator>,
    surface: Option<&PySurface>,
    threads: Option<Threads>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<PyAdaptiveField> {
    let [min, max]: [[f64; 3]; 2] = said(about, "extent")?;
    let root =
        Root { extent: Aabb::new(min.into(), max.into()), division: Division::with_children(said(about, "children")?).map_err(raise)? };
    let continuity = if said(about, "continuous")? { Continuity::Everywhere } else { Continuity::ExceptOpenings };
    let accuracy = Accuracy {
        tolerance: said(about, "tolerance")?,
        growth: said(about, "growth")?,
        max_depth: said(about, "max_depth")?,
        rule: crate::adaptive::rule(&said::<String>(about, "rule")?)?,
    };
    let mut all = Levels::new(root, continuity, accuracy);
    all.coverage = coverage(&said::<String>(about, "coverage")?)?;
    let edits = array::<f64>(about, "edits")?;
    all.edits = Edits::new(edits.as_slice()?.chunks(EDIT).map(read).collect::<truefield::Result<_>>().map_err(raise)?);
    for level in levels {
        let level = level?;
        let level = level.cast::<PyDict>().map_err(|_| damaged("a level is no dictionary"))?;
        let (records, cubics) = (array::<f32>(level, "records")?, array::<f32>(level, "cubics")?);
        let (records, rest) = records.as_slice()?.as_chunks::<RECORD>();
        let (cubics, rest_of_cubics) = cubics.as_slice()?.as_chunks::<64>();
        if !rest.is_empty() || !rest_of_cubics.is_empty() {
            return Err(damaged("a level has half a cell"));
        }
        let (kinds, sides) = (array::<u8>(level, "kinds")?, array::<u8>(level, "sides")?);
        let kind = |&kind: &u8| match kind {
            0 => Ok(LevelKind::Branch),
            1 => Ok(LevelKind::Linear),
            2 => Ok(LevelKind::Cubic),
            3 => Ok(LevelKind::Exact),
            _ => Err(damaged("a level has cells of no known kind")),
        };
        let side = |&side: &u8| match side {
            0 => Ok(ListSide::Asked),
            1 => Ok(ListSide::Inside),
            2 => Ok(ListSide::Outside),
            _ => Err(damaged("a level has lists of no known side")),
        };
        let record = |&[a, b, c, d, e, f, g, h, lower, upper]: &[f32; RECORD]| Record { corners: [a, b, c, d, e, f, g, h], lower, upper };
        all.levels.push(Level {
            kinds: kinds.as_slice()?.iter().map(kind).collect::<PyResult<_>>()?,
            records: records.iter().map(record).collect(),
            cubics: cubics.to_vec(),
            lists: Lists {
                ends: array::<u32>(level, "ends")?.as_slice()?.to_vec(),
                sides: sides.as_slice()?.iter().map(side).collect::<PyResult<_>>()?,
                triangles: array::<u32>(level, "triangles")?.as_slice()?.to_vec(),
            },
        });
    }
    all.cut(all.levels.len().saturating_sub(1) as u32);
    let surface = surface.map(|surface| Arc::clone(&surface.0));
    let field = job(py, threads, progress, |run| AdaptiveField::from_levels(&all, surface, run))?;
    Ok(PyAdaptiveField::of(field))
}

fn written(edit: &Edit) -> Vec<f64> {
    let mut out = vec![if edit.change == Change::Grown { 1.0 } else { 0.0 }];
    for corner in [edit.extent.min, edit.extent.max, edit.reach.min, edit.reach.max, edit.anchor.unwrap_or(DVec3::NAN)] {
        out.extend(corner.to_array());
    }
    out
}

fn read(row: &[f64]) -> truefield::Result<Edit> {
    let corner = |number: usize| DVec3::from_slice(&row[1 + 3 * number..]);
    if row.len() != EDIT || !(row[0] == 0.0 || row[0] == 1.0) {
        return Err(Error::Format("its edits are incomplete; the file is damaged, write it again".into()));
    }
    let change = if row[0] == 1.0 { Change::Grown } else { Change::Shrunk };
    let anchor = Some(corner(4)).filter(|anchor| !anchor.is_nan());
    Ok(Edit { change, extent: Aabb::new(corner(0), corner(1)), reach: Aabb::new(corner(2), corner(3)), anchor })
}

fn coverage_name(coverage: Coverage) -> &'static str {
    match coverage {
        Coverage::Whole => "whole",
        Coverage::Unknown => "unknown",
    }
}

fn coverage(name: &str) -> PyResult<Coverage> {
    match name {
        "whole" => Ok(Coverage::Whole),
        "unknown" => Ok(Coverage::Unknown),
        _ => Err(damaged("what it says of its domain is no known word")),
    }
}

fn damaged(what: &str) -> PyErr {
    raise(Error::Format(format!("{what}; the file is damaged, write it again")))
}

fn said<'py, T: for<'a> FromPyObject<'a, 'py>>(about: &Bound<'py, PyDict>, name: &str) -> PyResult<T> {
    let value = about.get_item(name)?.ok_or_else(|| damaged(&format!("{name} is missing")))?;
    value.extract().map_err(|_| damaged(&format!("{name} cannot be used")))
}

/// An array that is flat and without gaps.
fn array<'py, T: Element>(of: &Bound<'py, PyDict>, name: &str) -> PyResult<PyReadonlyArray1<'py, T>> {
    let found = of.get_item(name)?.and_then(|value| value.cast_into::<PyArray1<T>>().ok()).map(|array| array.readonly());
    let found = found.ok_or_else(|| damaged(&format!("{name} is no array of its kind")))?;
    if found.is_contiguous() { Ok(found) } else { Err(damaged(&format!("{name} is not contiguous"))) }
}
