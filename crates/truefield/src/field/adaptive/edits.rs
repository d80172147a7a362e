//! What edits changed: where the shape may be another since a cell was sampled.
//!
//! An edit samples the cells around its tool anew and leaves all others, bit for bit, as they are. Yet the distance of a
//! point far away may change: its nearest point may have been carved off. What still holds there follows from two facts.
//! Let the shape have changed inside a box only, a way g from a point.
//! 1. A point no farther than g from the surface keeps its distance. One that is farther has, on the side where the shape
//!    came nearer, at least g left.
//! 2. The surface is no farther than any point that lies on its other side: an anchor, one of which an edit keeps.

use crate::geom::{Aabb, DVec3, Interval};

/// Edits that are looked at together.
const GROUP: usize = 16;

/// What became of the shape inside the box of an edit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// Points went from inside to outside: all distances grew or stayed.
    Shrunk,
    /// Points went from outside to inside: all distances fell or stayed.
    Grown,
}

/// One edit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edit {
    /// What became of the shape.
    pub change: Change,
    /// No point outside changed sides; may be unbounded.
    pub extent: Aabb,
    /// Cells of this box were sampled anew.
    pub reach: Aabb,
    /// A point that is certainly inside where the shape shrank, outside where it grew.
    pub anchor: Option<DVec3>,
}

/// All edits since a field was built.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Edits {
    list: Vec<Edit>,
    /// Boxes of every so many.
    groups: Vec<Aabb>,
}

impl Change {
    /// The sign that makes both the same: with all signs changed, a shape that grew is one that shrank.
    pub(crate) fn turned(self, interval: Interval) -> Interval {
        match self {
            Self::Shrunk => interval,
            Self::Grown => Interval { lower: -interval.upper, upper: -interval.lower },
        }
    }
}

impl Edit {
    /// Whether a cell was sampled anew.
    pub fn reaches(&self, cell: &Aabb) -> bool {
        self.reach.min.cmplt(cell.max).all() && cell.min.cmplt(self.reach.max).all()
    }

    /// What holds in `part` after the edit, which did not sample it anew, where `known` held before.
    fn age(&self, known: Interval, part: &Aabb, gap: f64) -> Interval {
        let before = self.change.turned(known);
        let mut upper = before.upper;
        if before.lower < -gap {
            upper = upper.max(-gap);
        }
        if before.upper > gap {
            upper = upper.max(self.anchor.map_or(f64::INFINITY, |anchor| farthest(part, anchor)));
        }
        self.change.turned(Interval { upper, ..before })
    }
}

impl Edits {
    /// Takes edits in their order.
    pub fn new(list: Vec<Edit>) -> Self {
        let groups = list.chunks(GROUP).map(|group| group.iter().fold(Aabb::EMPTY, |hull, edit| hull.union(edit.extent))).collect();
        Self { list, groups }
    }

    /// Whether every box is one, and every anchor is somewhere.
    pub(crate) fn is_sound(&self) -> bool {
        let good = |b: &Aabb| b.min.cmple(b.max).all();
        self.list.iter().all(|edit| good(&edit.extent) && good(&edit.reach) && edit.anchor.is_none_or(DVec3::is_finite))
    }

    /// In their order.
    pub fn list(&self) -> &[Edit] {
        &self.list
    }

    /// What holds in a part of a cell where `known` held when the cell was sampled.
    #[inline]
    pub(crate) fn age(&self, known: Interval, part: &Aabb, cell: &Aabb) -> Interval {
        if self.list.is_empty() { known } else { self.age_where(known, part, &|edit| !edit.reaches(cell)) }
    }

    /// The same, for the edits that `counts` picks.
    pub(crate) fn age_where(&self, known: Interval, part: &Aabb, counts: &dyn Fn(&Edit) -> bool) -> Interval {
        let mut known = known;
        for (hull, group) in self.groups.iter().zip(self.list.chunks(GROUP)) {
            if gap(part, hull) >= largest(known) {
                continue;
            }
            for edit in group {
                let gap = gap(part, &edit.extent);
                if gap < largest(known) && counts(edit) {
                    known = edit.age(known, part, gap);
                }
            }
        }
        known
    }
}

fn largest(interval: Interval) -> f64 {
    interval.upper.max(-interval.lower)
}

/// No more than the least way between two boxes.
fn gap(a: &Aabb, b: &Aabb) -> f64 {
    (a.min - b.max).max(b.min - a.max).max(DVec3::ZERO).length() * (1.0 - 1e-12)
}

/// No less than the way from a point to the farthest corner of a box.
pub(crate) fn farthest(part: &Aabb, point: DVec3) -> f64 {
    (part.max - point).abs().max((point - part.min).abs()).length() * (1.0 + 1e-12)
}
