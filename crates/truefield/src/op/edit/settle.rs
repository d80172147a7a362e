//! The tree of an edited shape, from its leaves up: what became simple is one cell again, and every cell gets its record.

use super::divide::{Made, MadeKind, Piece, State, rounding};
use crate::field::adaptive::{Accuracy, AdaptiveField, Change, Division, Edits, Patched, Record, aged_error, differences, farthest};
use crate::geom::{Aabb, DVec3, Interval};

/// Merges siblings whose values their parent can say as well.
pub(super) fn coalesce(pieces: &mut [Piece<'_>], accuracy: Accuracy, field: &AdaptiveField) {
    let division = field.division();
    for number in (0..pieces.len()).rev() {
        let State::Branch(first) = pieces[number].state else { continue };
        let (above, below) = pieces.split_at_mut(first as usize);
        let (parent, children) = (&mut above[number], &below[..division.children()]);
        let extent = field.placement().cell(parent.depth, parent.index);
        let center = extent.center();
        let near = |a: &DVec3, b: &DVec3| (*a - center).length_squared().total_cmp(&(*b - center).length_squared());
        parent.inside = children.iter().filter_map(|child| child.inside).min_by(near);
        if children.iter().all(|child| matches!(child.state, State::Kept)) && !parent.old.is_leaf() && parent.old.depth() == parent.depth {
            parent.state = State::Kept;
            continue;
        }
        let made: Option<Vec<&Made<'_>>> = children
            .iter()
            .map(|child| match &child.state {
                State::Leaf(made) if matches!(made.kind, MadeKind::Linear) => Some(made),
                _ => None,
            })
            .collect();
        if let Some(merged) = made.and_then(|made| merge(&made, division, accuracy, &extent)) {
            parent.state = State::Leaf(merged);
        }
    }
}

/// One leaf for siblings, if its error is allowed.
fn merge<'a>(children: &[&Made<'_>], division: Division, accuracy: Accuracy, extent: &Aabb) -> Option<Made<'a>> {
    let corners: [f32; 8] = std::array::from_fn(|corner| children[corner % children.len()].corners[corner]);
    let record = Record { corners, ..Record::default() };
    let (mut own, mut error) = (children[0].own, children[0].error);
    let mut least = f64::INFINITY;
    for (octant, child) in children.iter().enumerate() {
        let apart = differences(&record, &child.corners, division, octant);
        own = own.hull(child.own.plus(apart));
        error = error.hull(child.error.plus(apart));
        let range = Record { corners: child.corners, ..Record::default() }.range();
        least = least.min(range.lower.max(-range.upper).max(0.0));
    }
    if !(own.upper.max(-own.lower) <= accuracy.allowed(least)) {
        return None;
    }
    let error = error.widen(rounding(extent, &corners.map(f64::from)));
    Some(Made { corners, error, own, open: children.iter().any(|child| child.open), kind: MadeKind::Linear })
}

/// Bounds from above what only points inside bound.
pub(super) fn close(pieces: &mut [Piece<'_>], field: &AdaptiveField) {
    let mut known = Vec::new();
    known.extend(pieces[0].inside);
    close_below(pieces, 0, field, &mut known);
}

fn close_below(pieces: &mut [Piece<'_>], number: usize, field: &AdaptiveField, known: &mut Vec<DVec3>) {
    let Piece { depth, index, inside, .. } = pieces[number];
    match &mut pieces[number].state {
        State::Kept => {}
        State::Leaf(made) if made.open => {
            let extent = field.placement().cell(depth, index);
            let way = known.iter().chain(&inside).map(|&point| farthest(&extent, point)).fold(f64::INFINITY, f64::min);
            made.error.upper = made.error.upper.max(way - made.record().range().lower);
        }
        State::Leaf(_) => {}
        State::Branch(first) => {
            let children = *first as usize..*first as usize + field.division().children();
            let before = known.len();
            known.extend(pieces[children.clone()].iter().filter_map(|child| child.inside));
            for child in children {
                close_below(pieces, child, field, known);
            }
            known.truncate(before);
        }
    }
}

/// The certainly inner point nearest to a place.
pub(super) fn nearest_inside(pieces: &[Piece<'_>], place: DVec3) -> Option<DVec3> {
    let leaves = pieces.iter().filter(|piece| !matches!(piece.state, State::Branch(_)));
    leaves.filter_map(|piece| piece.inside).min_by(|a, b| (*a - place).length_squared().total_cmp(&(*b - place).length_squared()))
}

/// Whether a point is certainly on the side where an older edit, that did `older`, needs it; `change` is the new one's.
pub(super) fn is_certain(pieces: &[Piece<'_>], field: &AdaptiveField, change: Change, older: Change, point: DVec3) -> bool {
    let mut number = 0;
    while let State::Branch(first) = pieces[number].state {
        let children = first as usize..first as usize + field.division().children();
        let holds = |&child: &usize| field.placement().cell(pieces[child].depth, pieces[child].index).contains(point);
        let Some(child) = children.clone().find(holds) else { return false };
        number = child;
    }
    let Piece { depth, index, ref state, .. } = pieces[number];
    let known = match state {
        State::Leaf(made) => {
            let extent = field.placement().cell(depth, index);
            let said = Interval::exact(made.record().value((point - extent.min) / extent.size()));
            // A tricubic leaf says nearly the same at its corners only.
            let said = if matches!(made.kind, MadeKind::Cubic(_)) { Interval::ALL } else { said };
            change.turned(made.error.plus(said).widen(rounding(&extent, &made.corners.map(f64::from))))
        }
        State::Kept | State::Branch(_) => field.find(point).map_or(Interval::ALL, |cell| cell.bounds(point)),
    };
    older.turned(known).upper < 0.0
}

/// The cells of the new tree with their records; inner ones get what follows from their children.
pub(super) fn patched<'a>(pieces: Vec<Piece<'a>>, field: &AdaptiveField, change: Change, edits: &Edits) -> Vec<Patched<'a>> {
    let division = field.division();
    let places: Vec<(u32, [u32; 3])> = pieces.iter().map(|piece| (piece.depth, piece.index)).collect();
    let mut cells: Vec<Patched<'a>> = pieces
        .into_iter()
        .map(|piece| match piece.state {
            State::Kept => Patched::Kept(piece.old),
            State::Branch(first) => Patched::Branch(Record::default(), first),
            State::Leaf(made) => {
                let record = made.record();
                let corners = if change == Change::Grown { record.corners.map(|v| -v) } else { record.corners };
                let record = Record::new(corners, change.turned(record.error()));
                match made.kind {
                    MadeKind::Linear => Patched::Linear(record),
                    MadeKind::Cubic(samples) => Patched::Cubic(record, samples),
                    MadeKind::Exact(side, list) => Patched::Exact(record, side, list),
                }
            }
        })
        .collect();
    for number in (0..cells.len()).rev() {
        let extent = field.placement().cell(places[number].0, places[number].1);
        if let Patched::Branch(_, first) = cells[number] {
            let children = &cells[first as usize..first as usize + division.children()];
            let corners = std::array::from_fn(|corner| children[corner % children.len()].record().corners[corner]);
            let record = Record { corners, ..Record::default() };
            let mut error: Option<Interval> = None;
            for (octant, child) in children.iter().enumerate() {
                let (depth, index) = places[first as usize + octant];
                let part = field.placement().cell(depth, index);
                let of_child = child.error_about_corners();
                let said = child.record().range();
                let before = said.plus(of_child);
                let after = edits.age_where(before, &part, &|edit| edit.reaches(&extent) && !edit.reaches(&part));
                let apart = differences(&record, &child.record().corners, division, octant);
                let of_child = aged_error(of_child, said, before, after).plus(apart);
                error = Some(error.map_or(of_child, |error| error.hull(of_child)));
            }
            let error = error.unwrap_or(Interval::ALL).widen(rounding(&extent, &corners.map(f64::from)));
            cells[number] = Patched::Branch(Record::new(corners, error), first);
        }
    }
    cells
}
