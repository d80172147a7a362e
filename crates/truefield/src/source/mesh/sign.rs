//! Which side of a mesh a point is on.

use crate::bvh::Tree;
use crate::bvh::boundary::Boundary;
use crate::bvh::intersect::Meetings;
use crate::bvh::winding::{Estimate, Winding};
use crate::error::Result;
use crate::geom::{Aabb, DVec3, FacetPoint};
use crate::mesh::TriangleMesh;
use crate::mesh::topology::Topology;
use crate::run::Run;

use super::check::Check;
use super::layers::Layers;
use super::pseudonormal::Pseudonormals;

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
    /// Where the rule is pseudonormals.
    pseudonormals: Option<Pseudonormals>,
    /// Absent where sides are not asked for. Decides what pseudonormals leave open.
    winding: Option<Sum>,
    /// Whether nothing but the surface parts inside from outside.
    parted: bool,
    /// No side is certain nearer to the surface than this: vertices were joined to decide sides.
    blur: f64,
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
    pub fn new(mesh: &TriangleMesh, tree: &Tree, choice: SignChoice, run: &Run<'_>) -> Result<Self> {
        if choice == SignChoice::Unsigned {
            let reason = "sides were not asked for: distances are positive everywhere".into();
            return Ok(Self {
                rule: SignRule { kind: SignKind::Unsigned, reason },
                pseudonormals: None,
                winding: None,
                parted: true,
                blur: 0.0,
            });
        }
        let mut topology = Topology::new(mesh);
        run.cancel.check()?;
        let joined = if choice == SignChoice::Pseudonormal || topology.is_closed() { None } else { join_vertices(mesh)? };
        let blur = joined.as_ref().map_or(0.0, |joined| BLUR * joined.within);
        let (mesh, note) = match &joined {
            None => (mesh, None),
            Some(Joined { mesh: closer, within }) => {
                topology = Topology::new(closer);
                (closer, Some(format!("vertices within {within:.1e} of each other were taken for one to decide sides")))
            }
        };
        let layers = Layers::new(mesh, &topology);
        let winding = Winding::build(&layers.corners(mesh), run)?;
        let boundary = Boundary::new(mesh, &layers.boundary);
        let closed = boundary.is_empty();
        let sum = Sum { winding, boundary, extent: mesh.extent() };
        if choice == SignChoice::Winding {
            let note = note.map_or_else(String::new, |note| format!("; {note}"));
            let reason = format!("winding numbers were asked for; they hold for every mesh{note}");
            return Ok(Self {
                rule: SignRule { kind: SignKind::Winding, reason },
                pseudonormals: None,
                winding: Some(sum),
                parted: closed,
                blur,
            });
        }
        if let Some(note) = note {
            let end = if closed { "which closes the mesh" } else { "and the mesh is still open" };
            let reason = format!("{note}, {end}; inside is where the winding number is beyond 1/2");
            let rule = SignRule { kind: SignKind::Winding, reason };
            return Ok(Self { rule, pseudonormals: None, winding: Some(sum), parted: closed, blur });
        }
        let proof = prove(mesh, &topology, tree, &sum.winding, run)?;
        let (kind, reason) = match (&proof, choice) {
            (Ok(_), _) => (SignKind::Pseudonormal, "the mesh is closed, consistently oriented and free of self-intersections".into()),
            (Err(fault), SignChoice::Pseudonormal) => {
                (SignKind::Pseudonormal, format!("pseudonormals were asked for, but sides are not proven on this mesh: {fault}"))
            }
            (Err(fault), _) => {
                (SignKind::Winding, format!("{fault}: pseudonormals would not be proven; inside is where the winding number is beyond 1/2"))
            }
        };
        let parted = closed && !(proof.is_err() && kind == SignKind::Pseudonormal);
        let pseudonormals = (kind == SignKind::Pseudonormal).then(|| Pseudonormals::new(mesh, &topology, proof.as_ref().ok()));
        Ok(Self { rule: SignRule { kind, reason }, pseudonormals, winding: Some(sum), parted, blur })
    }

    /// Which rule decides, and why.
    pub fn rule(&self) -> &SignRule {
        &self.rule
    }

    /// The side of `p`, whose nearest point is `nearest` on `triangle`.
    pub fn side(&self, mesh: &TriangleMesh, p: DVec3, nearest: &FacetPoint, triangle: u32) -> Side {
        let Some(sum) = &self.winding else { return Side::Outside };
        if nearest.distance_squared <= self.blur * self.blur {
            return if sum.side(p).sign() < 0.0 { Side::PerhapsInside } else { Side::PerhapsOutside };
        }
        match self.pseudonormals.as_ref().and_then(|n| n.side(mesh, p, nearest, triangle)) {
            Some(height) if height < 0.0 => Side::Inside,
            Some(_) => Side::Outside,
            None => sum.side(p),
        }
    }

    /// The side of every point of the ball around `p`, which does not touch the surface, if they all have one.
    pub fn side_of_ball(&self, mesh: &TriangleMesh, p: DVec3, nearest: &FacetPoint, triangle: u32, radius: f64) -> Option<Side> {
        match &self.winding {
            Some(_) if self.parted => Some(self.side(mesh, p, nearest, triangle)).filter(|side| side.is_certain()),
            // Pseudonormals that are not proven may change their mind anywhere.
            Some(sum) => self.pseudonormals.is_none().then(|| sum.side_of_ball(p, radius)).flatten(),
            None => Some(Side::Outside),
        }
    }

    /// The side of `p`, and the length of the paths from it that stay on that side as long as they stay off the
    /// surface; paths longer than `radius` are not asked for.
    pub fn steady(&self, mesh: &TriangleMesh, p: DVec3, nearest: &FacetPoint, triangle: u32, radius: f64) -> (Side, f64) {
        match &self.winding {
            Some(sum) if !self.parted && self.pseudonormals.is_none() && nearest.distance_squared > self.blur * self.blur => {
                sum.steady(p, radius)
            }
            _ => {
                let side = self.side(mesh, p, nearest, triangle);
                (side, if self.parted && side.is_certain() { f64::INFINITY } else { 0.0 })
            }
        }
    }

    /// Whether the side can change at the surface only.
    pub fn changes_at_surface_only(&self) -> bool {
        self.parted
    }
}

/// Proves pseudonormals for the mesh, cheap conditions first, or says what is in the way.
fn prove(
    mesh: &TriangleMesh,
    topology: &Topology,
    tree: &Tree,
    winding: &Winding,
    run: &Run<'_>,
) -> Result<std::result::Result<Meetings, String>> {
    let mut check = Check::of_edges(mesh, topology);
    if let Some(fault) = check.fault() {
        return Ok(Err(fault));
    }
    check.add_shells(mesh, topology, winding, run)?;
    if let Some(fault) = check.fault() {
        return Ok(Err(fault));
    }
    let meetings = check.add_intersections(mesh, topology, tree, 1, run)?;
    Ok(check.fault().map_or(Ok(meetings), Err))
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

    /// See [`Signs::steady`].
    fn steady(&self, p: DVec3, radius: f64) -> (Side, f64) {
        let margin = |e: Estimate| (e.value.abs() - 0.5).abs();
        let e = self.winding.refine(p, |e| margin(e) > 1.3 * e.error || hopeless(e));
        let left = margin(e) - e.error;
        if left <= 0.0 {
            return (self.side(p), 0.0);
        }
        (guess(e).certain(), (left / self.boundary.steepest(p, radius)).min(radius))
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

/// Vertices so many ulp of the largest coordinate apart are taken for one: what exporters leave behind.
const NOISE: f64 = 8.0 * f64::EPSILON;

/// Seen from so many times the distance they moved, moved edges turn the winding number by less than 1/20.
const BLUR: f64 = 16.0;

/// A mesh whose vertices were joined, for deciding sides only.
struct Joined {
    mesh: TriangleMesh,
    within: f64,
}

/// Joins vertices that only rounding keeps apart; `None` where there are none.
fn join_vertices(mesh: &TriangleMesh) -> Result<Option<Joined>> {
    let within = NOISE * mesh.extent().min.abs().max(mesh.extent().max.abs()).max_element();
    // Along a direction in which distinct vertices seldom coincide.
    let along = DVec3::new(0.614_7, 0.530_3, 0.583_9).normalize();
    let vertices = mesh.vertices();
    let mut order: Vec<(f64, u32)> = vertices.iter().enumerate().map(|(i, v)| (v.dot(along), i as u32)).collect();
    order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut partner: Vec<u32> = (0..vertices.len() as u32).collect();
    let mut taken = vec![false; vertices.len()];
    let mut moved = false;
    for (place, &(start, first)) in order.iter().enumerate() {
        if std::mem::replace(&mut taken[first as usize], true) {
            continue;
        }
        for &(_, other) in order[place + 1..].iter().take_while(|(at, _)| at - start <= 2.0 * within) {
            let gap = vertices[other as usize] - vertices[first as usize];
            if !taken[other as usize] && gap.length() <= within {
                (taken[other as usize], partner[other as usize]) = (true, first);
                moved |= gap != DVec3::ZERO;
            }
        }
    }
    if !moved {
        return Ok(None);
    }
    let triangles = mesh.triangles().iter().map(|t| t.map(|v| partner[v as usize])).collect();
    // Where joining leaves nothing of the surface the mesh is taken as it is.
    Ok(TriangleMesh::new(vertices.to_vec(), triangles).ok().map(|mesh| Joined { mesh, within }))
}

/// Whether the surface passes within rounding of the point and everything else is known well enough to guess.
fn hopeless(e: Estimate) -> bool {
    e.doubt > 0.0 && e.error - e.doubt < 0.125
}

fn guess(e: Estimate) -> Side {
    if e.value.abs() > 0.5 { Side::PerhapsInside } else { Side::PerhapsOutside }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::Candidate;
    use std::f64::consts::{PI, TAU};

    fn random(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        }
    }

    /// Star-shaped, `wild` between 0 (a sphere) and 1 (spikes and pits), cut off above the ring `from`.
    fn star(wild: f64, from: usize) -> TriangleMesh {
        let (rings, sectors) = (14, 17);
        let mut r = random(5);
        let mut vertices = Vec::new();
        for i in 0..=rings {
            for j in 0..sectors {
                let (t, f) = (PI * i as f64 / rings as f64, TAU * j as f64 / sectors as f64);
                let radius = 1.0 - wild * r() * 0.95;
                let pole = i == 0 || i == rings;
                vertices.push(if pole {
                    DVec3::Z * if i == 0 { 1.0 } else { -1.0 }
                } else {
                    DVec3::new(t.sin() * f.cos(), t.sin() * f.sin(), t.cos()) * radius
                });
            }
        }
        let at = |i: usize, j: usize| (i * sectors + j % sectors) as u32;
        let mut triangles = Vec::new();
        for i in from..rings {
            for j in 0..sectors {
                if i + 1 < rings {
                    triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
                }
                if i > 0 {
                    triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
                }
            }
        }
        TriangleMesh::new(vertices, triangles).expect("a mesh")
    }

    struct Asked {
        mesh: TriangleMesh,
        tree: Tree,
        signs: Signs,
    }

    impl Asked {
        fn new(mesh: TriangleMesh, choice: SignChoice) -> Self {
            let tree = Tree::build(&mesh, &Run::default()).expect("a tree");
            let signs = Signs::new(&mesh, &tree, choice, &Run::default()).expect("signs");
            Self { mesh, tree, signs }
        }

        fn foot(&self, p: DVec3) -> (FacetPoint, u32) {
            let found = self.tree.nearest(p, Candidate::within(f64::INFINITY));
            (self.tree.facet(found.triangle).nearest(p), found.triangle)
        }

        fn side(&self, p: DVec3) -> Side {
            let (foot, triangle) = self.foot(p);
            self.signs.side(&self.mesh, p, &foot, triangle)
        }

        /// Near a corner, an edge or a face, as near as rounding allows.
        fn near(&self, r: &mut impl FnMut() -> f64) -> DVec3 {
            let [a, b, c] = self.mesh.corners((r() * self.mesh.triangles().len() as f64) as u32);
            let away = DVec3::new(r() - 0.5, r() - 0.5, r() - 0.5) * 10f64.powf(-16.0 * r());
            let (s, t) = match (r() * 3.0) as u32 {
                0 => (0.0, 0.0),
                1 => (r(), 0.0),
                _ => (r() * 0.5, r() * 0.5),
            };
            a + (b - a) * s + (c - a) * t + away
        }
    }

    #[test]
    fn pseudonormals_and_winding_numbers_never_disagree() {
        for wild in [0.0, 0.5, 0.8, 1.0] {
            let asked = Asked::new(star(wild, 0), SignChoice::Auto);
            assert_eq!(asked.signs.rule.kind, SignKind::Pseudonormal, "{wild}: {}", asked.signs.rule.reason);
            let (normals, sum) = (asked.signs.pseudonormals.as_ref().expect("normals"), asked.signs.winding.as_ref().expect("a sum"));
            let mut r = random(17);
            let (mut both, mut left) = (0, 0);
            for _ in 0..150_000 {
                let p = asked.near(&mut r);
                let (foot, triangle) = asked.foot(p);
                let by_normal = normals.side(&asked.mesh, p, &foot, triangle);
                let by_sum = sum.side(p);
                match by_normal {
                    Some(height) if by_sum.is_certain() => {
                        both += 1;
                        assert_eq!(height < 0.0, by_sum == Side::Inside, "{wild} at {p}: height {height}, {by_sum:?}, {foot:?}");
                    }
                    None if foot.distance_squared > 1e-18 => left += 1,
                    _ => {}
                }
            }
            // Pseudonormals leave next to nothing that is off the surface to the winding number.
            assert!(both > 100_000 && left < 300, "{wild}: {both} {left}");
        }
    }

    #[test]
    fn a_ball_has_one_side() {
        for (mesh, choice) in [
            (star(0.5, 0), SignChoice::Auto),
            (star(0.5, 0), SignChoice::Winding),
            (star(0.3, 2), SignChoice::Auto),
            (star(0.3, 7), SignChoice::Auto),
            (star(0.3, 7), SignChoice::Pseudonormal),
            (star(0.3, 7), SignChoice::Unsigned),
        ] {
            let asked = Asked::new(mesh, choice);
            let mut r = random(23);
            let (mut whole, mut torn) = (0, 0);
            for _ in 0..20_000 {
                let p = DVec3::new(r() - 0.5, r() - 0.5, r() - 0.5) * 3.0;
                let (foot, triangle) = asked.foot(p);
                let radius = foot.distance_squared.sqrt() * 0.999 * r();
                let Some(side) = asked.signs.side_of_ball(&asked.mesh, p, &foot, triangle, radius) else {
                    torn += 1;
                    continue;
                };
                whole += 1;
                assert!(side.is_certain());
                for _ in 0..8 {
                    let q = p + DVec3::new(r() - 0.5, r() - 0.5, r() - 0.5).normalize_or_zero() * (radius * r());
                    let there = asked.side(q);
                    assert!(there == side || !there.is_certain(), "{choice:?}: ball of {radius} around {p} is {side:?}, {q} is {there:?}");
                }
            }
            let sure = asked.signs.changes_at_surface_only();
            let unproven = choice == SignChoice::Pseudonormal;
            assert!(
                if sure {
                    torn == 0
                } else if unproven {
                    whole == 0
                } else {
                    whole > torn
                },
                "{choice:?}: {whole} {torn}"
            );
        }
    }

    #[test]
    fn reasons_name_the_fault() {
        let reason = |mesh: TriangleMesh, choice| Asked::new(mesh, choice).signs.rule;
        let open = reason(star(0.3, 7), SignChoice::Auto);
        assert_eq!(open.kind, SignKind::Winding);
        assert!(open.reason.starts_with("17 open edges (the first joins vertices"), "{}", open.reason);
        let forced = reason(star(0.3, 7), SignChoice::Pseudonormal);
        assert_eq!(forced.kind, SignKind::Pseudonormal);
        assert!(forced.reason.contains("not proven") && forced.reason.contains("17 open edges"), "{}", forced.reason);
    }
}
