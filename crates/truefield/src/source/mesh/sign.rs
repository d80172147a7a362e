//! Which side of a mesh a point is on.

use crate::bvh::boundary::Boundary;
use crate::bvh::winding::{Estimate, Winding};
use crate::error::Result;
use crate::geom::{Aabb, DVec3, FacetPoint};
use crate::mesh::TriangleMesh;
use crate::mesh::topology::{Sets, Topology, collapsed};
use crate::run::Run;

/// How the user wants sides to be decided.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SignChoice {
    /// The quickest rule that is proven for the mesh.
    #[default]
    Auto,
    /// Angle-weighted pseudonormals.
    Pseudonormal,
    /// Generalised winding number.
    Winding,
    /// No sides: distances are positive everywhere.
    Unsigned,
}

/// The rule that decides sides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SignKind {
    /// Angle-weighted pseudonormals.
    Pseudonormal,
    /// Generalised winding number.
    Winding,
    /// No sides.
    Unsigned,
}

/// The rule in force and why.
#[derive(Clone, Debug)]
pub struct SignRule {
    /// Which rule.
    pub kind: SignKind,
    /// Why, in a sentence.
    pub reason: String,
}

/// The side of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Inside: the distance is negative.
    Inside,
    /// Outside: the distance is positive.
    Outside,
    /// Not decidable; the better guess is inside.
    PerhapsInside,
    /// Not decidable; the better guess is outside.
    PerhapsOutside,
}

impl Side {
    /// Whether the side is decided.
    pub fn is_certain(self) -> bool {
        matches!(self, Self::Inside | Self::Outside)
    }

    /// The guess, taken for decided.
    fn certain(self) -> Self {
        if self.sign() < 0.0 { Self::Inside } else { Self::Outside }
    }

    /// -1 inside, 1 outside; the better guess where undecided.
    pub fn sign(self) -> f64 {
        match self {
            Self::Inside | Self::PerhapsInside => -1.0,
            Self::Outside | Self::PerhapsOutside => 1.0,
        }
    }
}

/// Decides sides for one mesh.
#[derive(Clone, Debug)]
pub(crate) struct Signs {
    rule: SignRule,
    /// Absent where sides are not asked for.
    winding: Option<Sum>,
}

/// Winding numbers and what is known about the chain of edges that bounds the surface.
#[derive(Clone, Debug)]
struct Sum {
    winding: Winding,
    boundary: Boundary,
    extent: Aabb,
}

impl Signs {
    /// Finds the rule and prepares it. O(n log n).
    pub fn new(mesh: &TriangleMesh, choice: SignChoice, run: &Run<'_>) -> Result<Self> {
        if choice == SignChoice::Unsigned {
            let reason = "sides were not asked for: distances are positive everywhere".into();
            return Ok(Self { rule: SignRule { kind: SignKind::Unsigned, reason }, winding: None });
        }
        let topology = Topology::new(mesh);
        run.cancel.check()?;
        let layers = layers(mesh, &topology);
        let corners: Vec<[DVec3; 3]> = layers.triangles.iter().map(|&t| mesh.corners(t)).collect();
        let winding = Winding::build(&corners, run)?;
        let boundary = Boundary::new(mesh, &layers.boundary);
        let rule = SignRule { kind: SignKind::Winding, reason: "winding numbers hold for every mesh".into() };
        Ok(Self { rule, winding: Some(Sum { winding, boundary, extent: mesh.extent() }) })
    }

    /// Which rule decides, and why.
    pub fn rule(&self) -> &SignRule {
        &self.rule
    }

    /// The side of `p`, whose nearest point is `nearest` on `triangle`.
    pub fn side(&self, _mesh: &TriangleMesh, p: DVec3, _nearest: &FacetPoint, _triangle: u32) -> Side {
        match &self.winding {
            None => Side::Outside,
            Some(sum) => sum.side(p),
        }
    }

    /// The side of every point of the ball around `p`, which does not touch the surface, if they all have one.
    pub fn side_of_ball(&self, mesh: &TriangleMesh, p: DVec3, nearest: &FacetPoint, triangle: u32, radius: f64) -> Option<Side> {
        match &self.winding {
            Some(sum) if !sum.boundary.is_empty() => sum.side_of_ball(p, radius),
            _ => Some(self.side(mesh, p, nearest, triangle)).filter(|side| side.is_certain()),
        }
    }

    /// Whether the side can change at the surface only.
    pub fn changes_at_surface_only(&self) -> bool {
        self.winding.as_ref().is_none_or(|sum| sum.boundary.is_empty())
    }
}

impl Sum {
    fn side(&self, p: DVec3) -> Side {
        if self.boundary.is_empty() {
            // Whole numbers: 0 outside the box, and an error below 1 decides.
            if !self.extent.contains(p) {
                return Side::Outside;
            }
            let whole = |e: Estimate| (e.value.abs() > e.error, e.value.abs() + e.error < 1.0);
            let e = self.winding.refine(p, |e| matches!(whole(e), (true, _) | (_, true)) || hopeless(e));
            return match whole(e) {
                (true, _) => Side::Inside,
                (_, true) => Side::Outside,
                _ => guess(e),
            };
        }
        let e = self.winding.refine(p, |e| (e.value.abs() - 0.5).abs() > e.error || hopeless(e));
        if (e.value.abs() - 0.5).abs() > e.error { guess(e).certain() } else { guess(e) }
    }

    /// See [`Signs::side_of_ball`].
    fn side_of_ball(&self, p: DVec3, radius: f64) -> Option<Side> {
        let change = self.boundary.steepest(p, radius) * radius;
        if change >= 0.5 {
            return None;
        }
        let decided = |e: Estimate| (e.value.abs() - 0.5).abs() > e.error + change;
        let e = self.winding.refine(p, |e| decided(e) || e.error < 0.25 * change || hopeless(e));
        decided(e).then(|| guess(e).certain())
    }
}

/// Whether the surface passes within rounding of the point and everything else is known well enough to guess.
fn hopeless(e: Estimate) -> bool {
    e.doubt > 0.0 && e.error - e.doubt < 0.125
}

fn guess(e: Estimate) -> Side {
    if e.value.abs() > 0.5 { Side::PerhapsInside } else { Side::PerhapsOutside }
}

/// What the winding sum runs over.
struct Layers {
    triangles: Vec<u32>,
    /// Edges that bound the sum, from the first vertex to the second, so many times over.
    boundary: Vec<([u32; 2], u32)>,
}

/// Chooses, patch by patch of duplicated triangles, whether duplicates count as often as they occur
/// (two solids that share a face) or once (a face written twice): whatever leaves the shorter boundary.
fn layers(mesh: &TriangleMesh, topology: &Topology) -> Layers {
    let count = topology.triangles.len();
    // Weight of a triangle in the sum when all duplicates count, and when they count once; opposite ones cancel.
    let mut once: Vec<i8> = topology.triangles.iter().map(|t| i8::from(!collapsed(t))).collect();
    let mut sets = Sets::new(count);
    let mut copied = vec![false; count];
    for group in topology.copies() {
        let mut seen = None;
        for &t in group.even.iter().chain(&group.odd) {
            once[t as usize] = 0;
            copied[t as usize] = true;
            sets.join(*seen.get_or_insert(t), t);
        }
        match (group.even.first(), group.odd.first()) {
            (Some(&t), None) | (None, Some(&t)) => once[t as usize] = 1,
            _ => {}
        }
    }
    for edge in topology.edges() {
        let mut seen = None;
        for side in edge.iter().filter(|s| copied[s.triangle as usize]) {
            sets.join(*seen.get_or_insert(side.triangle), side.triangle);
        }
    }
    // Boundary length that counting once saves, by patch.
    let mut saved = vec![0.0; count];
    for edge in topology.edges() {
        if let Some(side) = edge.iter().find(|s| copied[s.triangle as usize]) {
            let [a, b] = edge[0].ends.map(|v| mesh.vertices()[v as usize]);
            let open = |weight: &dyn Fn(u32) -> i64| {
                edge.iter().map(|s| if s.forward { weight(s.triangle) } else { -weight(s.triangle) }).sum::<i64>().abs()
            };
            let difference = open(&|_| 1) - open(&|t| i64::from(once[t as usize]));
            saved[sets.find(side.triangle) as usize] += difference as f64 * (b - a).length();
        }
    }
    let weight: Vec<i64> = (0..count)
        .map(|t| {
            let counts = copied[t] && !(saved[sets.find(t as u32) as usize] > 0.0);
            if counts { 1 } else { i64::from(once[t]) }
        })
        .collect();
    let mut boundary = Vec::new();
    for edge in topology.edges() {
        let times: i64 = edge.iter().map(|s| if s.forward { weight[s.triangle as usize] } else { -weight[s.triangle as usize] }).sum();
        let [a, b] = edge[0].ends;
        if times != 0 {
            boundary.push((if times > 0 { [a, b] } else { [b, a] }, times.unsigned_abs() as u32));
        }
    }
    Layers { triangles: (0..count as u32).filter(|&t| weight[t as usize] != 0).collect(), boundary }
}
