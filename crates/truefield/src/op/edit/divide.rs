//! The tree of an edited shape, from the root down: what the tool does not touch is kept, the rest is sampled anew.

use super::operation::Turned;
use crate::build::adaptive::Reconstruction;
use crate::build::adaptive::verify::Layout;
use crate::distance::{SampleBlock, Source};
use crate::error::{Error, Result};
use crate::field::adaptive::{AdaptiveField, Cell, Edit, Leaf, ListSide, MAX_DEPTH, Record, Rule, Samples, cubic_third, cubic_value};
use crate::geom::{Aabb, DVec3, Interval};
use crate::run::Run;
use crate::source::kink::{self, Operand};

/// Cells a worker takes in one go.
const CHUNK: usize = 256;

/// Bytes of a cell while the tree is divided.
const DRAFT: u64 = 400;

/// A cell of the new tree. Values and errors are turned: see [`Turned`].
pub(super) struct Piece<'a> {
    /// The cell of the old tree that is this one, or the leaf that holds it.
    pub old: Cell<'a>,
    pub depth: u32,
    pub index: [u32; 3],
    pub state: State<'a>,
    /// A point of the cell that is certainly inside.
    pub inside: Option<DVec3>,
}

pub(super) enum State<'a> {
    /// The old cell, with all below.
    Kept,
    /// Number of the first child.
    Branch(u32),
    Leaf(Made<'a>),
}

/// A leaf that was made anew.
pub(super) struct Made<'a> {
    pub corners: [f32; 8],
    /// As of a record, but for what only points inside bound.
    pub error: Interval,
    /// What interpolation adds to the errors of field and tool.
    pub own: Interval,
    /// Whether only points inside bound the distance from above.
    pub open: bool,
    pub kind: MadeKind<'a>,
}

pub(super) enum MadeKind<'a> {
    Linear,
    Cubic(Box<Samples>),
    Exact(ListSide, &'a [u32]),
}

enum Outcome<'a> {
    Kept,
    Divide,
    /// To be sampled; whether the tool alone says the value.
    Sample(Known, Alone),
    Leaf(Made<'a>, Option<DVec3>),
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Alone {
    Tool,
    No,
}

/// What is known of a cell: errors of field and tool, and the ranges of x and y.
#[derive(Clone, Copy)]
struct Known {
    errors: [Interval; 2],
    ranges: [Interval; 2],
}

/// An edit on its way.
pub(super) struct Divider<'a> {
    pub field: &'a AdaptiveField,
    pub tool: &'a dyn Source,
    pub turned: Turned,
    /// What the edit reaches.
    pub edits: &'a [Edit],
    pub memory: u64,
}

impl<'a> Divider<'a> {
    /// All cells of the new tree, parents before children, siblings in order.
    pub fn tree(&self, run: &Run<'_>) -> Result<Vec<Piece<'a>>> {
        let root = self.field.root();
        let mut pieces = vec![Piece { old: root, depth: 0, index: [0; 3], state: State::Kept, inside: None }];
        let mut first = 0;
        while first < pieces.len() {
            let level = &pieces[first..];
            let parts = run.blocks("edit the field", level.len().div_ceil(CHUNK), |block| {
                self.divide(&level[block * CHUNK..((block + 1) * CHUNK).min(level.len())])
            })?;
            let before = first;
            first = pieces.len();
            for (number, outcome) in (before..).zip(parts.into_iter().flatten()) {
                match outcome {
                    Outcome::Kept => pieces[number].inside = self.inside_kept(&pieces[number].old),
                    Outcome::Leaf(made, inside) => {
                        pieces[number].inside = inside;
                        pieces[number].state = State::Leaf(made);
                    }
                    Outcome::Divide | Outcome::Sample(..) => {
                        let Piece { old, depth, index, .. } = pieces[number];
                        pieces[number].state = State::Branch(pieces.len() as u32);
                        for octant in 0..self.field.division().children() {
                            let index = self.field.division().child(index, octant);
                            pieces.push(Piece { old: old.child(octant), depth: depth + 1, index, state: State::Kept, inside: None });
                        }
                    }
                }
            }
            let needed = pieces.len() as u64 * DRAFT;
            if needed > self.memory {
                return Err(Error::Memory { what: "the cells that an edit samples anew".into(), needed, allowed: self.memory });
            }
        }
        Ok(pieces)
    }

    fn extent(&self, piece: &Piece<'_>) -> Aabb {
        self.field.placement().cell(piece.depth, piece.index)
    }

    fn divide(&self, pieces: &[Piece<'a>]) -> Result<Vec<Outcome<'a>>> {
        let extents: Vec<Aabb> = pieces.iter().map(|piece| self.extent(piece)).collect();
        let reached: Vec<bool> = extents.iter().map(|extent| self.edits.iter().any(|edit| edit.reaches(extent))).collect();
        let centers: Vec<DVec3> =
            extents.iter().zip(&reached).filter(|(_, reached)| **reached).map(|(extent, _)| extent.center()).collect();
        let mut centers = self.ask(&centers)?.into_iter();
        let mut out: Vec<Outcome<'a>> = Vec::with_capacity(pieces.len());
        for ((piece, extent), reached) in pieces.iter().zip(&extents).zip(reached) {
            out.push(if reached { self.judge(piece, extent, centers.next().unwrap_or(f64::NAN)) } else { self.untouched(piece, extent) });
        }
        let layout = Layout::new(self.field.division(), Reconstruction::Linear);
        let mut points = Vec::new();
        for (_, piece) in out.iter().zip(pieces).filter(|(outcome, _)| matches!(outcome, Outcome::Sample(..))) {
            layout.points(&self.field.placement(), piece.depth, piece.index, &mut points);
        }
        let values = self.ask(&points)?;
        let mut samples = points.chunks_exact(layout.len()).zip(values.chunks_exact(layout.len()));
        for ((outcome, piece), extent) in out.iter_mut().zip(pieces).zip(&extents) {
            if let Outcome::Sample(known, alone) = *outcome
                && let Some((points, values)) = samples.next()
            {
                let asked = layout.block(extent, points, values);
                *outcome = self.sample(piece, layout, &asked, &known, alone)?;
            }
        }
        Ok(out)
    }

    fn ask(&self, points: &[DVec3]) -> Result<Vec<f64>> {
        let mut values = vec![0.0; points.len()];
        self.tool.values(points, &mut values)?;
        match values.iter().position(|v| !v.is_finite() || v.abs() > f64::from(f32::MAX)) {
            Some(at) => Err(Error::invalid(format!(
                "the tool's distance at {} is {}; a field holds numbers that fit single precision",
                points[at], values[at]
            ))),
            None => Ok(values),
        }
    }

    /// A cell that the edit does not reach.
    fn untouched(&self, piece: &Piece<'a>, extent: &Aabb) -> Outcome<'a> {
        if piece.old.depth() == piece.depth {
            return Outcome::Kept;
        }
        let error = self.turned.field_range(piece.old.error());
        self.part_of_leaf(piece, extent, error, false)
    }

    /// A cell that the edit reaches, by the tool's value in its middle.
    fn judge(&self, piece: &Piece<'a>, extent: &Aabb, center: f64) -> Outcome<'a> {
        let turned = self.turned;
        let old = piece.old;
        let axes = self.field.division().axes();
        let half = (0..axes).map(|axis| extent.size()[axis].powi(2)).sum::<f64>().sqrt() * 0.5;
        let said_x = turned.field_range(old.values_over(extent));
        let said_y = Interval::around(turned.tool(center), half * (1.0 + 1e-12) + 2.0 * self.tool.noise_over(extent));
        let slack = turned.tool_range(self.tool.slack(extent));
        let true_x = turned.field_range(old.over_part(extent));
        let wide = said_y.plus(slack);
        let narrow = wide.intersection(turned.tool_range(self.tool.over(extent)));
        let true_y = if narrow.lower <= narrow.upper { narrow } else { wide };
        let ranges = [said_x.hull(true_x), said_y.hull(true_y)];
        let whole = old.depth() == piece.depth;
        if turned.is_first(said_x, said_y) {
            // The record's own error: what older edits did elsewhere is found when it is asked.
            let stored = turned.field_range(old.error());
            let (error, _) = turned.error([stored, slack], ranges);
            let open = turned.error([stored, slack], [true_x, true_y]).1;
            let same = !open && error == stored;
            if whole && same {
                return Outcome::Kept;
            }
            if !old.is_leaf() {
                return Outcome::Divide;
            }
            // What triangles say has no bounds that could be widened: such a leaf gives way to corners.
            let stays = |corner| turned.field(self.field.corner_value(piece.depth, piece.index, corner)) >= said_y.upper + turned.smooth;
            if (same || !matches!(old.leaf(), Leaf::Exact(_))) && (whole || (0..8).all(stays)) {
                return self.part_of_leaf(piece, extent, error, open);
            }
        }
        let alone = if turned.is_first(said_y, said_x) { Alone::Tool } else { Alone::No };
        if !old.is_leaf() && alone == Alone::No {
            return Outcome::Divide;
        }
        Outcome::Sample(Known { errors: [turned.field_range(old.error_over(extent)), slack], ranges }, alone)
    }

    /// A leaf of the old tree, or a part of it, whose values stay.
    fn part_of_leaf(&self, piece: &Piece<'a>, extent: &Aabb, error: Interval, open: bool) -> Outcome<'a> {
        let old = piece.old;
        let whole = old.depth() == piece.depth;
        let said: [f64; 8] = std::array::from_fn(|corner| old.value(extent.corner(corner)));
        let corners: [f64; 8] = std::array::from_fn(|corner| {
            if whole { f64::from(old.corners()[corner]) } else { self.field.corner_value(piece.depth, piece.index, corner) }
        });
        let mut error = error;
        let kind = match old.leaf() {
            Leaf::Linear => {
                if !whole {
                    let moved =
                        said.iter().zip(&corners).map(|(said, corner)| (said - f64::from(*corner as f32)).abs()).fold(0.0, f64::max);
                    error = error.widen(moved + rounding(extent, &corners));
                }
                MadeKind::Linear
            }
            Leaf::Cubic(samples) if whole => MadeKind::Cubic(Box::new(*samples)),
            Leaf::Cubic(samples) => {
                let part: Samples =
                    std::array::from_fn(|n| cubic_value(samples, old.local(extent.min + extent.size() * cubic_third(n))) as f32);
                // Rounding of samples comes back up to threefold between them, along every axis.
                error = error.widen(27.0 * f64::from(f32::EPSILON) * samples.iter().fold(0.0, |size, v| v.abs().max(size)) as f64);
                MadeKind::Cubic(Box::new(part))
            }
            // Errors of exact leaves are those of the interpolated corners, which are others in a part.
            Leaf::Exact(list) => {
                if !whole {
                    let exact = self.turned.field_range(old.values_over(extent));
                    let range = corners.iter().map(|&v| Interval::exact(self.turned.field(v))).reduce(Interval::hull).unwrap_or(exact);
                    error = Interval { lower: exact.lower - range.upper, upper: exact.upper - range.lower };
                }
                MadeKind::Exact(old.list_side(), list)
            }
        };
        let turned = corners.map(|v| self.turned.field(v));
        let own = error;
        let certain = Interval { upper: error.upper + rounding(extent, &corners), ..error };
        let inside = lowest(extent, &turned, certain.upper);
        Outcome::Leaf(Made { corners: turned.map(|v| v as f32), error, own, open, kind }, inside)
    }

    /// A cell by what the tool says at its samples.
    fn sample(&self, piece: &Piece<'a>, layout: Layout, asked: &SampleBlock<'_>, known: &Known, alone: Alone) -> Result<Outcome<'a>> {
        let (turned, extent) = (self.turned, &asked.cell);
        let field: Vec<f64> = match alone {
            Alone::Tool => Vec::new(),
            Alone::No => asked.points.iter().map(|&p| turned.field(piece.old.value(p))).collect(),
        };
        let tool = asked.values.iter().map(|&value| turned.tool(value));
        let combined: Vec<f64> = match alone {
            Alone::Tool => tool.collect(),
            Alone::No => field.iter().zip(tool).map(|(&x, y)| turned.combine(x, y)).collect(),
        };
        let corners = layout.corners(&combined);
        let said = layout.linear(&corners.map(|v| v as f32));
        let block = asked.with(&combined, &said.values);
        let worst = said.worst(&block);
        // Steeper than a distance: as if it were one with so much noise.
        let steep = if alone == Alone::Tool { 1.0 } else { piece.old.steepest() };
        let of_tool = self.tool.noise_over(extent);
        let noise = of_tool + 0.25 * (steep - 1.0).max(0.0) * block.square.sqrt() * (1.0 + 1e-12);
        let accuracy = self.field.accuracy();
        let allowed = accuracy.allowed(Layout::least(&block, noise)) + Layout::left_open(extent, of_tool);
        let last = piece.depth >= accuracy.max_depth.min(MAX_DEPTH);
        if worst > allowed && !last {
            return Ok(Outcome::Divide);
        }
        let own = said.error(&block, &self.residual(piece, &block, asked.values, field, noise)?);
        if accuracy.rule == Rule::Verified && own.upper.max(-own.lower) > allowed && !last {
            return Ok(Outcome::Divide);
        }
        // Corners are shared with neighbours: beyond the reach they are those of the old tree.
        let tool = layout.corners(asked.values);
        let shared: [f64; 8] = std::array::from_fn(|corner| {
            let p = extent.corner(corner);
            let x = turned.field(self.field.corner_value(piece.depth, piece.index, corner));
            let reached = self.edits.iter().any(|edit| p.cmpgt(edit.reach.min).all() && p.cmplt(edit.reach.max).all());
            if reached { turned.combine(x, turned.tool(tool[corner])) } else { x }
        });
        let moved = shared.iter().zip(&corners).map(|(a, b)| f64::from((*a as f32 - *b as f32).abs())).fold(0.0, f64::max);
        let (of_values, open) = turned.error(known.errors, known.ranges);
        let error = own.plus(of_values).widen(moved + rounding(extent, &corners));
        let inside = lowest(extent, &corners, of_values.upper + rounding(extent, &corners));
        let made = Made { corners: shared.map(|v| v as f32), error, own: own.plus(of_values), open, kind: MadeKind::Linear };
        Ok(Outcome::Leaf(made, inside))
    }

    /// [`Source::residual`] of the new values, from what the tool and, unless it is empty, the field said; `noise` is theirs.
    fn residual(&self, piece: &Piece<'a>, block: &SampleBlock<'_>, tool: &[f64], field: Vec<f64>, noise: f64) -> Result<Vec<Interval>> {
        let turned = self.turned;
        let mut out = vec![Interval::ALL; block.len()];
        if field.is_empty() {
            let said: Vec<f64> = block.said.iter().map(|&said| turned.tool(said)).collect();
            self.tool.residual(&block.with(tool, &said), &mut out)?;
            out.iter_mut().for_each(|out| *out = turned.tool_range(*out));
            return Ok(out);
        }
        block.residual(block.between(Interval::ALL, noise), &mut out);
        let mut between = vec![Interval::ALL; block.len()];
        self.tool.residual(&block.with(tool, tool), &mut between)?;
        between.iter_mut().for_each(|between| *between = turned.tool_range(*between));
        // What a linear leaf says is trilinear in any part of it.
        let within = match piece.old.leaf() {
            Leaf::Linear => Interval::exact(0.0),
            Leaf::Cubic(_) | Leaf::Exact(_) => block.between(Interval::ALL, noise),
        };
        let values = tool.iter().map(|&value| turned.tool(value)).collect();
        let mut operands = [Operand { values: field, between: vec![within; block.len()] }, Operand { values, between }];
        kink::greatest(block, &mut operands, turned.seam(), &mut out);
        Ok(out)
    }

    /// A corner of a cell that was kept, if it is certainly inside.
    fn inside_kept(&self, cell: &Cell<'_>) -> Option<DVec3> {
        let turned = cell.corners().map(|v| self.turned.field(f64::from(v)));
        let lowest = (0..8).min_by(|&a, &b| turned[a].total_cmp(&turned[b]))?;
        let p = cell.extent().corner(lowest);
        let known = match (cell.is_leaf(), cell.leaf()) {
            // The corners of such leaves are distances themselves.
            (true, Leaf::Exact(_)) => Interval::exact(turned[lowest]).widen(f64::from(f32::EPSILON) * turned[lowest].abs()),
            _ => self.turned.field_range(cell.bounds(p)),
        };
        (known.upper < 0.0).then_some(p)
    }
}

/// The corner with the lowest value, if it is certainly inside.
fn lowest(extent: &Aabb, corners: &[f64; 8], error: f64) -> Option<DVec3> {
    let lowest = (0..8).min_by(|&a, &b| corners[a].total_cmp(&corners[b]))?;
    // Corners may be rounded to single precision.
    (corners[lowest] + error + f64::from(f32::EPSILON) * corners[lowest].abs() < 0.0).then(|| extent.corner(lowest))
}

/// A few ulp for places and arithmetic.
pub(super) fn rounding(extent: &Aabb, values: &[f64; 8]) -> f64 {
    let size = values.iter().fold(extent.min.abs().max(extent.max.abs()).max_element(), |size, v| size.max(v.abs()));
    64.0 * f64::EPSILON * size
}

impl Made<'_> {
    /// The turned record.
    pub fn record(&self) -> Record {
        Record { corners: self.corners, ..Record::new(self.corners, self.error) }
    }
}
