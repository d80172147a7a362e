//! The hybrid marching wavefront: rings of voxels that pass on where their nearest site is.
//!
//! *Bounded distance transforms of trimmed NURBS*, Algorithm 1: in each pass every voxel looks at the sites its 26
//! (in the plane 8) neighbours had before the pass and keeps the one nearest to itself, so that distances are those of
//! a site that is there and no error of marching adds up. The paper keeps two buffers; here what a pass finds is
//! applied after it, and segments of rows look only at neighbours that changed in the pass before and whose site is ahead of
//! them. Neither changes a bit of the outcome. It ends when nothing changed.
//!
//! Passes in step make it exact (Theorem 1, by another proof): after pass m each voxel v has the nearest of the sites that
//! are at most m steps away along every axis. Let s be such a site, m steps away along some axes, and u the neighbour of v one
//! step nearer to s along those. After pass m - 1, u has a site r with |u - r| <= |u - s|, at most m - 1 steps away along
//! every axis. A step away from r adds at most 2 m - 1 to a squared number of steps, which is what the step from u to v adds for s;
//! so |v - r| <= |v - s|, whatever the sampling. It follows that the longest axis bounds the passes: one less than its
//! voxels; and that what changes in pass m has a site m steps away along some axis, and hands it on that way only. Without passes in step neither holds ([`super::march`]; Danielsson 1980), and [`super::difference`] counts.

mod metric;
mod planes;
mod ring;

use std::sync::{Mutex, PoisonError};

use super::raster::{NO_SITE, Raster, check_limit};
use crate::error::{Error, Result};
use crate::run::{Run, Silent};
use metric::{Metric, Scaled, Whole};
use planes::{LANES, Layout, Part, Planes};
use ring::{Changed, Found, Look, Ringed};

/// Passes over fewer segments than this are not worth waking threads.
const ALONE: usize = 1000;

/// Segments between two looks at the flag that cancels.
const CHUNK: usize = 4096;

/// Most voxels along an axis: offsets are kept in 16 bits.
const LONGEST: usize = i16::MAX as usize;

/// What a wavefront leaves behind.
#[derive(Clone, Debug, PartialEq)]
pub struct Wavefront {
    /// For each voxel the linear index of its site; [`NO_SITE`] where none came within the limit.
    pub sites: Vec<u32>,
    /// Distances to the centre of the site, rounded to nearest; infinite without a site.
    pub distance: Vec<f32>,
    /// How many voxels each pass changed. The pass that changed nothing and ended the march is not listed.
    pub changed: Vec<u64>,
}

/// Marches from the voxels marked in `sites` over a volume of `shape` (x slowest), at most to `limit`.
///
/// Takes 1 to 3 axes of at most 32,767 voxels; `sampling` is the distance of neighbouring voxels along each. Where
/// several neighbours offer sites that are equally near, the first in the order of indices passes its own on. Takes 18
/// to 22 bytes a voxel and 12 to 16 for every voxel that a pass changes; refuses more than `memory` bytes.
pub fn wavefront(shape: &[usize], sampling: &[f64], sites: &[bool], limit: f64, memory: u64, run: &Run<'_>) -> Result<Wavefront> {
    let raster = Raster::new(shape, sampling)?;
    raster.check_marks(sites)?;
    if let Some(n) = raster.shape.iter().find(|n| **n > LONGEST) {
        return Err(Error::invalid(format!("an axis has {n} voxels; a wavefront takes at most {LONGEST}, the exact transform any number")));
    }
    check_limit(limit)?;
    if sites.is_empty() {
        return Ok(Wavefront { sites: Vec::new(), distance: Vec::new(), changed: Vec::new() });
    }
    let layout = Layout::new(&raster);
    if layout.len() > u32::MAX as usize {
        return Err(Error::invalid(format!("{shape:?} voxels are too many for one wavefront; march them in parts")));
    }
    let [x, y, z] = raster.sampling;
    let diagonal: u64 = raster.shape.iter().map(|&n| (n * n) as u64).sum();
    let whole = x == y && y == z && diagonal < Whole::LARGEST;
    let needed = (if whole { 10 } else { 14 }) * layout.len() as u64 + 8 * raster.len() as u64;
    if needed > memory {
        return Err(Error::Memory { what: format!("a wavefront over {shape:?} voxels"), needed, allowed: memory });
    }
    if whole { go(layout, Whole::new(x, limit), sites, run) } else { go(layout, Scaled::new(raster.sampling, limit), sites, run) }
}

/// A slab's part of the work.
#[derive(Debug, Default)]
struct Agenda {
    /// For each segment of the slab the neighbours it has to look at.
    wanted: Vec<u32>,
    /// The segments that have to look at any.
    looks: Vec<Look>,
}

fn go<M: Ringed>(layout: Layout, metric: M, sites: &[bool], run: &Run<'_>) -> Result<Wavefront> {
    let (quiet, progress) = (Run { progress: &Silent, ..*run }, run.progress);
    let mut planes = Planes::new(layout, metric, sites, &quiet)?;
    let (slabs, directions) = (layout.slabs(), directions());
    let mut agendas: Vec<Mutex<Agenda>> = Vec::new();
    agendas.resize_with(slabs, Mutex::default);
    let mut found: Vec<Found<M::Key>> = quiet.blocks("wavefront", slabs, |slab| Ok(seeds(&planes, slab)))?;
    let mut reached = sites.iter().filter(|site| **site).count();
    let mut changed = Vec::new();
    loop {
        let segments: usize = found.iter().map(|found| found.segments.len()).sum();
        let run = Run { threads: if segments < ALONE { 1 } else { quiet.threads }, ..quiet };
        let parts: Vec<Mutex<Part<'_, M>>> = planes.parts().into_iter().map(Mutex::new).collect();
        run.blocks("wavefront", slabs, |slab| {
            apply(&layout, slab, &found, &mut parts[slab].lock().unwrap_or_else(PoisonError::into_inner));
            plan(&layout, &directions, slab, &found, &mut agendas[slab].lock().unwrap_or_else(PoisonError::into_inner));
            Ok(())
        })?;
        drop(parts);
        let pass = changed.len() as u16 + 1;
        found = run.blocks("wavefront", slabs, |slab| {
            let agenda = agendas[slab].lock().unwrap_or_else(PoisonError::into_inner);
            let mut found = Found::default();
            for looks in agenda.looks.chunks(CHUNK) {
                run.cancel.check()?;
                M::ring(&planes, pass, looks, &mut found);
            }
            Ok(found)
        })?;
        let count: usize = found.iter().map(|found| found.voxels.len()).sum();
        if count == 0 {
            break;
        }
        changed.push(count as u64);
        reached += found.iter().map(|found| found.reached).sum::<usize>();
        progress.report("wavefront", reached, sites.len());
    }
    read(&planes, changed, &quiet)
}

/// The segments of a slab that hold sites.
fn seeds<M: Metric>(planes: &Planes<M>, slab: usize) -> Found<M::Key> {
    let (layout, mut found) = (&planes.layout, Found::default());
    for row in layout.rows(slab) {
        for segment in 0..layout.segments() {
            let at = layout.start(row) + segment * LANES;
            let keys = planes.key[at..at + LANES].iter().enumerate();
            let voxels = keys.fold(0, |bits, (lane, key)| bits | u16::from(*key == M::SITE) << lane);
            if voxels != 0 {
                found.segments.push(Changed { row: row as u32, segment: segment as u32, voxels, ahead: 63 });
            }
        }
    }
    found
}

/// Gives the voxels of a slab the state that was found for them.
fn apply<M: Metric>(layout: &Layout, slab: usize, found: &[Found<M::Key>], part: &mut Part<'_, M>) {
    let start = layout.inner().start + slab * layout.slab_length();
    let mut changes = found[slab].voxels.iter();
    // Seeds are segments without changes.
    for changed in &found[slab].segments {
        let at = layout.start(changed.row as usize) + changed.segment as usize * LANES - start;
        let keys = part.key[at..].first_chunk_mut::<LANES>();
        let offsets = part.offset.each_mut().map(|offset| offset[at..].first_chunk_mut::<LANES>());
        let (Some(keys), [Some(x), Some(y), Some(z)]) = (keys, offsets) else { return };
        let mut rest = changed.voxels;
        while rest != 0 {
            let Some(change) = changes.next() else { return };
            let lane = rest.trailing_zeros() as usize % LANES;
            rest &= rest - 1;
            keys[lane] = change.key;
            [x[lane], y[lane], z[lane]] = change.offset;
        }
    }
}

/// A row that a change is ahead of.
#[derive(Clone, Copy, Debug, Default)]
struct Toward {
    x: isize,
    y: isize,
    /// For neighbours before, beside and after a voxel of it, which the front reaches upward, straight and downward.
    bits: u32,
    /// Where these bits stand among its neighbours: seen from there, the change is in the row the other way.
    shift: u32,
}

/// The rows ahead of a change, for each set of directions.
fn directions() -> Vec<Vec<Toward>> {
    let rows = |ahead: u8| {
        let meets = move |axis: usize, step: isize| step != 0 && ahead >> (2 * axis + usize::from(step < 0)) & 1 != 0;
        let toward = move |n: isize| {
            let (x, y) = (n / 3 - 1, n % 3 - 1);
            let bits = if meets(0, x) || meets(1, y) { 7 } else { u32::from(meets(2, 1)) | u32::from(meets(2, -1)) << 2 };
            Toward { x, y, bits, shift: 3 * (8 - n) as u32 }
        };
        (0..9).map(toward).filter(|toward| toward.bits != 0).collect()
    };
    (0..64).map(rows).collect()
}

/// Which segments of a slab have to look at which neighbours, after what changed in it and beside it.
fn plan<K>(layout: &Layout, directions: &[Vec<Toward>], slab: usize, found: &[Found<K>], agenda: &mut Agenda) {
    let (rows, around, segments) = (layout.rows(slab), layout.rows_around(slab), layout.segments());
    let Agenda { wanted, looks } = agenda;
    wanted.resize(rows.len() * segments, 0);
    looks.clear();
    let beside = &found[slab.saturating_sub(1)..(slab + 2).min(found.len())];
    for changed in beside.iter().flat_map(|found| &found.segments).filter(|changed| around.contains(&(changed.row as usize))) {
        let (place, segment) = (layout.place(changed.row as usize), changed.segment as usize);
        let before = changed.voxels & 1 != 0 && segment > 0;
        let after = changed.voxels >> (LANES - 1) != 0 && segment + 1 < segments;
        for toward in &directions[usize::from(changed.ahead)] {
            let Some(row) = layout.row(place, toward.x, toward.y).filter(|row| rows.contains(row)) else { continue };
            let start = (row - rows.start) * segments;
            let mut mark = |segment: usize, bits: u32| {
                let wanted = &mut wanted[start + segment];
                if *wanted == 0 && bits != 0 {
                    looks.push(Look { row: row as u32, segment: segment as u32, neighbours: 0 });
                }
                *wanted |= bits << toward.shift;
            };
            mark(segment, toward.bits);
            if before {
                mark(segment - 1, toward.bits & 4);
            }
            if after {
                mark(segment + 1, toward.bits & 1);
            }
        }
    }
    for look in looks {
        look.neighbours = std::mem::take(&mut wanted[(look.row as usize - rows.start) * segments + look.segment as usize]);
    }
}

/// Sites and distances.
fn read<M: Metric>(planes: &Planes<M>, changed: Vec<u64>, run: &Run<'_>) -> Result<Wavefront> {
    let (layout, n) = (&planes.layout, planes.layout.shape[2]);
    let count = layout.shape.iter().product();
    let strides = [(layout.shape[1] * n) as i64, n as i64, 1];
    let mut sites = vec![NO_SITE; count];
    run.chunks("wavefront", &mut sites, layout.slab_voxels(), |slab, part| {
        for (row, out) in layout.rows(slab).zip(part.chunks_exact_mut(n)) {
            let start = layout.start(row);
            for (k, out) in out.iter_mut().enumerate().filter(|(k, _)| planes.key[start + k] != M::NONE) {
                let back: i64 = (0..3).map(|axis| i64::from(planes.offset[axis][start + k]) * strides[axis]).sum();
                *out = ((row * n + k) as i64 - back) as u32;
            }
        }
        Ok(())
    })?;
    let mut distance = vec![f32::INFINITY; count];
    run.chunks("wavefront", &mut distance, layout.slab_voxels(), |slab, part| {
        for (row, out) in layout.rows(slab).zip(part.chunks_exact_mut(n)) {
            let keys = &planes.key[layout.start(row)..];
            for (out, key) in out.iter_mut().zip(keys).filter(|(_, key)| **key != M::NONE) {
                *out = planes.metric.length(*key) as f32;
            }
        }
        Ok(())
    })?;
    Ok(Wavefront { sites, distance, changed })
}
