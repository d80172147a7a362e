//! Flat indices as indices along each axis.

use std::sync::{Mutex, PoisonError};

use super::value::Site;
use crate::error::{Error, Result};
use crate::run::Run;

/// Voxels that a thread takes at once.
const TASK: usize = 1 << 16;

/// An index along an axis, or -1.
pub trait Index: Copy + Send + Sync {
    /// There is no site.
    const NONE: Self;

    /// An index that is known to fit.
    fn of(index: usize) -> Self;
}

impl Index for i32 {
    const NONE: Self = -1;

    fn of(index: usize) -> Self {
        index as Self
    }
}

impl Index for i64 {
    const NONE: Self = -1;

    fn of(index: usize) -> Self {
        index as Self
    }
}

/// Writes the index along each axis of every site: first all along the first axis, then all along the second; -1 for no site.
pub fn indices<S: Site, I: Index>(sites: &[S], shape: &[usize], out: &mut [I], run: &Run<'_>) -> Result<()> {
    let voxels: usize = shape.iter().product();
    if voxels != sites.len() || out.len() != shape.len() * sites.len() {
        return Err(Error::invalid(format!("{} sites of shape {shape:?} have not {} indices", sites.len(), out.len())));
    }
    if sites.is_empty() {
        return Ok(());
    }
    let mut tasks: Vec<Mutex<Vec<&mut [I]>>> = Vec::new();
    for axis in out.chunks_mut(sites.len()) {
        for (task, part) in axis.chunks_mut(TASK).enumerate() {
            match tasks.get_mut(task) {
                Some(parts) => parts.get_mut().unwrap_or_else(PoisonError::into_inner).push(part),
                None => tasks.push(Mutex::new(vec![part])),
            }
        }
    }
    run.blocks("indices", tasks.len(), |task| {
        let mut parts = tasks[task].lock().unwrap_or_else(PoisonError::into_inner);
        let sites = &sites[task * TASK..][..parts[0].len()];
        for (axis, part) in parts.iter_mut().enumerate() {
            let stride: usize = shape[axis + 1..].iter().product();
            let length = shape[axis];
            for (index, &site) in part.iter_mut().zip(sites) {
                *index = site.flat().map_or(I::NONE, |flat| I::of(flat / stride % length));
            }
        }
        Ok(())
    })?;
    Ok(())
}
