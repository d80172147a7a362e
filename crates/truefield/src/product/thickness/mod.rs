//! Depth, heavy sections and wall thickness of a solid part.
//!
//! *Depth* is the distance of an inside point to the surface. *Wall thickness* is the diameter of
//! the inscribed ball that touches the wall there, twice the depth of its centre. Limits are
//! limits on wall thickness: a heavy section is a connected region deeper than half of it.

mod cells;
mod deepest;
mod game;
mod samples;
mod sections;
mod statistics;
mod volume;
mod wall;

pub use deepest::Deepest;
pub use sections::{HeavySection, Sections};
pub use statistics::{Extreme, Statistics};
pub use wall::{Across, Kind, Sample};

use cells::{Cell, Octree};
use deepest::{Region, deepest};
use samples::Sampler;
use wall::Gauge;

use crate::error::{Error, Result};
use crate::geom::DVec3;
use crate::run::Run;
use crate::source::mesh::{SignKind, Surface};

/// Of the diagonal of a part: a tolerance that tells whether it has an inside.
const FINE: f64 = 1e-3;

/// Samples a worker measures in one go: some milliseconds of work.
const CHUNK: usize = 256;

/// What to find out about a part. Lengths in model units; limits are limits on wall thickness.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Width of all depth intervals, and how finely heavy sections are told apart.
    pub tolerance: f64,
    /// Walls thicker than this are heavy (strict).
    pub above: Option<f64>,
    /// Walls thinner than this are weak (strict).
    pub below: Option<f64>,
    /// Mean distance between samples of the surface; `None` for about 20,000 samples.
    pub spacing: Option<f64>,
}

/// All there is to say about the thickness of a part.
#[derive(Clone, Debug)]
pub struct Thickness {
    /// The deepest place; twice its depth is the part's greatest wall thickness.
    pub greatest: Deepest,
    /// The heavy sections, if a limit `above` was given.
    pub heavy: Option<Sections>,
    /// The walls.
    pub walls: Walls,
}

/// Wall thickness all over the surface.
#[derive(Clone, Debug)]
pub struct Walls {
    /// Mean distance between samples.
    pub spacing: f64,
    /// Area of the surface.
    pub area: f64,
    /// In the order of the triangles, at least one on each triangle that has an area.
    pub samples: Vec<Sample>,
    /// By inscribed balls, over the samples of kind [`Kind::Wall`].
    pub sphere: Option<Statistics>,
    /// By rays, over all samples whose ray hits.
    pub ray: Option<Statistics>,
    /// Samples of kind [`Kind::Edge`] and their area; not in `sphere`.
    pub edge: (usize, f64),
    /// Samples of kind [`Kind::Inner`] and their area; in neither.
    pub inner: (usize, f64),
    /// Rays that left the part without a hit; none on a closed mesh.
    pub missed: usize,
    /// No ball stays farther from the wall it was asked at than this; 0 on flat walls.
    pub slack: f64,
}

/// Greatest depth, heavy sections and wall thickness in one go.
pub fn thickness(surface: &Surface, options: &Options, run: &Run<'_>) -> Result<Thickness> {
    let Options { tolerance, above, below, spacing } = *options;
    check_tolerance(surface, tolerance)?;
    check_limits(above, below)?;
    // First of all what the user may have to correct.
    let sampler = Sampler::new(surface.mesh(), spacing, tolerance)?;
    let octree = Octree::new(surface);
    let greatest = deepest_place(surface, &octree, tolerance, run)?;
    let heavy = above.map(|above| sections::sections(&octree, 0.5 * above, tolerance, run)).transpose()?;
    let gauge = Gauge::new(surface, octree.rounding, tolerance, greatest.depth.upper);
    let walls = measure(&gauge, &sampler, (above, below), run)?;
    Ok(Thickness { greatest, heavy, walls })
}

/// Wall thickness over the surface by inscribed balls and by rays.
///
/// The samples follow a low-discrepancy sequence on each triangle and do not depend on the number
/// of threads. The ball at a sample is inscribed for certain: its diameter is twice the distance of
/// its centre. On a flat wall it touches the sample and is the largest such ball up to rounding.
/// Facets that stray from a curved wall by no more than the tolerance are taken for that wall: there
/// the ball may stay [`Sample::slack`] away from the sample, and its diameter is off by about twice that. Some ten tree queries a sample.
pub fn wall_thickness(surface: &Surface, options: &Options, run: &Run<'_>) -> Result<Walls> {
    let Options { tolerance, above, below, spacing } = *options;
    check_tolerance(surface, tolerance)?;
    check_limits(above, below)?;
    let sampler = Sampler::new(surface.mesh(), spacing, tolerance)?;
    let octree = Octree::new(surface);
    let greatest = deepest_place(surface, &octree, tolerance, run)?;
    let gauge = Gauge::new(surface, octree.rounding, tolerance, greatest.depth.upper);
    measure(&gauge, &sampler, (above, below), run)
}

/// The walls at given points of triangles, measured as [`wall_thickness`] does.
///
/// `largest` must not be less than the part's greatest depth; a greater value costs a little time.
pub fn walls_at(surface: &Surface, places: &[(DVec3, u32)], tolerance: f64, largest: f64, run: &Run<'_>) -> Result<Vec<Sample>> {
    let count = surface.mesh().triangles().len();
    if let Some((index, (p, t))) = places.iter().enumerate().find(|(_, (p, t))| !p.is_finite() || *t as usize >= count) {
        return Err(Error::invalid(format!("place {index} is {p} on triangle {t}; give finite points on triangles 0 to {}", count - 1)));
    }
    check_tolerance(surface, tolerance)?;
    check_limit("largest", largest)?;
    let sampler = Sampler::new(surface.mesh(), None, tolerance)?;
    let gauge = Gauge::new(surface, cells::rounding(&surface.mesh().extent()), tolerance, largest);
    let blocks = run.blocks("wall thickness", places.len().div_ceil(CHUNK), |block| {
        let places = &places[block * CHUNK..places.len().min((block + 1) * CHUNK)];
        Ok(places.iter().map(|&(p, t)| gauge.sample(&sampler.at(p, t))).collect::<Vec<_>>())
    })?;
    Ok(blocks.concat())
}

fn measure(gauge: &Gauge<'_>, sampler: &Sampler<'_>, (above, below): (Option<f64>, Option<f64>), run: &Run<'_>) -> Result<Walls> {
    let count = sampler.len();
    let blocks = run.blocks("wall thickness", count.div_ceil(CHUNK), |block| {
        let places = sampler.places(block * CHUNK, count.min((block + 1) * CHUNK));
        Ok(places.iter().map(|place| gauge.sample(place)).collect::<Vec<_>>())
    })?;
    let samples = blocks.concat();
    let of_kind = |kind: Kind| {
        let picked = samples.iter().filter(|s| s.kind == kind);
        (picked.clone().count(), picked.map(|s| s.area).fold(0.0, |sum, area| sum + area))
    };
    Ok(Walls {
        spacing: sampler.spacing,
        area: sampler.area,
        sphere: Statistics::of(&samples, above, below, |s| s.sphere.filter(|_| s.kind == Kind::Wall)),
        ray: Statistics::of(&samples, above, below, |s| s.ray),
        edge: of_kind(Kind::Edge),
        inner: of_kind(Kind::Inner),
        missed: samples.iter().filter(|s| s.kind != Kind::Inner && s.ray.is_none()).count(),
        slack: samples.iter().map(|s| s.slack).fold(0.0, f64::max),
        samples,
    })
}

/// The deepest place of the part; the depth interval is no wider than `tolerance`, except on an
/// open mesh whose holes leave the side of deep places doubtful.
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
    // A tolerance as wide as the part is deep is kept before any place inside was seen: then it has to be a finer one.
    let fine = FINE * surface.mesh().extent().diagonal();
    for tolerance in [tolerance, fine.min(tolerance)] {
        // The surface itself has depth 0.
        let root = Region { seeds: vec![(Cell::ROOT, f64::INFINITY)], best: 0.0, place: surface.mesh().corners(0)[0] };
        let found = deepest(octree, vec![root], tolerance, f64::NEG_INFINITY, "greatest depth", run)?;
        if let Some(&deepest) = found.first()
            && deepest.depth.lower > 0.0
        {
            return Ok(deepest);
        }
        if tolerance <= fine {
            break;
        }
    }
    Err(no_inside(surface))
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

fn check_limits(above: Option<f64>, below: Option<f64>) -> Result<()> {
    above.map_or(Ok(()), |limit| check_limit("above", limit))?;
    below.map_or(Ok(()), |limit| check_limit("below", limit))
}

fn check_limit(name: &str, limit: f64) -> Result<()> {
    if limit > 0.0 && limit.is_finite() {
        Ok(())
    } else {
        Err(Error::invalid(format!("{name} must be a positive wall thickness, not {limit}")))
    }
}
