//! Distance transforms of flat arrays.

use numpy::{PyReadonlyArray1, PyReadwriteArray1};
use pyo3::prelude::*;
use truefield::build::transform::{Border, Image, Measure, Target, Transform, indices};
use truefield::{Error, Result};

use crate::door::{job, raise};

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

/// What is asked of a transform: shape, spacing, periodic axes, target, border, measure, memory.
type Asked = (Vec<usize>, Vec<f64>, Vec<bool>, String, String, String, u64);

fn transform<'a>(image: Image<'a>, asked: &'a Asked) -> Result<Transform<'a>> {
    let (shape, spacing, periodic, target, border, measure, memory) = asked;
    let target = match target.as_str() {
        "background" => Target::Background,
        "foreground" => Target::Foreground,
        "other_side" => Target::OtherSide,
        "other_label" => Target::OtherLabel,
        other => return Err(Error::invalid(format!("the target is {other:?}; choose \"background\" or \"other_label\""))),
    };
    let border = match border.as_str() {
        "nothing" => Border::Nothing,
        "background" => Border::Background,
        "foreground" => Border::Foreground,
        other => {
            return Err(Error::invalid(format!("the border is {other:?}; choose \"nothing\", \"background\" or \"foreground\"")));
        }
    };
    let measure = match measure.as_str() {
        "centers" => Measure::Centers,
        "between" => Measure::Between,
        other => return Err(Error::invalid(format!("the surface is {other:?}; choose \"centers\" or \"between\""))),
    };
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
    threads: Option<usize>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<()> {
    let ask = transform(image.image()?, &asked).map_err(raise)?;
    let out = contiguous(out.as_slice_mut())?;
    match sites {
        None => job(py, threads, progress, |run| ask.distance(out, None::<&mut [u32]>, run)),
        Some(Sites::U32(mut sites)) => {
            let sites = contiguous(sites.as_slice_mut())?;
            job(py, threads, progress, |run| ask.distance(out, Some(sites), run))
        }
        Some(Sites::U64(mut sites)) => {
            let sites = contiguous(sites.as_slice_mut())?;
            job(py, threads, progress, |run| ask.distance(out, Some(sites), run))
        }
    }
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
    threads: Option<usize>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<()> {
    let ask = transform(image.image()?, &asked).map_err(raise)?;
    let (lower, upper) = (contiguous(lower.as_slice_mut())?, contiguous(upper.as_slice_mut())?);
    job(py, threads, progress, |run| ask.bounds(lower, upper, run))
}

/// Writes the index along each axis of every site.
#[pyfunction]
#[pyo3(signature = (sites, shape, out, threads=None, progress=None))]
pub fn site_indices<'py>(
    py: Python<'py>,
    sites: Sites<'py>,
    shape: Vec<usize>,
    out: Indices<'py>,
    threads: Option<usize>,
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
