//! Depth, heavy sections and wall thickness of a solid part.
//!
//! *Depth* is the distance of an inside point to the surface. *Wall thickness* is the diameter of
//! the inscribed ball that touches the wall there, twice the depth of its centre. Limits are
//! limits on wall thickness: a heavy section is a connected region deeper than half of it.

mod cells;
mod deepest;
mod game;
mod sections;
mod volume;

pub use deepest::Deepest;
pub use sections::{HeavySection, Sections};

use cells::{Cell, Octree};
use deepest::{Region, deepest};

use crate::error::{Error, Result};
use crate::geom::DVec3;
use crate::run::Run;
use crate::source::mesh::{SignKind, Surface};

/// The deepest place of the part; the depth interval is no wider than `tolerance`.
///
/// Branch and bound with bounds of second order in the cell size: some thousand distance queries
/// for most parts. Fails if `tolerance` is not a positive length above rounding, or if the part
/// has no inside.
pub fn greatest_depth(surface: &Surface, tolerance: f64, run: &Run<'_>) -> Result<Deepest> {
    check_tolerance(surface, tolerance)?;
    deepest_place(surface, &Octree::new(surface), tolerance, run)
}

/// The connected regions of the part where the wall is thicker than `above`, that is, which are
/// deeper than `above / 2`; see [`Sections`] for what is guaranteed.
pub fn heavy_sections(surface: &Surface, above: f64, tolerance: f64, run: &Run<'_>) -> Result<Sections> {
    check_tolerance(surface, tolerance)?;
    check_limit("above", above)?;
    sections::sections(&Octree::new(surface), 0.5 * above, tolerance, run)
}

fn deepest_place(surface: &Surface, octree: &Octree<'_>, tolerance: f64, run: &Run<'_>) -> Result<Deepest> {
    let root = Region { seeds: vec![(Cell::ROOT, f64::INFINITY)], best: f64::NEG_INFINITY, place: DVec3::ZERO };
    let found = deepest(octree, vec![root], tolerance, f64::NEG_INFINITY, "greatest depth", run)?;
    match found.first() {
        Some(deepest) if deepest.depth.lower > 0.0 => Ok(*deepest),
        _ => Err(no_inside(surface)),
    }
}

fn no_inside(surface: &Surface) -> Error {
    let rule = surface.sign_rule();
    let why = match rule.kind {
        SignKind::Unsigned => "it was read without sides; choose another sign rule than \"unsigned\"".to_owned(),
        SignKind::Pseudonormal | SignKind::Winding => {
            format!("no point is certainly inside; close its holes and orient its triangles outward (sign rule: {})", rule.reason)
        }
    };
    Error::invalid(format!("the mesh has no inside, so it has no thickness: {why}"))
}

/// Refuses tolerances that are not positive or that rounding would swallow.
fn check_tolerance(surface: &Surface, tolerance: f64) -> Result<()> {
    if !(tolerance > 0.0 && tolerance.is_finite()) {
        return Err(Error::invalid(format!("tolerance must be a positive length, not {tolerance}")));
    }
    let extent = surface.mesh().extent();
    let least = 100.0 * cells::rounding(&extent);
    if tolerance < least {
        return Err(Error::invalid(format!(
            "tolerance {tolerance:e} is below what rounding allows for a part with coordinates up to {:e}; choose at least {least:.1e}",
            extent.min.abs().max(extent.max.abs()).max_element()
        )));
    }
    Ok(())
}

fn check_limit(name: &str, limit: f64) -> Result<()> {
    if limit > 0.0 && limit.is_finite() { Ok(()) } else { Err(Error::invalid(format!("{name} must be a positive wall thickness, not {limit}"))) }
}
