//! Where the surface is nearest, as far as an adaptively sampled field tells.

use crate::error::Result;
use crate::field::AdaptiveField;
use crate::geom::{DVec3, Feature};
use crate::run::Run;

/// Points that a worker takes at a time.
const CHUNK: usize = 1024;

/// Steps of a walk down to the surface.
const STEPS: usize = 64;

/// Times that a foot is moved along the surface.
const TURNS: usize = 8;

/// A walk ends where the field says less than this of its tolerance.
const NEAR: f64 = 1e-3;

/// The place of the surface that was found for a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Foot {
    /// Not numbers where there is none.
    pub point: DVec3,
    /// The triangle that holds it, and the part of it, where the field knows its mesh.
    pub on: Option<(u32, Feature)>,
}

/// The nearest points of the surface: those of the mesh, if the field keeps it and was not edited; else estimates, found by
/// walking down what the field says and then along the surface, for as long as that comes nearer.
///
/// There are none for points outside the domain, and where walking does not come within the field's tolerance of the surface.
pub fn nearest(field: &AdaptiveField, points: &[DVec3], run: &Run<'_>) -> Result<Vec<Foot>> {
    const NONE: Foot = Foot { point: DVec3::NAN, on: None };
    let domain = field.extent_box();
    if let Some(surface) = field.surface().filter(|_| field.edits().list().is_empty()) {
        let found = surface.nearest_many(points, run)?.into_iter().zip(points);
        let feet = found.map(|(found, &p)| {
            let foot = Foot { point: found.point, on: Some((found.element, found.feature)) };
            if domain.contains(p) { foot } else { NONE }
        });
        return Ok(feet.collect());
    }
    let blocks = run.blocks("find the surface", points.len().div_ceil(CHUNK), |block| {
        let chunk = &points[block * CHUNK..((block + 1) * CHUNK).min(points.len())];
        Ok(chunk.iter().map(|&p| foot(field, p).map_or(NONE, |point| Foot { point, on: None })).collect::<Vec<_>>())
    })?;
    Ok(blocks.concat())
}

fn foot(field: &AdaptiveField, p: DVec3) -> Option<DVec3> {
    let mut best = walk(field, p)?;
    for _ in 0..TURNS {
        // Seen from the nearest point, the way is along the normal: what is left goes along the surface.
        let normal = slope(field, best)?;
        let way = p - best;
        let aside = way - normal * way.dot(normal);
        let Some(next) = walk(field, (best + aside).clamp(field.extent_box().min, field.extent_box().max)) else { break };
        if (p - next).length() >= (p - best).length() * (1.0 - 1e-9) {
            break;
        }
        best = next;
    }
    Some(best)
}

/// Where going against the gradient, as far as the field says each time, comes nearest to the surface.
fn walk(field: &AdaptiveField, from: DVec3) -> Option<DVec3> {
    let (domain, tolerance) = (field.extent_box(), field.accuracy().tolerance);
    let (mut at, mut best) = (from, (f64::INFINITY, from));
    for _ in 0..STEPS {
        let value = field.interpolate(at)?;
        if value.abs() < best.0 {
            best = (value.abs(), at);
        }
        if value.abs() <= NEAR * tolerance {
            break;
        }
        let slope = slope(field, at)?;
        at = if slope == DVec3::ZERO {
            // In the middle between walls, any of them will do.
            let around = DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]);
            let around = around.map(|axis| (at + axis * value).clamp(domain.min, domain.max));
            around.min_by(|&a, &b| said(field, a).total_cmp(&said(field, b)))?
        } else {
            (at - slope * value).clamp(domain.min, domain.max)
        };
    }
    (best.0 <= tolerance).then_some(best.1)
}

fn slope(field: &AdaptiveField, p: DVec3) -> Option<DVec3> {
    Some(field.find(p)?.gradient(p).normalize_or_zero())
}

fn said(field: &AdaptiveField, p: DVec3) -> f64 {
    field.interpolate(p).map_or(f64::INFINITY, f64::abs)
}
