//! Distance transforms of flat arrays.

use numpy::{PyReadonlyArray1, PyReadwriteArray1};
use pyo3::prelude::*;
use truefield::build::transform::{Border, Image, Measure, Skewed, Target, Transform, indices};
use truefield::{DVec3, Error, Result};

use crate::door::{Threads, job, raise};

/// The voxels, of any type that the core reads as it is.
#[derive(FromPyObject)]
pub enum Voxels<'py> {
    U8(PyReadonlyArray1<'py, u8>),
    U16(PyReadonlyArray1<'py, u16>),
    U32(PyReadonlyArray1<'py, u32>),
    U64(PyReadonlyArray1<'py, u64>),
    F32(PyReadonlyArray1<'py, f32>),
    F64(PyReadonlyArray1<'py, f64>),
}

impl Voxels<'_> {
    fn image(&self) -> PyResult<Image<'_>> {
        let image = match self {
            Self::U8(v) => v.as_slice().map(Image::U8),
            Self::U16(v) => v.as_slice().map(Image::U16),
            Self::U32(v) => v.as_slice().map(Image::U32),
            Self::U64(v) => v.as_slice().map(Image::U64),
            Self::F32(v) => v.as_slice().map(Image::F32),
            Self::F64(v) => v.as_slice().map(Image::F64),
        };
        image.map_err(|_| raise(Error::invalid("the image must be C-contiguous")))
    }
}

/// Flat indices of sites.
#[derive(FromPyObject)]
pub enum Sites<'py> {
    U32(PyReadwriteArray1<'py, u32>),
    U64(PyReadwriteArray1<'py, u64>),
}

/// Indices along axes.
#[derive(FromPyObject)]
pub enum Indices<'py> {
    I32(PyReadwriteArray1<'py, i32>),
    I64(PyReadwriteArray1<'py, i64>),
}

/// Runs the same call with sites of either width, or without.
macro_rules! with_sites {
    ($given:expr, |$sites:ident| $call:expr) => {
        match $given {
            None => {
                let $sites = None::<&mut [u32]>;
                $call
            }
            Some(Sites::U32(mut array)) => {
                let $sites = Some(contiguous(array.as_slice_mut())?);
                $call
            }
            Some(Sites::U64(mut array)) => {
                let $sites = Some(contiguous(array.as_slice_mut())?);
                $call
            }
        }
    };
}

/// What is asked of a transform: shape, spacing, periodic axes, target, border, measure, memory.
type Asked = (Vec<usize>, Vec<f64>, Vec<bool>, String, String, String, u64);

/// What is asked of a transform along axes that are not perpendicular: shape, steps, target, measure, memory.
type AskedSkewed = (Vec<usize>, Vec<[f64; 3]>, String, String, u64);

fn target_of(name: &str) -> Result<Target> {
    match name {
        "background" => Ok(Target::Background),
        "foreground" => Ok(Target::Foreground),
        "other_side" => Ok(Target::OtherSide),
        "other_label" => Ok(Target::OtherLabel),
        other => Err(Error::invalid(format!("the target is {other:?}; choose \"background\" or \"other_label\""))),
    }
}

fn measure_of(name: &str) -> Result<Measure> {
    match name {
        "centers" => Ok(Measure::Centers),
        "between" => Ok(Measure::Between),
        other => Err(Error::invalid(format!("the surface is {other:?}; choose \"centers\" or \"between\""))),
    }
}

fn transform<'a>(image: Image<'a>, asked: &'a Asked) -> Result<Transform<'a>> {
    let (shape, spacing, periodic, target, border, measure, memory) = asked;
    let target = target_of(target)?;
    let border = match border.as_str() {
        "nothing" => Border::Nothing,
        "background" => Border::Background,
        "foreground" => Border::Foreground,
        other => {
            return Err(Error::invalid(format!("the border is {other:?}; choose \"nothing\", \"background\" or \"foreground\"")));
        }
    };
    let measure = measure_of(measure)?;
    Ok(Transform { image, shape, spacing, periodic, target, border, measure, memory: *memory })
}

fn contiguous<T>(array: std::result::Result<T, numpy::AsSliceError>) -> PyResult<T> {
    array.map_err(|_| raise(Error::invalid("the output must be C-contiguous")))
}

/// Writes distances and, if given room, the flat indices of the nearest sites.
#[pyfunction]
#[pyo3(signature = (image, asked, out, sites=None, threads=None, progress=None))]
pub fn distance_transform<'py>(
    py: Python<'py>,
    image: Voxels<'py>,
    asked: Asked,
    mut out: PyReadwriteArray1<'py, f32>,
    sites: Option<Sites<'py>>,
    threads: Option<Threads>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<()> {
    let ask = transform(image.image()?, &asked).map_err(raise)?;
    let out = contiguous(out.as_slice_mut())?;
    with_sites!(sites, |sites| job(py, threads, progress, |run| ask.distance(out, sites, run)))
}

/// Writes bounds of the distances to the surface that the image stands for.
#[pyfunction]
#[pyo3(signature = (image, asked, lower, upper, threads=None, progress=None))]
pub fn transform_bounds<'py>(
    py: Python<'py>,
    image: Voxels<'py>,
    asked: Asked,
    mut lower: PyReadwriteArray1<'py, f32>,
    mut upper: PyReadwriteArray1<'py, f32>,
    threads: Option<Threads>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<()> {
    let ask = transform(image.image()?, &asked).map_err(raise)?;
    let (lower, upper) = (contiguous(lower.as_slice_mut())?, contiguous(upper.as_slice_mut())?);
    job(py, threads, progress, |run| ask.bounds(lower, upper, run))
}

/// Writes distances along axes that are not perpendicular and, if given room, the flat indices of the nearest sites.
#[pyfunction]
#[pyo3(signature = (image, asked, out, sites=None, threads=None, progress=None))]
pub fn skewed_transform<'py>(
    py: Python<'py>,
    image: Voxels<'py>,
    asked: AskedSkewed,
    mut out: PyReadwriteArray1<'py, f32>,
    sites: Option<Sites<'py>>,
    threads: Option<Threads>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<()> {
    let steps: Vec<_> = asked.1.iter().copied().map(DVec3::from_array).collect();
    let ask = skewed(image.image()?, &asked, &steps).map_err(raise)?;
    let out = contiguous(out.as_slice_mut())?;
    with_sites!(sites, |sites| job(py, threads, progress, |run| ask.distance(out, sites, run)))
}

fn skewed<'a>(image: Image<'a>, asked: &'a AskedSkewed, steps: &'a [DVec3]) -> Result<Skewed<'a>> {
    let (shape, _, target, measure, memory) = asked;
    Ok(Skewed { image, shape, steps, target: target_of(target)?, measure: measure_of(measure)?, memory: *memory })
}

/// Writes bounds along axes that are not perpendicular, from the distances of centres.
#[pyfunction]
#[pyo3(signature = (image, asked, centres, lower, upper, threads=None, progress=None))]
pub fn skewed_bounds<'py>(
    py: Python<'py>,
    image: Voxels<'py>,
    asked: AskedSkewed,
    centres: PyReadonlyArray1<'py, f32>,
    mut lower: PyReadwriteArray1<'py, f32>,
    mut upper: PyReadwriteArray1<'py, f32>,
    threads: Option<Threads>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<()> {
    let steps: Vec<_> = asked.1.iter().copied().map(DVec3::from_array).collect();
    let ask = skewed(image.image()?, &asked, &steps).map_err(raise)?;
    let (lower, upper) = (contiguous(lower.as_slice_mut())?, contiguous(upper.as_slice_mut())?);
    let centres = contiguous(centres.as_slice())?;
    job(py, threads, progress, |run| ask.bounds(centres, lower, upper, run))
}

/// Writes the index along each axis of every site.
#[pyfunction]
#[pyo3(signature = (sites, shape, out, threads=None, progress=None))]
pub fn site_indices<'py>(
    py: Python<'py>,
    sites: Sites<'py>,
    shape: Vec<usize>,
    out: Indices<'py>,
    threads: Option<Threads>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<()> {
    match (sites, out) {
        (Sites::U32(mut sites), Indices::I32(mut out)) => {
            let (sites, out) = (contiguous(sites.as_slice_mut())?, contiguous(out.as_slice_mut())?);
            job(py, threads, progress, |run| indices(sites, &shape, out, run))
        }
        (Sites::U64(mut sites), Indices::I64(mut out)) => {
            let (sites, out) = (contiguous(sites.as_slice_mut())?, contiguous(out.as_slice_mut())?);
            job(py, threads, progress, |run| indices(sites, &shape, out, run))
        }
        _ => Err(raise(Error::invalid("indices along axes are as wide as flat ones"))),
    }
}
