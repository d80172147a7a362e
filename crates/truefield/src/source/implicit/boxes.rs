//! The hierarchy of boxes that may hold surface.

use super::sheet::{Content, Sheet, Side, is_level, is_steady};
use super::tape::Tape;
use super::taylor::Taylor;
use crate::error::{Error, Result};
use crate::geom::{Aabb, DVec3, Interval};
use crate::run::Run;

/// Boxes that one thread takes at a time.
const BLOCK: usize = 64;

/// Levels of halving: at kinks and where sheets meet, the finest box is this fine.
const LEVELS: u32 = 13;

/// How far around a box the formula keeps its sign, in sizes of the box, where it may touch zero in it without surface.
const MARGIN: f64 = 1e-3;

/// How far around a leaf its sheet is known, in sizes of the box: a foot in it then is proven nearest in its neighbours, too.
const AROUND: f64 = 0.5;

/// Gradients of an inner box differ from their middle by no more than this part of it where it is seen as one sheet.
const TURNING: f64 = 1.0;

/// Leaves are known to second order up to this part of their diagonal: the less, the more queries end with the first foot.
const ROUGH: f64 = 3e-3;

/// Boxes that are smaller than this part of the domain are not cut for that.
const FINE: f64 = 1.0 / 64.0;

/// Steps toward the other side.
const BEYOND: usize = 8;

/// No level has more boxes; where it would, the boxes stay as they are.
const MOST: usize = 1 << 20;

/// Without children: a leaf.
#[derive(Clone, Debug)]
pub(super) struct Node {
    pub extent: Aabb,
    /// The first of its children, which follow each other.
    pub first: u32,
    pub count: u8,
    /// How well the surface of a leaf is known; of an inner node, the worst of its leaves.
    pub known: f32,
    /// Whether some leaf of it is next to surface for certain, or has a sheet.
    pub sure: bool,
    /// The number of its sheet, and of its expansion.
    pub sheet: Option<u32>,
    /// The number of what is known of an inner node as of one sheet.
    slab: Option<u32>,
}

impl Node {
    /// Whether surface runs through a leaf for certain, or along it.
    pub(super) fn is_crossed(&self) -> bool {
        f64::from(self.known) <= self.extent.diagonal() * (1.0 + 3.0 * MARGIN)
    }
}

/// All boxes of a domain that may hold surface, by halves.
#[derive(Clone, Debug)]
pub(super) struct Boxes {
    pub nodes: Vec<Node>,
    /// What is known around leaves.
    pub sheets: Vec<Sheet>,
    pub taylors: Vec<Taylor>,
    /// What is known of inner nodes, and around them.
    slabs: Vec<(Taylor, Sheet)>,
    /// Around all that is not outside.
    pub solid: Aabb,
    /// Whether some leaf has no sheet.
    pub rough: bool,
    /// No less than how far the surface is from any point of those leaves without a sheet that are cut by searches.
    pub widest: f64,
}

/// What became of one box of a level.
enum Fate {
    Gone(Side),
    Leaf(Option<Box<(Taylor, Sheet)>>, f32),
    Split(Option<Box<(Taylor, Sheet)>>),
}

impl Fate {
    /// That of a box that is cut no more.
    fn uncut(self, tape: &Tape, domain: &Aabb, cell: &Aabb) -> Self {
        let Self::Split(_) = self else { return self };
        match fate(tape, domain, cell, f64::INFINITY) {
            Self::Split(_) => Self::Leaf(None, crossed(tape, domain, cell)),
            other => other,
        }
    }
}

impl Boxes {
    /// Looks at the domain and all halves of what may hold surface, level by level.
    pub(super) fn build(tape: &Tape, domain: &Aabb, run: &Run<'_>) -> Result<Self> {
        let mut boxes = Self {
            nodes: vec![node(*domain)],
            sheets: Vec::new(),
            taylors: Vec::new(),
            slabs: Vec::new(),
            solid: Aabb::EMPTY,
            rough: false,
            widest: 0.0,
        };
        let mut level = 0..1;
        for depth in 0..=LEVELS {
            let cells: Vec<Aabb> = boxes.nodes[level.clone()].iter().map(|node| node.extent).collect();
            let fates = run.blocks("boxes", cells.len().div_ceil(BLOCK), |block| {
                let part = &cells[block * BLOCK..cells.len().min((block + 1) * BLOCK)];
                Ok(part.iter().map(|cell| fate(tape, domain, cell, ROUGH)).collect::<Vec<_>>())
            })?;
            let fates: Vec<Fate> = fates.into_iter().flatten().collect();
            let open = fates.iter().filter(|fate| matches!(fate, Fate::Split(_))).count();
            let last = depth == LEVELS || open * 8 > MOST;
            let start = boxes.nodes.len();
            for (index, fate) in level.clone().zip(fates) {
                let extent = boxes.nodes[index].extent;
                let fate = if last { fate.uncut(tape, domain, &extent) } else { fate };
                match fate {
                    Fate::Gone(Side::Outside) => boxes.nodes[index].known = f32::NAN,
                    Fate::Gone(Side::Inside) => {
                        boxes.nodes[index].known = f32::NAN;
                        boxes.solid = boxes.solid.union(extent);
                    }
                    Fate::Leaf(sheet, known) => {
                        boxes.solid = boxes.solid.union(extent);
                        boxes.rough |= sheet.is_none();
                        (boxes.nodes[index].known, boxes.nodes[index].sure) = (known, known < f32::INFINITY || sheet.is_some());
                        if sheet.is_none() && boxes.nodes[index].is_crossed() {
                            boxes.widest = boxes.widest.max(f64::from(known));
                        }
                        boxes.nodes[index].sheet = sheet.map(|sheet| {
                            let (taylor, sheet) = *sheet;
                            boxes.taylors.push(taylor);
                            boxes.sheets.push(sheet);
                            (boxes.sheets.len() - 1) as u32
                        });
                    }
                    Fate::Split(slab) => {
                        boxes.nodes[index].slab = slab.map(|slab| {
                            boxes.slabs.push(*slab);
                            (boxes.slabs.len() - 1) as u32
                        });
                        boxes.nodes[index].first = boxes.nodes.len() as u32;
                        let before = boxes.nodes.len();
                        boxes.nodes.extend(halves(&extent).into_iter().map(node));
                        boxes.nodes[index].count = (boxes.nodes.len() - before) as u8;
                    }
                }
            }
            level = start..boxes.nodes.len();
            if level.is_empty() {
                break;
            }
        }
        boxes.tidy();
        Ok(boxes)
    }

    /// Drops boxes without surface, and says of inner nodes how well their worst leaf is known.
    fn tidy(&mut self) {
        for index in (0..self.nodes.len()).rev() {
            let Node { first, count, .. } = self.nodes[index];
            if count > 0 {
                let children = first as usize..first as usize + usize::from(count);
                let children = &self.nodes[children];
                let worst = children.iter().map(|child| child.known).fold(f32::NAN, f32::max);
                let sure = children.iter().any(|child| child.sure);
                (self.nodes[index].known, self.nodes[index].sure) = (worst, sure);
            }
        }
        let old = std::mem::take(&mut self.nodes);
        let mut pending = std::collections::VecDeque::new();
        if !old[0].known.is_nan() {
            self.nodes.push(old[0].clone());
            pending.push_back(0);
        }
        while let Some(index) = pending.pop_front() {
            let Node { first, count, .. } = self.nodes[index];
            let start = self.nodes.len();
            for child in &old[first as usize..first as usize + usize::from(count)] {
                if !child.known.is_nan() {
                    pending.push_back(self.nodes.len());
                    self.nodes.push(child.clone());
                }
            }
            self.nodes[index].first = start as u32;
            self.nodes[index].count = (self.nodes.len() - start) as u8;
        }
    }

    /// Refuses a domain without an inside.
    pub(super) fn checked(self, tape: &Tape, domain: &Aabb) -> Result<Self> {
        if self.nodes.is_empty() && self.solid == Aabb::EMPTY || tape.over(domain).lower >= 0.0 {
            let middle = tape.value(domain.center());
            let how = if tape.over(domain).lower > 0.0 { "positive in all of" } else { "nowhere negative in" };
            return Err(Error::invalid(format!(
                "the expression is {how} the domain ({middle:.3} in its middle), so it has no inside there; \
                 give a domain around the shape or, where the expression only touches zero, subtract a positive number from it"
            )));
        }
        Ok(self)
    }

    /// The root, if there is one.
    pub(super) fn root(&self) -> Option<u32> {
        (!self.nodes.is_empty()).then_some(0)
    }

    /// The surface in a node to second order, and what is known around it.
    pub(super) fn content(&self, node: &Node) -> Option<(&Taylor, &Sheet)> {
        let leaf = |sheet: u32| (&self.taylors[sheet as usize], &self.sheets[sheet as usize]);
        node.sheet.map(leaf).or_else(|| node.slab.map(|slab| &self.slabs[slab as usize]).map(|(taylor, sheet)| (taylor, sheet)))
    }

    /// No more than how far `cell` is from leaves that leave open how near the surface is to any point of them.
    pub(super) fn open_beyond(&self, cell: &Aabb) -> f64 {
        let mut nearest = f64::INFINITY;
        let mut pending = vec![0_usize];
        while let Some(index) = pending.pop() {
            let Some(node) = self.nodes.get(index).filter(|node| node.known > 0.0) else { continue };
            let apart = apart(&node.extent, cell);
            if apart >= nearest {
                continue;
            }
            if node.count == 0 {
                nearest = apart;
            }
            pending.extend((0..usize::from(node.count)).map(|child| node.first as usize + child));
        }
        nearest * (1.0 - 4.0 * f64::EPSILON)
    }

    /// How well the surface near `cell` is known: the worst of the leaves that are not farther from it than `reach`.
    pub(super) fn known_near(&self, cell: &Aabb, reach: f64) -> f64 {
        let mut worst = 0.0_f32;
        let mut pending = vec![0_usize];
        while let Some(index) = pending.pop() {
            let Some(node) = self.nodes.get(index) else { continue };
            if apart(&node.extent, cell) > reach || node.known <= worst {
                continue;
            }
            if node.count == 0 {
                worst = node.known;
            }
            pending.extend((0..usize::from(node.count)).map(|child| node.first as usize + child));
        }
        f64::from(worst)
    }
}

/// How far two boxes are from each other.
fn apart(a: &Aabb, b: &Aabb) -> f64 {
    (a.min - b.max).max(b.min - a.max).max(DVec3::ZERO).length()
}

fn node(extent: Aabb) -> Node {
    Node { extent, first: 0, count: 0, known: 0.0, sure: false, sheet: None, slab: None }
}

/// What becomes of a box; sheets are cut whose expansions leave more open than that part of their box.
fn fate(tape: &Tape, domain: &Aabb, cell: &Aabb, rough: f64) -> Fate {
    let touched = || Side::around(tape, domain, cell, MARGIN * cell.size().min_element());
    match Content::of(tape, cell) {
        Content::Nothing(side) => Fate::Gone(side),
        // Where zeros fill a room, surface may be anywhere in it.
        Content::Open if is_level(tape, cell) => Fate::Leaf(None, f32::INFINITY),
        Content::Open if let Some(side) = touched() => Fate::Gone(side),
        Content::Sheet(sheet) if sheet.0.remainder() > rough * cell.diagonal() && cell.diagonal() > FINE * domain.diagonal() => {
            Fate::Split(slab(tape, domain, cell))
        }
        Content::Sheet(sheet) => {
            let known = if sound(&sheet.1, domain) { 0.0 } else { crossed(tape, domain, &sheet.1.extent) };
            Fate::Leaf(Some(Box::new((sheet.0, around(tape, domain, cell)))), known)
        }
        Content::Open => Fate::Split(slab(tape, domain, cell)),
    }
}

/// What is known of a box as of one sheet, where it has second derivatives, and around it.
fn slab(tape: &Tape, domain: &Aabb, cell: &Aabb) -> Option<Box<(Taylor, Sheet)>> {
    if !is_steady(&tape.slopes(cell), TURNING) {
        return None;
    }
    let sheet = Sheet::over(tape, cell);
    sheet.turns.width().is_finite().then(|| Box::new((Taylor::of(tape, &sheet), around(tape, domain, cell))))
}

/// What is known of a box and around it, within the domain.
fn around(tape: &Tape, domain: &Aabb, cell: &Aabb) -> Sheet {
    let more = cell.size() * AROUND;
    Sheet::over(tape, &Aabb::new((cell.min - more).max(domain.min), (cell.max + more).min(domain.max)))
}

/// Whether any part of the sheet that cannot be told from surface is next to surface within the domain: along the faces
/// of the domain that it touches, the formula still grows in one direction.
fn sound(sheet: &Sheet, domain: &Aabb) -> bool {
    let mut inner = sheet.gradient;
    for axis in 0..3 {
        if sheet.extent.min[axis] <= domain.min[axis] || sheet.extent.max[axis] >= domain.max[axis] {
            inner[axis] = Interval::exact(0.0);
        }
    }
    let (along, spread) = super::matrix::middle_of(&inner);
    let (whole, _) = super::matrix::middle_of(&sheet.gradient);
    along.length() - spread > 0.1 * whole.length()
}

/// No less than how far the surface is from any point of a box; infinite where it may be anywhere.
///
/// Where places of both sides are known, the surface is between them: in the box, or at most as far from it as it is wide.
fn crossed(tape: &Tape, domain: &Aabb, cell: &Aabb) -> f32 {
    let grown = |part: f64| Aabb::new((cell.min - cell.size() * part).max(domain.min), (cell.max + cell.size() * part).min(domain.max));
    // On a face between two boxes, the surface may be a pole to both.
    let within = [grown(MARGIN), grown(1.0)].into_iter().find(|within| has_both_sides(tape, within));
    within.map_or(f32::INFINITY, |within| (within.diagonal() as f32).next_up())
}

/// Whether places of both sides are found in a box, some of them by the slope from a place next to a zero.
fn has_both_sides(tape: &Tape, within: &Aabb) -> bool {
    let place = |n: u32| DVec3::new(f64::from(n % 4), f64::from(n / 4 % 4), f64::from(n / 16)) / 3.0;
    let places: [DVec3; 64] = std::array::from_fn(|n| (within.min + place(n as u32) * within.size()).min(within.max));
    let mut values = [0.0; 64];
    tape.values_into(&places, &mut values);
    let finite = || (0..64).filter(|&n| values[n].is_finite());
    let best = |sign: f64| finite().max_by(|&a, &b| (sign * values[a]).total_cmp(&(sign * values[b]))).unwrap_or(0);
    let (low, high) = (best(-1.0), best(1.0));
    let is = |p: DVec3, side: Side| Side::of(tape.certain(p)) == Some(side);
    let (inside, outside) = (is(places[low], Side::Inside), is(places[high], Side::Outside));
    if inside == outside {
        return inside;
    }
    // All are on one side: beyond the one that is nearest to zero may be the other.
    let (mut p, wanted) = if inside { (places[high], Side::Outside) } else { (places[low], Side::Inside) };
    for _ in 0..BEYOND {
        let jet = tape.jet::<0>(p);
        let slope = DVec3::from_array(jet.gradient);
        let step = slope * (-1.5 * jet.value / slope.length_squared());
        p = (p + step).clamp(within.min, within.max);
        if !p.is_finite() {
            return false;
        }
        if is(p, wanted) {
            return true;
        }
    }
    false
}

/// A box cut across its longer edges, in two, four or eight.
pub(super) fn halves(cell: &Aabb) -> Vec<Aabb> {
    let (size, center) = (cell.size(), cell.center());
    let mut parts = vec![*cell];
    for axis in 0..3 {
        if size[axis] < 0.6 * size.max_element() {
            continue;
        }
        let before = parts.len();
        for index in 0..before {
            let mut upper = parts[index];
            parts[index].max[axis] = center[axis];
            upper.min[axis] = center[axis];
            parts.push(upper);
        }
    }
    parts
}
