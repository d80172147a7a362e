//! Sides by winding numbers: what is left where no triangle can tell.

use std::sync::{Arc, OnceLock};

use crate::bvh::boundary::Boundary;
use crate::bvh::winding::{Estimate, Winding, triangle as winding_of_one};
use crate::error::{Error, Result};
use crate::geom::{Aabb, DVec3};
use crate::mesh::TriangleMesh;
use crate::mesh::topology::Sets;
use crate::run::Run;

use super::layers::Layers;
use super::sign::Side;

/// Boundaries with more edges than this part of the triangles are not capped: the cap would be another mesh.
const CAPPED: usize = 4;

/// Winding numbers and what is known about the chain of edges that bounds the surface.
///
/// Cones over that chain, the *cap*, close the surface, so that the winding numbers of both are a whole number together: a
/// rough sum over the surface and a good one over the small cap tell the winding number of the surface well.
#[derive(Clone, Debug)]
pub(crate) struct Sum {
    mesh: Arc<TriangleMesh>,
    /// The triangles that count.
    triangles: Vec<u32>,
    /// Made when first asked for: sound surfaces seldom need it.
    winding: OnceLock<Option<Winding>>,
    pub boundary: Boundary,
    cap: Option<Winding>,
    extent: Aabb,
}

impl Sum {
    pub fn new(mesh: &Arc<TriangleMesh>, layers: Layers, run: &Run<'_>) -> Result<Self> {
        let small = CAPPED * layers.boundary.len() <= layers.triangles.len();
        let cap = if small && !layers.boundary.is_empty() { Some(Winding::build(&cap(mesh, &layers.boundary), run)?) } else { None };
        let boundary = Boundary::new(mesh, &layers.boundary);
        Ok(Self { mesh: Arc::clone(mesh), triangles: layers.triangles, winding: OnceLock::new(), boundary, cap, extent: mesh.extent() })
    }

    /// The winding numbers of the surface.
    pub fn winding(&self, run: &Run<'_>) -> Result<&Winding> {
        if self.winding.get().is_none() {
            let made = winding(&self.mesh, &self.triangles, run)?;
            return self.winding.get_or_init(|| Some(made)).as_ref().ok_or(Error::Cancelled);
        }
        self.winding.get().and_then(Option::as_ref).ok_or(Error::Cancelled)
    }

    /// [`Winding::refine`]; nothing is known where the winding numbers cannot be had.
    fn refine(&self, p: DVec3, enough: impl Fn(Estimate) -> bool) -> Estimate {
        // Whoever asks first makes them, on a thread of its own; the others wait.
        let made = self.winding.get_or_init(|| winding(&self.mesh, &self.triangles, &Run::with_threads(1)).ok());
        let unknown = Estimate { value: 0.0, error: f64::INFINITY, doubt: f64::INFINITY };
        made.as_ref().map_or(unknown, |winding| winding.refine(p, enough))
    }

    /// Whether rounding hides from every sum on which side of a triangle `p` is.
    pub fn doubts(&self, triangle: u32, p: DVec3) -> bool {
        winding_of_one(&self.corners(triangle), p).doubt > 0.0
    }

    /// Of a triangle of the mesh that sides are decided on.
    pub fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.mesh.corners(triangle)
    }

    pub fn side(&self, p: DVec3) -> Side {
        if self.boundary.is_empty() {
            // Whole numbers: 0 outside the box, and an error below 1 decides.
            if !self.extent.contains(p) {
                return Side::Outside;
            }
            let whole = |e: Estimate| (e.value.abs() > e.error, e.value.abs() + e.error < 1.0);
            let e = self.refine(p, |e| matches!(whole(e), (true, _) | (_, true)) || hopeless(e));
            return match whole(e) {
                (true, _) => Side::Inside,
                (_, true) => Side::Outside,
                _ => guess(e),
            };
        }
        let e = self.number(p, |e| margin(e) > e.error);
        if margin(e) > e.error { guess(e).certain() } else { guess(e) }
    }

    /// The side of `p`, and the length of the paths from it that stay on that side as long as they stay off the
    /// surface; paths longer than `radius` are not asked for.
    pub fn steady(&self, p: DVec3, radius: f64) -> (Side, f64) {
        let e = self.number(p, |e| margin(e) > 2.0 * e.error);
        let left = margin(e) - e.error;
        if left <= 0.0 {
            return (self.side(p), 0.0);
        }
        // In a ball that reaches the boundary there is no bound.
        let radius = radius.min(0.5 * self.boundary.gap(p));
        (guess(e).certain(), (left / self.boundary.steepest(p, radius)).min(radius))
    }

    /// The side of every point of the ball around `p`, which does not touch the surface, if they all have one.
    pub fn side_of_ball(&self, p: DVec3, radius: f64) -> Option<Side> {
        let change = self.boundary.steepest(p, radius) * radius;
        if change >= 0.5 {
            return None;
        }
        let decided = |e: Estimate| margin(e) > e.error + change;
        let e = self.number(p, |e| decided(e) || e.error < 0.25 * change);
        decided(e).then(|| guess(e).certain())
    }

    /// A winding number at `p`, known to less than a half, once more to within `accuracy`: with the cap's it is whole.
    pub fn sharpen(&self, p: DVec3, (value, error): (f64, f64), accuracy: f64) -> Option<(f64, f64)> {
        let cap = self.cap.as_ref().filter(|_| error < 0.5)?;
        let c = cap.number(p, accuracy);
        (c.error <= accuracy && error + c.error < 0.499).then(|| ((value + c.value).round() - c.value, c.error))
    }

    /// The winding number around `p`, until `enough` or until rounding is all that is left.
    fn number(&self, p: DVec3, enough: impl Fn(Estimate) -> bool) -> Estimate {
        if let Some(cap) = &self.cap {
            let rough = self.refine(p, |e| enough(e) || e.error < 0.25 || hopeless(e));
            if enough(rough) {
                return rough;
            }
            // The whole number less the share of the cap.
            let known = |c: Estimate| Estimate { value: (rough.value + c.value).round() - c.value, ..c };
            let sure = |c: Estimate| rough.error + c.error < 0.499;
            let c = cap.refine(p, |c| sure(c) && enough(known(c)) || hopeless(c));
            if sure(c) && enough(known(c)) {
                return known(c);
            }
        }
        self.refine(p, |e| enough(e) || hopeless(e))
    }
}

/// Winding numbers of some triangles of a mesh.
pub(crate) fn winding(mesh: &TriangleMesh, triangles: &[u32], run: &Run<'_>) -> Result<Winding> {
    let corners: Vec<[DVec3; 3]> = triangles.iter().map(|&t| mesh.corners(t)).collect();
    Winding::build(&corners, run)
}

/// Cones over the boundary, one for each piece that hangs together: with them the surface is closed.
fn cap(mesh: &TriangleMesh, boundary: &[([u32; 2], u32)]) -> Vec<[DVec3; 3]> {
    let mut pieces = Sets::new(mesh.vertices().len());
    for &([a, b], _) in boundary {
        pieces.join(a, b);
    }
    let mut tops = std::collections::HashMap::new();
    for &([a, b], _) in boundary {
        let top: &mut (DVec3, f64) = tops.entry(pieces.find(a)).or_default();
        top.0 += mesh.vertices()[a as usize] + mesh.vertices()[b as usize];
        top.1 += 2.0;
    }
    let mut cones = Vec::new();
    for &([a, b], times) in boundary {
        let (sum, count) = tops[&pieces.find(a)];
        let [from, to] = [a, b].map(|v| mesh.vertices()[v as usize]);
        // Against the edge, so that it cancels.
        cones.extend(std::iter::repeat_n([sum / count, to, from], times as usize));
    }
    cones
}

/// How far a winding number is from the half that parts inside from outside.
fn margin(e: Estimate) -> f64 {
    (e.value.abs() - 0.5).abs()
}

/// Whether the surface passes within rounding of the point and everything else is known well enough to guess.
fn hopeless(e: Estimate) -> bool {
    e.doubt > 0.0 && e.error - e.doubt < 0.125
}

fn guess(e: Estimate) -> Side {
    if e.value.abs() > 0.5 { Side::PerhapsInside } else { Side::PerhapsOutside }
}
