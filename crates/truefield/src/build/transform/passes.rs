//! The order of work: which axis, which part of the array, which thread.

use std::sync::{Mutex, PoisonError};

use super::columns::{Band, bands, words};
use super::cost::Axis;
use super::finish::Finish;
use super::panel::{Panel, Pass, Solve, solve_double, solve_whole};
use super::scan::Scan;
use super::value::{LANES, Row, Site, Value};
use super::{Target, Transform};
use crate::error::Result;
use crate::run::Run;

/// Slabs of up to this many voxels are worked on by one thread, which finds them in its cache in the second pass.
const SLAB: usize = 1 << 19;

/// Voxels that a thread takes at once, at least.
const TASK: usize = 1 << 16;

/// Bytes of columns that are copied together, at most, so that memory is read in longer pieces.
const GATHER: usize = 1 << 22;

/// Solves a panel of this kind of number; and what the last pass does to it.
trait Kind: Value {
    fn solve(panel: &mut Panel<Self>, pass: Pass<'_, Self>);

    fn finish(best: &mut [Row<Self>], labels: Option<&[Row<u32>]>, finish: Finish);
}

impl Kind for u32 {
    fn solve(panel: &mut Panel<Self>, pass: Pass<'_, Self>) {
        solve_whole(panel, pass);
    }

    fn finish(best: &mut [Row<Self>], labels: Option<&[Row<u32>]>, finish: Finish) {
        finish.rows(best, labels);
    }
}

impl Kind for f64 {
    fn solve(panel: &mut Panel<Self>, pass: Pass<'_, Self>) {
        solve_double(panel, pass);
    }

    fn finish(_: &mut [Row<Self>], _: Option<&[Row<u32>]>, _: Finish) {}
}

/// A transform in whole numbers, which take the place of the distances until the last pass.
pub(super) fn whole<S: Site>(
    job: &Transform<'_>,
    axes: &[Axis<u32>],
    finish: Finish,
    out: &mut [f32],
    sites: Option<&mut [S]>,
    run: &Run<'_>,
) -> Result<()> {
    let passes = Passes { job, axes, last: Some(finish), run, scratch: Mutex::new(Vec::new()) };
    passes.all(words(out), sites)?;
    if axes.len() == 1 {
        // No second pass has finished them.
        run.chunks("root", out, TASK, |index, part| {
            let mut inside = [0];
            for (i, value) in part.iter_mut().enumerate() {
                *value = signed(job, finish.distance(value.to_bits().to_f64()), index * TASK + i, &mut inside);
            }
            Ok(())
        })?;
    }
    Ok(())
}

/// A transform in double precision, in an array of its own.
pub(super) fn double<S: Site>(
    job: &Transform<'_>,
    axes: &[Axis<f64>],
    finish: Finish,
    out: &mut [f32],
    sites: Option<&mut [S]>,
    run: &Run<'_>,
) -> Result<()> {
    let mut squares = vec![0.0f64; out.len()];
    Passes { job, axes, last: None, run, scratch: Mutex::new(Vec::new()) }.all(&mut squares, sites)?;
    run.chunks("root", out, TASK, |index, part| {
        let mut inside = [0];
        for (i, value) in part.iter_mut().enumerate() {
            let at = index * TASK + i;
            *value = signed(job, finish.distance(squares[at]), at, &mut inside);
        }
        Ok(())
    })
}

/// Minus in the foreground, where distances have a sign.
fn signed(job: &Transform<'_>, distance: f32, at: usize, inside: &mut [u32; 1]) -> f32 {
    match job.target.reading() {
        Some(reading) if job.target == Target::OtherSide => {
            job.image.labels(reading, at, inside);
            if inside[0] == 1 { -distance } else { distance }
        }
        _ => distance,
    }
}

struct Passes<'a, V> {
    job: &'a Transform<'a>,
    axes: &'a [Axis<V>],
    /// What to do in the pass along the first axis.
    last: Option<Finish>,
    run: &'a Run<'a>,
    scratch: Mutex<Vec<Scratch<V>>>,
}

/// Panels that a thread works on, side by side; kept between tasks.
struct Scratch<V> {
    panels: Vec<Panel<V>>,
    line: Vec<V>,
    labels: Vec<u32>,
}

impl<V: Kind> Passes<'_, V> {
    fn all<S: Site>(&self, values: &mut [V], mut sites: Option<&mut [S]>) -> Result<()> {
        let axes = self.axes.len();
        let row = self.axes[axes - 1].length;
        let mut next = axes - 1;
        // The first two passes in one, if slabs are small and many.
        let together = axes >= 3 && self.axes[axes - 2].length * row <= SLAB;
        let block = if together { self.axes[axes - 2].length * row } else { row };
        self.parts("rows", block * TASK.div_ceil(block), values, sites.as_deref_mut(), |start, part, sites| {
            let mut scan = Scan::new(self.job.image, self.job.target, self.job.border, &self.axes[axes - 1], self.run.cancel);
            let mut sites = sites;
            for (i, values) in part.chunks_mut(block).enumerate() {
                let mut sites = sites.as_deref_mut().map(|sites| &mut sites[i * block..][..values.len()]);
                for (k, line) in values.chunks_mut(row).enumerate() {
                    let sites = sites.as_deref_mut().map(|sites| &mut sites[k * row..][..row]);
                    scan.row(start + i * block + k * row, line, sites)?;
                }
                if together {
                    let start = start + i * block;
                    self.sweep(axes - 2, &mut Band::whole(values, row, start), &mut sites.map(|s| Band::whole(s, row, start)))?;
                }
            }
            Ok(())
        })?;
        if together {
            next -= 1;
        }
        for axis in (0..next).rev() {
            self.along(axis, values, sites.as_deref_mut())?;
        }
        Ok(())
    }

    /// The pass along one axis.
    fn along<S: Site>(&self, axis: usize, values: &mut [V], sites: Option<&mut [S]>) -> Result<()> {
        let rows = self.axes[axis].length;
        let stride: usize = self.axes[axis + 1..].iter().map(|axis| axis.length).product();
        let slab = rows * stride;
        if slab <= SLAB && slab < values.len() {
            return self.parts("columns", slab * TASK.div_ceil(slab), values, sites, |start, part, sites| {
                let mut sites = sites;
                for (i, values) in part.chunks_mut(slab).enumerate() {
                    let sites = sites.as_deref_mut().map(|sites| &mut sites[i * slab..][..slab]);
                    let start = start + i * slab;
                    self.sweep(axis, &mut Band::whole(values, stride, start), &mut sites.map(|s| Band::whole(s, stride, start)))?;
                }
                Ok(())
            });
        }
        let width = (TASK.div_ceil(rows)).next_multiple_of(LANES * self.abreast(axis));
        let values = bands(values, rows, stride, width);
        let sites: Vec<_> = match sites {
            Some(sites) => bands(sites, rows, stride, width).into_iter().map(Some).collect(),
            None => values.iter().map(|_| None).collect(),
        };
        let tasks: Vec<_> = values.into_iter().zip(sites).map(Mutex::new).collect();
        self.run.blocks("columns", tasks.len(), |index| {
            let mut task = tasks[index].lock().unwrap_or_else(PoisonError::into_inner);
            let (values, sites) = &mut *task;
            self.sweep(axis, values, sites)
        })?;
        Ok(())
    }

    /// Runs `work(start, values, sites)` over parts of at most `length` items.
    fn parts<S: Site>(
        &self,
        phase: &'static str,
        length: usize,
        values: &mut [V],
        sites: Option<&mut [S]>,
        work: impl Fn(usize, &mut [V], Option<&mut [S]>) -> Result<()> + Sync,
    ) -> Result<()> {
        let count = values.len().div_ceil(length);
        let sites: Vec<_> = match sites {
            Some(sites) => sites.chunks_mut(length).map(Some).collect(),
            None => (0..count).map(|_| None).collect(),
        };
        let tasks: Vec<_> = values.chunks_mut(length).zip(sites).map(Mutex::new).collect();
        self.run.blocks(phase, count, |index| {
            let mut task = tasks[index].lock().unwrap_or_else(PoisonError::into_inner);
            let (values, sites) = &mut *task;
            work(index * length, values, sites.as_deref_mut())
        })?;
        Ok(())
    }

    /// Panels that are copied together.
    fn abreast(&self, axis: usize) -> usize {
        (GATHER / (self.axes[axis].length * size_of::<Row<V>>())).clamp(1, 16)
    }

    /// The pass along one axis in a band of columns.
    fn sweep<S: Site>(&self, axis: usize, values: &mut Band<'_, V>, sites: &mut Option<Band<'_, S>>) -> Result<()> {
        let Axis { length, periodic, cost, base, .. } = &self.axes[axis];
        let (length, base) = (*length, *base);
        let reading = self.job.target.reading();
        let before = match self.job.border {
            _ if *periodic => length / 2,
            super::Border::Nothing => 0,
            _ => 1,
        };
        let finish = if axis == 0 { self.last } else { None };
        let abreast = self.abreast(axis);
        let pooled = self.scratch.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut scratch = pooled.unwrap_or_else(|| Scratch { panels: Vec::new(), line: Vec::new(), labels: Vec::new() });
        scratch.panels.resize_with(abreast.max(scratch.panels.len()), Panel::default);
        scratch.line.resize(abreast * LANES, V::FAR);
        scratch.labels.resize(abreast * LANES, 0);
        let Scratch { panels, line, labels } = &mut scratch;
        let mut origin: Vec<Row<S>> = Vec::new();
        for column in (0..values.width).step_by(abreast * LANES) {
            self.run.cancel.check()?;
            let width = (values.width - column).min(abreast * LANES);
            let panels = &mut panels[..width.div_ceil(LANES)];
            for panel in panels.iter_mut() {
                panel.prepare(length, before, reading.is_some());
            }
            let mut still = cost[0] == V::default() && reading.is_none();
            for row in 0..length {
                values.read(row, column, &mut line[..width]);
                still = still && !line[..width].iter().fold(false, |any, &value| any | (value != V::default()));
                // Lanes to spare do what their neighbour does.
                let spare = line[width - 1];
                line[width..width.next_multiple_of(LANES)].fill(spare);
                for (panel, lanes) in panels.iter_mut().zip(line.as_chunks::<LANES>().0) {
                    panel.values[row + before] = *lanes;
                }
                if let Some(reading) = reading {
                    self.job.image.labels(reading, values.index(row, column), &mut labels[..width]);
                    let spare = labels[width - 1];
                    labels[width..width.next_multiple_of(LANES)].fill(spare);
                    for (panel, lanes) in panels.iter_mut().zip(labels.as_chunks::<LANES>().0) {
                        panel.labels[row + before] = *lanes;
                    }
                }
            }
            if still {
                // All are sites, and zero is zero after the root as well.
                continue;
            }
            let solve = if sites.is_some() { Solve::Nearest } else { Solve::Least };
            for (i, panel) in panels.iter_mut().enumerate() {
                self.surround(panel, before, *periodic, base);
                V::solve(panel, Pass { cost, base, solve });
                if let Some(sites) = sites {
                    let column = column + i * LANES;
                    let width = (width - i * LANES).min(LANES);
                    trace(panel, sites, column, width, before, *periodic, &mut origin);
                }
                if let Some(finish) = finish {
                    let sides = (self.job.target == Target::OtherSide).then(|| &panel.labels[before..before + length]);
                    V::finish(&mut panel.best, sides, finish);
                }
            }
            for row in 0..length {
                for (panel, lanes) in panels.iter().zip(line.as_chunks_mut::<LANES>().0) {
                    *lanes = panel.best[row];
                }
                values.write(row, column, &line[..width]);
            }
        }
        self.scratch.lock().unwrap_or_else(PoisonError::into_inner).push(scratch);
        Ok(())
    }

    /// The rows before the first and after the last: the border, or the other end of a periodic axis.
    fn surround(&self, panel: &mut Panel<V>, before: usize, periodic: bool, base: V) {
        let rows = panel.values.len();
        if periodic {
            let length = rows - 2 * before;
            panel.values.copy_within(length..length + before, 0);
            panel.values.copy_within(before..2 * before, before + length);
            if !panel.labels.is_empty() {
                panel.labels.copy_within(length..length + before, 0);
                panel.labels.copy_within(before..2 * before, before + length);
            }
        } else if before > 0 {
            let (target, border) = (self.job.target, self.job.border);
            for row in [0, rows - 1] {
                let site = target.reading().is_none() && border == target.border();
                panel.values[row] = [if site { base } else { V::FAR }; LANES];
                if !panel.labels.is_empty() {
                    let label = match border {
                        super::Border::Background => 0,
                        // No label, so that it is another one to all.
                        _ if target == Target::OtherLabel => u32::MAX,
                        _ => 1,
                    };
                    panel.labels[row] = [label; LANES];
                }
            }
        }
    }
}

/// Hands on the sites that the rows of a solved panel come from.
fn trace<V: Value, S: Site>(
    panel: &Panel<V>,
    sites: &mut Band<'_, S>,
    column: usize,
    width: usize,
    before: usize,
    periodic: bool,
    origin: &mut Vec<Row<S>>,
) {
    let length = panel.best.len();
    origin.clear();
    origin.resize(length, [S::NONE; LANES]);
    for (row, lanes) in origin.iter_mut().enumerate() {
        sites.read(row, column, &mut lanes[..width]);
    }
    let mut found = [S::NONE; LANES];
    for (row, from) in panel.from.iter().enumerate() {
        for lane in 0..width {
            let from = from[lane] as usize;
            let inner = (from + length).wrapping_sub(before);
            found[lane] = match origin.get(if periodic { inner % length } else { inner.wrapping_sub(length) }) {
                // A row of another label is a site itself.
                Some(_) if !panel.labels.is_empty() && panel.labels[from][lane] != panel.labels[row + before][lane] => {
                    S::of(sites.index(if periodic { inner % length } else { inner - length }, column + lane))
                }
                Some(lanes) => lanes[lane],
                None => S::NONE,
            };
        }
        sites.write(row, column, &found[..width]);
    }
}
