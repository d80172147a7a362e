//! Lower envelopes of sixteen columns at once: the passes along all axes but the contiguous one.
//!
//! For every row i of a column, the least of `values[j] + cost(|i - j|)` over all rows j. The cost is convex, so the best
//! j never falls while i grows (Felzenszwalb and Huttenlocher 2012 build their envelope on the same fact). Hence
//! every fourth row is solved first, from coarse to fine, and each row between two solved ones only looks at the rows
//! between their answers; within these it looks outward from itself and stops once a step alone costs more than
//! what every lane has. Both bounds are tight where the other is not: far from all sites neighbouring columns agree and
//! the answers of two rows are a few rows apart; near sites the outward search is short.
//!
//! Where labels count, a row of another label is a site, whatever its value. Then the best j of row i lies between
//! the answers of a row above and of a row below, or at or between these rows where their label differs.

use super::value::{LANES, Row, Value};
use crate::simd::{Fuse, multiversion};

/// Rows a multiple of this apart keep their answers for the rows between them.
const GRAIN: usize = 4;

/// Outward steps between looks whether the search may stop.
const STRIDE: usize = 4;

/// Sixteen neighbouring columns.
#[derive(Default)]
pub(super) struct Panel<V> {
    /// Values to start from, with `before` more rows at either end.
    pub values: Vec<Row<V>>,
    /// Labels of the same rows; empty where sites are zeros of the image and not other labels.
    pub labels: Vec<Row<u32>>,
    /// The least sums, without the rows at either end.
    pub best: Vec<Row<V>>,
    /// The rows of `values` that give them, the first of equals; filled by [`Solve::Nearest`] only.
    pub from: Vec<Row<u32>>,
    /// Lowest and highest of `from` in every [`GRAIN`]th row.
    span: Vec<(u32, u32)>,
}

/// What to solve for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Solve {
    /// The least sums.
    Least,
    /// The least sums and where they come from.
    Nearest,
}

impl<V: Value> Panel<V> {
    /// Makes room for `length` rows and `before` more at either end.
    pub fn prepare(&mut self, length: usize, before: usize, labelled: bool) {
        let rows = length + 2 * before;
        self.values.resize(rows, [V::FAR; LANES]);
        self.labels.resize(if labelled { rows } else { 0 }, [0; LANES]);
        self.best.resize(length, [V::FAR; LANES]);
    }
}

/// The tables of one pass.
#[derive(Clone, Copy)]
pub(super) struct Pass<'a, V> {
    /// Squared distances of steps; no row is farther away than the table is long.
    pub cost: &'a [V],
    /// What a row of another label costs beside its steps.
    pub base: V,
    pub solve: Solve,
}

multiversion!(
    /// Solves a panel of whole numbers.
    pub(super) fn solve_whole(panel: &mut Panel<u32>, pass: Pass<'_, u32>) = solve_whole_body
);

multiversion!(
    /// Solves a panel in double precision.
    pub(super) fn solve_double(panel: &mut Panel<f64>, pass: Pass<'_, f64>) = solve_double_body
);

#[inline(always)]
fn solve_whole_body<F: Fuse>(panel: &mut Panel<u32>, pass: Pass<'_, u32>) {
    solve::<u32, F>(panel, pass);
}

#[inline(always)]
fn solve_double_body<F: Fuse>(panel: &mut Panel<f64>, pass: Pass<'_, f64>) {
    solve::<f64, F>(panel, pass);
}

#[inline(always)]
fn solve<V: Value, F: Fuse>(panel: &mut Panel<V>, pass: Pass<'_, V>) {
    match (panel.labels.is_empty(), pass.solve) {
        (true, Solve::Least) => envelope::<V, F, false, false>(panel, pass),
        (true, Solve::Nearest) => envelope::<V, F, false, true>(panel, pass),
        (false, Solve::Least) => envelope::<V, F, true, false>(panel, pass),
        (false, Solve::Nearest) => envelope::<V, F, true, true>(panel, pass),
    }
}

#[inline(always)]
fn envelope<V: Value, F: Fuse, const LABELLED: bool, const NEAREST: bool>(panel: &mut Panel<V>, pass: Pass<'_, V>) {
    let Panel { values, labels, best, from, span } = panel;
    let (length, last) = (best.len(), values.len() as u32 - 1);
    let before = (values.len() - length) / 2;
    span.clear();
    span.resize(length.div_ceil(GRAIN), (0, last));
    from.resize(if NEAREST { length } else { 0 }, [0; LANES]);
    let view = View { values, labels, pass };
    let coarse = span.len();
    let mut step = coarse.next_power_of_two();
    let mut first = 0;
    while step > 0 {
        for group in (first..coarse).step_by(2 * step) {
            let row = group * GRAIN;
            let (low, high) = view.between::<LABELLED>(row + before, group.checked_sub(step), group + step, span, before);
            let (least, place) = view.search::<F, LABELLED, true>(row + before, low as usize, high as usize);
            best[row] = least;
            if NEAREST {
                from[row] = place;
            }
            span[group] = hull(&place);
        }
        step /= 2;
        first = step;
    }
    for group in 0..coarse {
        for row in group * GRAIN + 1..((group + 1) * GRAIN).min(length) {
            let (low, high) = view.between::<LABELLED>(row + before, Some(group), group + 1, span, before);
            let (least, place) = view.search::<F, LABELLED, NEAREST>(row + before, low as usize, high as usize);
            best[row] = least;
            if NEAREST {
                from[row] = place;
            }
        }
    }
}

/// The lowest and the highest of some rows.
#[inline(always)]
fn hull(rows: &Row<u32>) -> (u32, u32) {
    let (mut low, mut high) = (rows[0], rows[0]);
    for &row in rows {
        low = low.min(row);
        high = high.max(row);
    }
    (low, high)
}

/// What a search reads.
struct View<'a, V> {
    values: &'a [Row<V>],
    labels: &'a [Row<u32>],
    pass: Pass<'a, V>,
}

/// What a search has found.
struct Found<V> {
    least: Row<V>,
    place: Row<u32>,
}

impl<V: Value> View<'_, V> {
    /// The rows that the answer of row `at` lies between, as the answers of two solved groups around it say.
    #[inline(always)]
    fn between<const LABELLED: bool>(
        &self,
        at: usize,
        under: Option<usize>,
        over: usize,
        span: &[(u32, u32)],
        before: usize,
    ) -> (u32, u32) {
        let low = under.map_or(0, |group| {
            let (row, low) = (group * GRAIN + before, span[group].0);
            if LABELLED && self.labels[row] != self.labels[at] { low.min(row as u32) } else { low }
        });
        let high = span.get(over).map_or(self.values.len() as u32 - 1, |&(_, high)| {
            let row = over * GRAIN + before;
            if LABELLED && self.labels[row] != self.labels[at] { high.max(row as u32) } else { high }
        });
        (low, high)
    }

    /// The least sum of row `at` over the rows from `low` to `high` and the row itself.
    #[inline(always)]
    fn search<F: Fuse, const LABELLED: bool, const NEAREST: bool>(&self, at: usize, low: usize, high: usize) -> (Row<V>, Row<u32>) {
        let cost = self.pass.cost;
        let farthest = cost.len() - 1;
        let own: Row<u32> = if LABELLED { self.labels[at] } else { [0; LANES] };
        let mut found = Found { least: self.values[at], place: [at as u32; LANES] };
        for lane in 0..LANES {
            found.least[lane] = found.least[lane].plus(cost[0]);
        }
        // Steps that have a row on both sides, then those that have one on one side.
        let (down, up) = (at.saturating_sub(low).min(farthest), high.saturating_sub(at).min(farthest));
        let mut step = 1 + if low > at { low - at - 1 } else { at.saturating_sub(high + 1) };
        let both = down.min(up);
        while step <= both {
            if !found.open::<F, NEAREST>(cost[step]) {
                return (found.least, found.place);
            }
            let stop = (step + STRIDE).min(both + 1);
            while step < stop {
                self.take::<LABELLED, NEAREST, true>(&mut found, &own, at - step, cost[step]);
                self.take::<LABELLED, NEAREST, false>(&mut found, &own, at + step, cost[step]);
                step += 1;
            }
        }
        while step <= down {
            if !found.open::<F, NEAREST>(cost[step]) {
                return (found.least, found.place);
            }
            let stop = (step + STRIDE).min(down + 1);
            while step < stop {
                self.take::<LABELLED, NEAREST, true>(&mut found, &own, at - step, cost[step]);
                step += 1;
            }
        }
        while step <= up {
            if !found.open::<F, NEAREST>(cost[step]) {
                return (found.least, found.place);
            }
            let stop = (step + STRIDE).min(up + 1);
            while step < stop {
                self.take::<LABELLED, NEAREST, false>(&mut found, &own, at + step, cost[step]);
                step += 1;
            }
        }
        (found.least, found.place)
    }

    /// Considers one row; those below win ties, so that of equals the first is found.
    #[inline(always)]
    fn take<const LABELLED: bool, const NEAREST: bool, const BELOW: bool>(
        &self,
        found: &mut Found<V>,
        own: &Row<u32>,
        row: usize,
        square: V,
    ) {
        let mut sums = self.values[row];
        if LABELLED {
            let labels = &self.labels[row];
            for lane in 0..LANES {
                sums[lane] = if labels[lane] == own[lane] { sums[lane] } else { self.pass.base };
            }
        }
        for lane in 0..LANES {
            let (sum, least) = (sums[lane].plus(square), found.least[lane]);
            let better = if BELOW && NEAREST { sum <= least } else { sum < least };
            found.least[lane] = if better { sum } else { least };
            if NEAREST {
                found.place[lane] = if better { row as u32 } else { found.place[lane] };
            }
        }
    }
}

impl<V: Value> Found<V> {
    /// Whether rows that many steps away can still be nearer, or as near where the first of equals is wanted.
    #[inline(always)]
    fn open<F: Fuse, const NEAREST: bool>(&self, square: V) -> bool {
        if NEAREST { V::any_from::<F>(&self.least, square) } else { V::any_above::<F>(&self.least, square) }
    }
}
