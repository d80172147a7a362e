//! Editing adaptive fields with any shape as the tool: carving, filling, intersecting, blending.
//!
//! Frisken et al. 2000: what a tool does is confined to its box, extended a little; cells there are divided by the same
//! rules as when the field was built, from what the old field says and the tool. All other cells stay as they are, and
//! pages without a new one are shared by both fields.

mod divide;
mod operation;
mod settle;

pub use operation::Operation;

use crate::distance::{Distance, Source};
use crate::error::{Error, Result};
use crate::field::Continuity;
use crate::field::adaptive::{AdaptiveField, Division, Edit, Edits, Patch};
use crate::geom::{Aabb, DVec3};
use crate::run::Run;

use divide::{Divider, State};

/// How far beyond a tool cells are sampled anew, as a part of its longest side.
const REACH: f64 = 0.5;

/// The field edited with a tool; `memory` is what the new cells may take while they are made.
///
/// Cells that do not meet the tool's box, grown by half its longest side, stay bit for bit. Inside, the field holds the
/// maximum or minimum of the old field and the tool, within its tolerance; a box deep in the material may show where the
/// reach ended, as a step of the values that is no larger than the tool is deep. Bounds hold the distance of the edited
/// shape everywhere.
///
/// Refuses fields of meshes with openings, and a quadtree any tool that depends on z.
pub fn edit(field: &AdaptiveField, tool: &dyn Source, operation: Operation, memory: u64, run: &Run<'_>) -> Result<AdaptiveField> {
    operation.check()?;
    if field.continuity() == Continuity::ExceptOpenings {
        return Err(Error::invalid(
            "the field is of a mesh with openings, which has no definite inside to carve or fill; close the mesh first",
        ));
    }
    if field.division() == Division::Quadtree && !tool.is_flat() {
        return Err(Error::invalid("the field does not depend on z; give a tool that does not either, as a polygon"));
    }
    let turned = operation.turned();
    let fresh = [fresh(operation, turned.smooth, tool.extent())];
    // Nothing of the tool is on the side that it changes.
    let idle = |edit: &Edit| {
        edit.extent.min.is_finite() && edit.extent.max.is_finite() && turned.field_range(field.over(&edit.extent)).lower > 0.0
    };
    if fresh.iter().all(idle) {
        return Ok(field.clone());
    }
    let divider = Divider { field, tool, turned, edits: &fresh, memory };
    let mut pieces = divider.tree(run)?;
    settle::coalesce(&mut pieces, field.accuracy(), field);
    if matches!(pieces[0].state, State::Kept) {
        return Ok(field.clone());
    }
    settle::close(&mut pieces, field);
    let change = operation.change();
    let mut all: Vec<Edit> = field.edits().list().to_vec();
    for edit in &mut all {
        // What was inside for sure may not be so any more.
        edit.anchor = edit.anchor.filter(|&anchor| {
            !fresh.iter().any(|fresh| fresh.extent.contains(anchor)) || settle::is_certain(&pieces, field, change, edit.change, anchor)
        });
    }
    for edit in &fresh {
        let place = edit.extent.min.max(field.extent_box().min).midpoint(edit.extent.max.min(field.extent_box().max));
        all.push(Edit { anchor: settle::nearest_inside(&pieces, place), ..*edit });
    }
    let edits = Edits::new(all);
    let cells = settle::patched(pieces, field, change, &edits);
    Patch { old: field, cells, edits }.field(run)
}

/// What a tool in a box does, or anywhere where it has none.
fn fresh(operation: Operation, smooth: f64, extent: Option<Aabb>) -> Edit {
    let change = operation.change();
    let everywhere = Aabb::new(DVec3::NEG_INFINITY, DVec3::INFINITY);
    let (Some(extent), true) = (extent, operation != Operation::Intersect) else {
        return Edit { change, extent: everywhere, reach: everywhere, anchor: None };
    };
    let extent = extent.grow(smooth);
    let longest = extent.size().to_array().into_iter().filter(|side| side.is_finite()).fold(0.0, f64::max);
    Edit { change, extent, reach: extent.grow(REACH * longest), anchor: None }
}
