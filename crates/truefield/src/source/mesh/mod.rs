//! A triangle mesh ready to be asked: tree and sign rule.

mod below;
mod check;
mod layers;
mod pseudonormal;
mod sign;
mod source;
mod sum;
mod walls;

use std::sync::Arc;

pub use check::{Check, Found};
pub use sign::{Side, SignChoice, SignKind, SignRule};

use crate::bvh::{Candidate, Tree};
use crate::distance::{Closest, Distance};
use crate::error::{Error, Result};
use crate::geom::{Aabb, Affine, DVec3, FacetPoint, Feature, Interval, Nearest};
use crate::mesh::TriangleMesh;
use crate::mesh::topology::Topology;
use crate::run::Run;

pub(crate) use sign::{Signs, Whole};

/// A triangle mesh with everything needed to answer: exact distances, nearest points and sides.
///
/// Very large and very small meshes are scaled by a power of two inside, which is exact, so that no
/// square overflows or vanishes; all arguments and results are in model units.
#[derive(Debug)]
pub struct Surface {
    mesh: Arc<TriangleMesh>,
    /// The mesh times `scale`.
    work: Arc<TriangleMesh>,
    scale: f64,
    tree: Tree,
    signs: Signs,
}

impl Surface {
    /// Builds the tree and finds the sign rule. O(n log n).
    pub fn new(mesh: Arc<TriangleMesh>, sign: SignChoice, run: &Run<'_>) -> Result<Self> {
        let (scaled, scale) = well_sized(&mesh)?;
        let work = scaled.map_or_else(|| Arc::clone(&mesh), Arc::new);
        let topology = || Ok((sign != SignChoice::Unsigned).then(|| Topology::new(&work)));
        let (tree, topology) = run.both(|| Tree::build(&work, run), topology)?;
        let signs = match topology {
            Some(topology) => Signs::new(&work, topology, &tree, sign, run)?,
            None => Signs::none(),
        };
        Ok(Self { mesh, work, scale, tree, signs })
    }

    /// The mesh, in model units.
    pub fn mesh(&self) -> &Arc<TriangleMesh> {
        &self.mesh
    }

    /// Which rule decides sides, and why.
    pub fn sign_rule(&self) -> &SignRule {
        self.signs.rule()
    }

    /// The tree over the mesh times [`Surface::scale`].
    pub(crate) fn tree(&self) -> &Tree {
        &self.tree
    }

    /// The mesh times [`Surface::scale`].
    pub(crate) fn work(&self) -> &TriangleMesh {
        &self.work
    }

    /// The power of two between model units and the tree's.
    pub(crate) fn scale(&self) -> f64 {
        self.scale
    }

    /// Sides, in the tree's units.
    pub(crate) fn side(&self, p: DVec3, nearest: &FacetPoint, triangle: u32) -> Side {
        self.signs.side(self.tree.facet(triangle), p, nearest, triangle)
    }

    /// Whether `p`, in the tree's units, is certainly outside by its place alone.
    pub(crate) fn beyond(&self, p: DVec3) -> bool {
        self.signs.beyond(p)
    }

    /// The one side of a ball that does not touch the surface, in the tree's units.
    pub(crate) fn side_of_ball(&self, p: DVec3, nearest: &FacetPoint, triangle: u32, radius: f64) -> Option<Side> {
        self.signs.side_of_ball(self.tree.facet(triangle), p, nearest, triangle, radius)
    }

    /// The side of `p` and how far it carries off the surface, in the tree's units: see `Signs::steady`.
    pub(crate) fn steady(&self, p: DVec3, nearest: &FacetPoint, triangle: u32, radius: f64) -> (Side, f64) {
        self.signs.steady(self.tree.facet(triangle), p, nearest, triangle, radius)
    }

    /// See `Signs::carry`, in the tree's units.
    pub(crate) fn carry(&self, triangle: u32, distance: f64) -> f64 {
        self.signs.carry(triangle, distance)
    }

    /// See `Signs::whole`, in the tree's units.
    pub(crate) fn whole(&self, triangle: u32) -> Option<Whole> {
        self.signs.whole(triangle)
    }

    /// Whether two points joined by a path off the surface are always on the same side.
    pub(crate) fn side_changes_at_surface_only(&self) -> bool {
        self.signs.changes_at_surface_only()
    }

    /// Signed distances, negative inside; positive or negative by the better guess where the side is
    /// doubtful. About a microsecond a point.
    pub fn distances(&self, points: &[DVec3], run: &Run<'_>) -> Result<Vec<f64>> {
        self.each(points, run, |_, _, foot, side| side.sign() * foot.distance_squared.sqrt() / self.scale)
    }

    /// The intervals that contain the true signed distances.
    pub fn bounds(&self, points: &[DVec3], run: &Run<'_>) -> Result<Vec<Interval>> {
        self.each(points, run, |_, _, foot, side| self.interval(foot, side))
    }

    /// The nearest points of the surface.
    pub fn nearest_many(&self, points: &[DVec3], run: &Run<'_>) -> Result<Vec<Nearest>> {
        self.each(points, run, |p, triangle, foot, side| self.details(p, triangle, foot, side))
    }

    /// `answer` for every point, its nearest triangle and point, and its side, in the tree's units.
    fn each<T: Copy + Send + Sync>(
        &self,
        points: &[DVec3],
        run: &Run<'_>,
        answer: impl Fn(DVec3, u32, &FacetPoint, Side) -> T + Sync,
    ) -> Result<Vec<T>> {
        check_points(points)?;
        let scaled: Vec<DVec3>;
        let points = if self.scale == 1.0 {
            points
        } else {
            scaled = points.iter().map(|&p| p * self.scale).collect();
            &scaled
        };
        self.tree.nearest_along(points, run, |points, found| {
            let mut walk = Walk::default();
            let each = points.iter().zip(found).map(|(&p, found)| {
                let foot = self.tree.facet(found.triangle).at(found.foot);
                answer(p, found.triangle, &foot, walk.side(self, p, found.triangle, &foot))
            });
            each.collect()
        })
    }

    fn foot_and_side(&self, p: DVec3, found: Candidate) -> (FacetPoint, Side) {
        let foot = self.tree.facet(found.triangle).nearest(p);
        let side = self.side(p, &foot, found.triangle);
        (foot, side)
    }

    /// In model units.
    fn interval(&self, foot: &FacetPoint, side: Side) -> Interval {
        let distance = foot.distance_squared.sqrt() / self.scale;
        if side.is_certain() { Interval::exact(side.sign() * distance) } else { Interval::either_side(distance) }
    }

    /// Unit gradient of the signed distance at `p`, whose nearest point is `foot`, in the tree's units.
    pub(crate) fn normal(&self, p: DVec3, foot: &FacetPoint, triangle: u32, side: Side) -> DVec3 {
        let [a, b, c] = self.work.corners(triangle);
        let face = (b - a).cross(c - a).normalize_or_zero();
        let away = (p - foot.point).normalize_or_zero() * side.sign();
        // Off the face's interior (C2, C3) the gradient is the direction from the nearest point; on the surface only the face is left.
        match foot.feature {
            Feature::Face if face != DVec3::ZERO => face * if face.dot(away) < 0.0 { -1.0 } else { 1.0 },
            _ if away == DVec3::ZERO => face,
            _ => away,
        }
    }

    /// The range over a box from the interval at its centre: a signed distance is 1-Lipschitz where the
    /// side changes at the surface only; its absolute value always is.
    pub(crate) fn over_from(&self, center: Interval, cell: &Aabb) -> Interval {
        let range = center.widen(cell.radius() * (1.0 + 1e-15));
        if self.side_changes_at_surface_only() { range } else { Interval::either_side(range.upper.max(-range.lower)) }
    }

    /// The answer in model units for `p` and its nearest triangle in the tree's.
    pub(crate) fn describe(&self, p: DVec3, found: Candidate) -> Nearest {
        let (foot, side) = self.foot_and_side(p, found);
        self.details(p, found.triangle, &foot, side)
    }

    fn details(&self, p: DVec3, triangle: u32, foot: &FacetPoint, side: Side) -> Nearest {
        let normal = self.normal(p, foot, triangle, side);
        let point = match foot.feature {
            Feature::Vertex(corner) => self.mesh.corners(triangle)[usize::from(corner)],
            _ => foot.point / self.scale,
        };
        Nearest {
            point,
            distance: side.sign() * foot.distance_squared.sqrt() / self.scale,
            element: triangle,
            feature: foot.feature,
            normal,
        }
    }
}

impl Distance for Surface {
    fn extent(&self) -> Option<Aabb> {
        Some(self.mesh.extent())
    }

    fn enclosure(&self) -> Option<Aabb> {
        self.side_changes_at_surface_only().then(|| self.mesh.extent())
    }

    fn at(&self, p: DVec3) -> Interval {
        let p = p * self.scale;
        let (foot, side) = self.foot_and_side(p, self.tree.nearest(p, Candidate::within(f64::INFINITY)));
        self.interval(&foot, side)
    }

    fn over(&self, cell: &Aabb) -> Interval {
        self.over_from(self.at(cell.center()), cell)
    }

    fn below(&self, cell: &Aabb) -> Affine {
        self.plane_below(cell)
    }
}

impl Closest for Surface {
    fn nearest(&self, p: DVec3, within: f64) -> Option<Nearest> {
        let p = p * self.scale;
        // The search compares squares, whose rounding must not decide at the limit itself.
        let found = self.tree.nearest(p, Candidate::within(within * self.scale * (1.0 + 1e-15)));
        let nearest = found.found().then(|| self.describe(p, found));
        nearest.filter(|nearest| nearest.distance.abs() <= within)
    }
}

/// The side of the last point of a walk, for as long as it holds.
#[derive(Clone, Copy, Debug, Default)]
struct Walk {
    settled: Option<Settled>,
    /// The point before and its distance from the one before that.
    last: DVec3,
    step: f64,
}

/// A point whose side is certain.
#[derive(Clone, Copy, Debug)]
struct Settled {
    at: DVec3,
    distance: f64,
    side: Side,
    /// The length of paths off the surface that stay on the side.
    carry: f64,
}

/// Nearer to the surface than this part of its size every point is asked by itself.
const ASKED: f64 = 1e-6;

impl Walk {
    /// The side of `p`: that of the point before, where two balls that overlap leave no room for the surface
    /// between them, else asked for.
    fn side(&mut self, surface: &Surface, p: DVec3, triangle: u32, foot: &FacetPoint) -> Side {
        let distance = foot.distance_squared.sqrt();
        let apart = distance > ASKED * (surface.tree.radius + p.abs().max_element());
        (self.last, self.step) = (p, (p - self.last).length());
        if let Some(before) = &self.settled
            && apart
        {
            let step = (p - before.at).length() * (1.0 + 1e-9);
            if step < distance + before.distance && step <= before.carry {
                let (side, carry) = (before.side, before.carry - step);
                self.settled = Some(Settled { at: p, distance, side, carry });
                return side;
            }
        }
        // How far a side carries is worth knowing only where it may reach the next point.
        let (side, carry) =
            if distance > self.step { surface.steady(p, foot, triangle, 0.5 * distance) } else { (surface.side(p, foot, triangle), 0.0) };
        if side.is_certain() && apart {
            self.settled = Some(Settled { at: p, distance, side, carry });
        }
        side
    }
}

/// Refuses points that are not finite.
pub(crate) fn check_points(points: &[DVec3]) -> Result<()> {
    match points.iter().position(|p| !p.is_finite()) {
        Some(index) => Err(Error::invalid(format!("point {index} is {}; all points must be finite numbers", points[index]))),
        None => Ok(()),
    }
}

/// The mesh times a power of two, where its size calls for one, and that power.
fn well_sized(mesh: &TriangleMesh) -> Result<(Option<TriangleMesh>, f64)> {
    let scale = power_of_two(mesh.extent().diagonal());
    if scale == 1.0 {
        return Ok((None, scale));
    }
    let vertices = mesh.vertices().iter().map(|&v| v * scale).collect();
    Ok((Some(TriangleMesh::new(vertices, mesh.triangles().to_vec())?), scale))
}

/// 1 for ordinary sizes, else the power of two that brings `size` near 1.
fn power_of_two(size: f64) -> f64 {
    if (1e-6..=1e9).contains(&size) { 1.0 } else { (-size.log2().round()).clamp(-1000.0, 1000.0).exp2() }
}
