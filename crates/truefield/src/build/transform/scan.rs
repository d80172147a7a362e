//! The first pass, along the contiguous axis: distances to the nearest site of the same row, by runs.

use super::cost::Axis;
use super::image::{Image, Reading};
use super::value::{Site, Value};
use super::{Border, Target};
use crate::error::Result;
use crate::run::Cancel;

/// Gaps up to this long are filled item by item.
const SHORT: usize = 8;

/// Words of 64 voxels between looks at the flag that cancels.
const WORDS: usize = 1 << 14;

/// The row pass of a transform; one for each thread.
pub(super) struct Scan<'a, V> {
    pub image: Image<'a>,
    pub target: Target,
    pub border: Border,
    pub axis: &'a Axis<V>,
    pub cancel: &'a Cancel,
    bits: Vec<u64>,
}

/// A row being filled, and the flat index of its first voxel.
struct Line<'a, V, S> {
    axis: &'a Axis<V>,
    values: &'a mut [V],
    sites: Option<&'a mut [S]>,
    start: usize,
}

impl<'a, V: Value> Scan<'a, V> {
    pub fn new(image: Image<'a>, target: Target, border: Border, axis: &'a Axis<V>, cancel: &'a Cancel) -> Self {
        Self { image, target, border, axis, cancel, bits: Vec::new() }
    }

    /// Fills the row that begins at voxel `start`: squared distances and, if wanted, flat indices of sites.
    pub fn row<S: Site>(&mut self, start: usize, values: &mut [V], sites: Option<&mut [S]>) -> Result<()> {
        let length = values.len();
        self.cancel.check()?;
        self.image.check_numbers(start, length)?;
        self.image.foreground(start, length, &mut self.bits);
        let line = Line { axis: self.axis, values, sites, start };
        match self.target {
            Target::Background => {
                self.bits.iter_mut().for_each(|word| *word = !*word);
                self.to_sites(line)
            }
            Target::Foreground => self.to_sites(line),
            Target::OtherSide => {
                let mut carry = self.bits.first().map_or(0, |word| word & 1);
                for word in &mut self.bits {
                    let before = *word << 1 | carry;
                    carry = *word >> 63;
                    *word ^= before;
                }
                self.to_changes(line, Reading::Foreground)
            }
            Target::OtherLabel => {
                self.image.changes(start, length, &mut self.bits);
                self.to_changes(line, Reading::Label)
            }
        }
    }

    /// Set bits are sites.
    fn to_sites<S: Site>(&self, mut line: Line<'_, V, S>) -> Result<()> {
        let length = line.values.len();
        let border = !self.axis.periodic && self.border == self.target.border();
        let (mut filled, mut first) = (0, None);
        self.runs(length, |begin, end| {
            if first.is_none() {
                first = Some(begin);
            }
            if begin > filled && !(filled == 0 && self.axis.periodic) {
                line.gap(filled, begin, filled > 0 || border, true);
            }
            line.sites(begin, end);
            filled = end;
        })?;
        match first {
            Some(first) if self.axis.periodic => line.gap_around(filled, first),
            _ if filled < length => line.gap(filled, length, filled > 0 || border, border),
            _ => {}
        }
        Ok(())
    }

    /// Set bits are voxels whose label differs from the one before; the sites of a run lie at its two ends.
    fn to_changes<S: Site>(&self, mut line: Line<'_, V, S>, reading: Reading) -> Result<()> {
        let length = line.values.len();
        let mut ends = [0; 2];
        self.image.labels(reading, line.start, &mut ends[..1]);
        self.image.labels(reading, line.start + length - 1, &mut ends[1..]);
        let closed = |label| !self.axis.periodic && self.border.ends(label, self.target);
        let joined = self.axis.periodic && ends[0] == ends[1];
        let (mut filled, mut first) = (0, None);
        self.starts(length, |start| {
            if first.is_none() {
                first = Some(start);
                if !joined {
                    line.gap(0, start, self.axis.periodic || closed(ends[0]), true);
                }
            } else {
                line.gap(filled, start, true, true);
            }
            filled = start;
        })?;
        match first {
            Some(first) if joined => line.gap_around(filled, first),
            Some(_) => line.gap(filled, length, true, self.axis.periodic || closed(ends[1])),
            None => line.gap(0, length, closed(ends[0]), closed(ends[1])),
        }
        Ok(())
    }

    /// Calls `each(begin, end)` for every run of set bits.
    fn runs(&self, length: usize, mut each: impl FnMut(usize, usize)) -> Result<()> {
        let mut open: Option<usize> = None;
        for (group, words) in self.bits.chunks(WORDS).enumerate() {
            self.cancel.check()?;
            for (i, &bits) in words.iter().enumerate() {
                let base = (group * WORDS + i) * 64;
                let mut at = 0;
                while at < 64 {
                    // What is left of the word, as seen from the state that the run is in.
                    let rest = if open.is_some() { !bits } else { bits } >> at;
                    if rest == 0 {
                        break;
                    }
                    at += rest.trailing_zeros();
                    let position = base + at as usize;
                    if position >= length {
                        break;
                    }
                    match open.take() {
                        Some(begin) => each(begin, position),
                        None => open = Some(position),
                    }
                }
            }
        }
        if let Some(begin) = open {
            each(begin, length);
        }
        Ok(())
    }

    /// Calls `each(position)` for every set bit.
    fn starts(&self, length: usize, mut each: impl FnMut(usize)) -> Result<()> {
        for (group, words) in self.bits.chunks(WORDS).enumerate() {
            self.cancel.check()?;
            for (i, &bits) in words.iter().enumerate() {
                let mut bits = bits;
                while bits != 0 {
                    let position = (group * WORDS + i) * 64 + bits.trailing_zeros() as usize;
                    if position < length {
                        each(position);
                    }
                    bits &= bits - 1;
                }
            }
        }
        Ok(())
    }
}

impl<V: Value, S: Site> Line<'_, V, S> {
    /// Voxels that are sites.
    fn sites(&mut self, begin: usize, end: usize) {
        self.values[begin..end].fill(self.axis.cost[0]);
        if let Some(sites) = &mut self.sites {
            for (i, site) in sites[begin..end].iter_mut().enumerate() {
                *site = S::of(self.start + begin + i);
            }
        }
    }

    /// Voxels from `begin` to before `end`, with a site just before or just after them, or both, or none.
    fn gap(&mut self, begin: usize, end: usize, before: bool, after: bool) {
        let (length, cost) = (end - begin, &self.axis.cost);
        let rising = match (before, after) {
            (true, true) => length.div_ceil(2),
            (true, false) => length,
            (false, true) => 0,
            (false, false) => return self.nothing(begin, end),
        };
        let falling = length - rising;
        let (up, down) = self.values[begin..end].split_at_mut(rising);
        if length <= SHORT {
            for (value, &square) in up.iter_mut().zip(&cost[1..]) {
                *value = square;
            }
            for (value, &square) in down.iter_mut().rev().zip(&cost[1..]) {
                *value = square;
            }
        } else {
            up.copy_from_slice(&cost[1..=rising]);
            let last = cost.len() - 1;
            down.copy_from_slice(&self.axis.reversed[last - falling..last]);
        }
        if self.sites.is_some() {
            let (low, high) = (self.site_before(begin), self.site_after(end));
            if let Some(sites) = &mut self.sites {
                sites[begin..begin + rising].fill(low);
                sites[begin + rising..end].fill(high);
            }
        }
    }

    /// The flat index of the voxel before `begin`, across the seam of a periodic axis.
    fn site_before(&self, begin: usize) -> S {
        match begin {
            0 if self.axis.periodic => S::of(self.start + self.values.len() - 1),
            0 => S::NONE,
            _ => S::of(self.start + begin - 1),
        }
    }

    /// The flat index of the voxel at `end`, across the seam of a periodic axis.
    fn site_after(&self, end: usize) -> S {
        if end < self.values.len() {
            S::of(self.start + end)
        } else if self.axis.periodic {
            S::of(self.start)
        } else {
            S::NONE
        }
    }

    /// The gap across the seam of a periodic axis: from `begin` to the end and on to before `end`.
    fn gap_around(&mut self, begin: usize, end: usize) {
        let length = self.values.len();
        let gap = length - begin + end;
        for step in 0..gap {
            let (low, high) = (step + 1, gap - step);
            let at = (begin + step) % length;
            self.values[at] = self.axis.cost[low.min(high)];
            // Of two sites as near, the one of lower index: it is the one after the seam, unless there is none before.
            let site = if low < high { self.site_before(begin) } else { self.site_after(end) };
            if let Some(sites) = &mut self.sites {
                sites[at] = site;
            }
        }
    }

    fn nothing(&mut self, begin: usize, end: usize) {
        self.values[begin..end].fill(V::FAR);
        if let Some(sites) = &mut self.sites {
            sites[begin..end].fill(S::NONE);
        }
    }
}
