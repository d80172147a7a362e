//! Which side of a mesh a point is on.

use std::sync::Arc;

use crate::bvh::Tree;
use crate::error::Result;
use crate::geom::{Aabb, DVec3, Facet, FacetPoint, side_of_plane};
use crate::mesh::TriangleMesh;
use crate::mesh::topology::Topology;
use crate::run::Run;

use super::check::{Check, meetings};
use super::layers::Layers;
use super::pseudonormal::{Proof, Pseudonormals};
use super::sum::Sum;
use super::walls::{Wall, walls};

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
    pub(super) fn certain(self) -> Self {
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

/// A triangle around which the surface is whole.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Whole {
    /// How far edges that meet may be apart.
    pub apart: f64,
    /// Nearer to the triangle than this the surface parts outside, on the side of its normal, from inside.
    pub reach: f64,
}

/// Decides sides for one mesh.
#[derive(Clone, Debug)]
pub(crate) struct Signs {
    rule: SignRule,
    /// Absent where sides are not asked for.
    decided: Option<Decided>,
    /// Whether nothing but the surface parts inside from outside.
    parted: bool,
    /// No side is certain nearer to the surface than this: vertices were joined to decide sides.
    blur: f64,
}

/// What decides sides: pseudonormals where they are proven, else winding numbers.
#[derive(Clone, Debug)]
struct Decided {
    normals: Pseudonormals,
    walls: Walls,
    sum: Sum,
    /// All points beyond it are outside, where the mesh is closed; all space where that is not known.
    hull: Aabb,
    /// The mesh that sides are decided on, where it is not the mesh itself.
    joined: Option<Arc<TriangleMesh>>,
}

/// What pseudonormals mean.
#[derive(Clone, Debug)]
enum Walls {
    /// Nothing is proven: they were asked for.
    Trusted,
    /// The whole mesh is sound: outside is outside, everywhere.
    Clean,
    /// Each triangle has its own.
    Known(Vec<Wall>),
}

impl Signs {
    /// Sides that were not asked for.
    pub fn none() -> Self {
        let reason = "sides were not asked for: distances are positive everywhere".into();
        Self { rule: SignRule { kind: SignKind::Unsigned, reason }, decided: None, parted: true, blur: 0.0 }
    }

    /// Finds the rule and prepares it, for a choice with sides. O(n log n).
    pub fn new(mesh: &Arc<TriangleMesh>, mut topology: Topology, tree: &Tree, choice: SignChoice, run: &Run<'_>) -> Result<Self> {
        run.cancel.check()?;
        let joined = if choice == SignChoice::Pseudonormal || topology.is_closed() { None } else { join_vertices(mesh)? };
        let moved = joined.as_ref().map_or(0.0, |joined| joined.within);
        let mesh = joined.as_ref().map_or(mesh, |joined| &joined.mesh);
        if joined.is_some() {
            topology = Topology::new(mesh);
        }
        let edges = || {
            let check = Check::of_edges(mesh, &topology);
            run.cancel.check()?;
            let normals = Pseudonormals::new(mesh, &topology);
            run.cancel.check()?;
            Ok((check, normals, Layers::new(mesh, &topology)))
        };
        let (meetings, (mut check, normals, layers)) = run.both(|| meetings(mesh, &topology, tree, moved, run), edges)?;
        check.add_meetings(mesh, &meetings);
        let (alone, sum) = (layers.alone(mesh, &topology), Sum::new(mesh, layers, run)?);
        let closed = sum.boundary.is_empty();
        if check.fault().is_none() {
            check.add_shells(mesh, &topology, || sum.winding(run), run)?;
        }
        let fault = check.fault();
        let rule = rule(choice, fault.as_deref(), joined.as_ref(), closed);
        let (normals, walls) = if fault.is_some() && rule.kind == SignKind::Pseudonormal {
            (normals, Walls::Trusted)
        } else {
            let sound = meetings.sound(alone);
            let normals = normals.prove(&topology, &Proof { meetings: &meetings, sound: &sound, moved });
            let known = || walls(mesh, &topology, tree, &sound, &sum, run).map(Walls::Known);
            (normals, if fault.is_none() { Walls::Clean } else { known()? })
        };
        let parted = closed && !matches!(walls, Walls::Trusted);
        let blur = BLUR * moved;
        let hull = if parted { mesh.extent().grow(2.0 * blur) } else { Aabb::new(DVec3::NEG_INFINITY, DVec3::INFINITY) };
        let decided = Decided { normals, walls, sum, hull, joined: joined.map(|joined| joined.mesh) };
        Ok(Self { rule, decided: Some(decided), parted, blur })
    }

    /// Which rule decides, and why.
    pub fn rule(&self) -> &SignRule {
        &self.rule
    }

    /// The side of `p`, whose nearest point is `nearest` on `triangle`, prepared as `facet`.
    pub fn side(&self, facet: &Facet, p: DVec3, nearest: &FacetPoint, triangle: u32) -> Side {
        let Some(decided) = &self.decided else { return Side::Outside };
        if self.blurred(nearest) {
            return decided.guess(facet, p, triangle);
        }
        match decided.near(facet, p, nearest, triangle) {
            Some((side, _)) => side,
            None => decided.hidden(facet, p, nearest, triangle).unwrap_or_else(|| decided.sum.side(p)),
        }
    }

    /// The side of every point of the ball around `p`, which does not touch the surface, if they all have one.
    pub fn side_of_ball(&self, facet: &Facet, p: DVec3, nearest: &FacetPoint, triangle: u32, radius: f64) -> Option<Side> {
        let Some(decided) = &self.decided else { return Some(Side::Outside) };
        if self.parted {
            return Some(self.side(facet, p, nearest, triangle)).filter(|side| side.is_certain());
        }
        match decided.walls {
            // Pseudonormals that are not proven may change their mind anywhere.
            Walls::Trusted => None,
            _ if self.blurred(nearest) => None,
            _ => match decided.near(facet, p, nearest, triangle) {
                Some((side, carry)) if carry >= radius => Some(side),
                _ => decided.sum.side_of_ball(p, radius),
            },
        }
    }

    /// The side of `p`, and the length of the paths from it that stay on that side as long as they stay off the
    /// surface; paths longer than `radius` are not asked for.
    pub fn steady(&self, facet: &Facet, p: DVec3, nearest: &FacetPoint, triangle: u32, radius: f64) -> (Side, f64) {
        match &self.decided {
            Some(decided) if !self.parted && !matches!(decided.walls, Walls::Trusted) && !self.blurred(nearest) => {
                match decided.near(facet, p, nearest, triangle) {
                    Some(known) => known,
                    None => match decided.hidden(facet, p, nearest, triangle) {
                        Some(guess) => (guess, 0.0),
                        None => decided.sum.steady(p, radius),
                    },
                }
            }
            _ => {
                let side = self.side(facet, p, nearest, triangle);
                (side, if self.parted && side.is_certain() { f64::INFINITY } else { 0.0 })
            }
        }
    }

    /// The length of the paths off the surface that stay on the side of a point that is so far from `triangle`, its nearest one,
    /// as far as that is known at once.
    pub fn carry(&self, triangle: u32, distance: f64) -> f64 {
        match &self.decided {
            _ if self.parted => f64::INFINITY,
            Some(decided) if !matches!(decided.walls, Walls::Trusted) && distance > self.blur => decided.left(triangle, distance),
            _ => 0.0,
        }
    }

    /// Up to where the surface is whole around a triangle, if it is at all.
    pub fn whole(&self, triangle: u32) -> Option<Whole> {
        let decided = self.decided.as_ref()?;
        if matches!(decided.walls, Walls::Trusted) {
            return None;
        }
        let wall = decided.wall(triangle);
        let plain = wall.is_plain() && decided.normals.whole(triangle);
        plain.then(|| Whole { apart: decided.normals.rounding(), reach: f64::from(wall.reach) })
    }

    /// Whether `p` is certainly outside, wherever the surface is near it.
    pub fn beyond(&self, p: DVec3) -> bool {
        self.decided.as_ref().is_none_or(|decided| !decided.hull.contains(p))
    }

    /// Whether the point is so near that joining vertices may have turned its side.
    fn blurred(&self, nearest: &FacetPoint) -> bool {
        nearest.distance_squared <= self.blur * self.blur
    }

    /// Sides are doubtful no farther from the surface than this, where they change at the surface only.
    pub fn blur(&self) -> f64 {
        self.blur
    }

    /// Whether the side can change at the surface only.
    pub fn changes_at_surface_only(&self) -> bool {
        self.parted
    }
}

/// The rule, and why it is in force.
fn rule(choice: SignChoice, fault: Option<&str>, joined: Option<&Joined>, closed: bool) -> SignRule {
    let note = joined.map(|joined| format!("vertices within {:.1e} of each other were taken for one to decide sides", joined.within));
    let (kind, reason) = match (choice, fault, note) {
        (SignChoice::Winding, _, note) => {
            let note = note.map_or_else(String::new, |note| format!("; {note}"));
            (SignKind::Winding, format!("winding numbers were asked for; they hold for every mesh{note}"))
        }
        (_, _, Some(note)) => {
            let end = if closed { "which closes the mesh" } else { "and the mesh is still open" };
            (SignKind::Winding, format!("{note}, {end}; inside is where the winding number is beyond 1/2"))
        }
        (_, None, None) => (SignKind::Pseudonormal, "the mesh is closed, consistently oriented and free of self-intersections".into()),
        (SignChoice::Pseudonormal, Some(fault), None) => {
            (SignKind::Pseudonormal, format!("pseudonormals were asked for, but sides are not proven on this mesh: {fault}"))
        }
        (_, Some(fault), None) => {
            (SignKind::Winding, format!("{fault}: pseudonormals would not be proven; inside is where the winding number is beyond 1/2"))
        }
    };
    SignRule { kind, reason }
}

impl Decided {
    /// The side of `p` by its nearest triangle, and the length of paths off the surface that stay on it; `None` where the
    /// triangle cannot tell.
    fn near(&self, facet: &Facet, p: DVec3, nearest: &FacetPoint, triangle: u32) -> Option<(Side, f64)> {
        if !self.hull.contains(p) {
            return Some((Side::Outside, f64::INFINITY));
        }
        let wall = self.wall(triangle);
        let left = self.left(triangle, nearest.distance_squared.sqrt());
        if left <= 0.0 {
            return None;
        }
        let joined = self.joined.as_ref().map(|mesh| mesh.facet(triangle));
        let facet = joined.as_ref().unwrap_or(facet);
        // What rounding may have turned is left to the plane, where there is nothing else about.
        let by_plane =
            || if self.normals.is_plane(facet, p, nearest, triangle) { side_of_plane(self.sum.corners(triangle), p) } else { None };
        let height = self.normals.side(facet, p, nearest, triangle).or_else(by_plane)?;
        Some((wall.side(height), left))
    }

    /// What is left of a triangle's reach so far from it.
    fn left(&self, triangle: u32, distance: f64) -> f64 {
        f64::from(self.wall(triangle).reach) - distance * (1.0 + 1e-9) - self.normals.rounding()
    }

    /// A guess where a side would say nothing: on the surface, and as near as its places are rounded to a triangle that
    /// parts inside from outside. Sums seldom tell there, and take their time.
    fn hidden(&self, facet: &Facet, p: DVec3, nearest: &FacetPoint, triangle: u32) -> Option<Side> {
        if nearest.distance_squared == 0.0 {
            return Some(Side::PerhapsOutside);
        }
        let ulp = f64::EPSILON * p.abs().max_element();
        if nearest.distance_squared > (AT_SURFACE * ulp).powi(2) {
            return None;
        }
        let wall = self.wall(triangle);
        let parted = !matches!(self.walls, Walls::Trusted) && wall.reach > 0.0 && wall.parts();
        (parted && self.sum.doubts(triangle, p)).then(|| self.guess(facet, p, triangle))
    }

    fn wall(&self, triangle: u32) -> Wall {
        match &self.walls {
            Walls::Trusted | Walls::Clean => Wall::CLEAN,
            Walls::Known(walls) => walls[triangle as usize],
        }
    }

    /// A guess by the plane of the nearest triangle, for points so near that nothing better can be known.
    fn guess(&self, facet: &Facet, p: DVec3, triangle: u32) -> Side {
        match self.wall(triangle).side(facet.ab.cross(facet.ac).dot(p - facet.a)) {
            Side::Inside | Side::PerhapsInside => Side::PerhapsInside,
            Side::Outside | Side::PerhapsOutside => Side::PerhapsOutside,
        }
    }
}

/// Places so many ulp of their largest coordinate off the surface may have been meant to be on it.
const AT_SURFACE: f64 = 4.0;

/// Vertices so many ulp of the largest coordinate apart are taken for one: what exporters leave behind.
const NOISE: f64 = 8.0 * f64::EPSILON;

/// Seen from so many times the distance they moved, moved edges turn the winding number by less than 1/20.
const BLUR: f64 = 16.0;

/// A mesh whose vertices were joined, for deciding sides only.
struct Joined {
    mesh: Arc<TriangleMesh>,
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
    Ok(TriangleMesh::new(vertices.to_vec(), triangles).ok().map(|mesh| Joined { mesh: Arc::new(mesh), within }))
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
        mesh: Arc<TriangleMesh>,
        tree: Tree,
        signs: Signs,
    }

    impl Asked {
        fn new(mesh: TriangleMesh, choice: SignChoice) -> Self {
            let mesh = Arc::new(mesh);
            let tree = Tree::build(&mesh, &Run::default()).expect("a tree");
            let signs = match choice {
                SignChoice::Unsigned => Signs::none(),
                _ => Signs::new(&mesh, Topology::new(&mesh), &tree, choice, &Run::default()).expect("signs"),
            };
            Self { mesh, tree, signs }
        }

        fn foot(&self, p: DVec3) -> (FacetPoint, u32) {
            let found = self.tree.nearest(p, Candidate::within(f64::INFINITY));
            (self.tree.facet(found.triangle).nearest(p), found.triangle)
        }

        fn side(&self, p: DVec3) -> Side {
            let (foot, triangle) = self.foot(p);
            self.signs.side(self.tree.facet(triangle), p, &foot, triangle)
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
            let Decided { normals, sum, .. } = asked.signs.decided.as_ref().expect("a rule");
            let mut r = random(17);
            let (mut both, mut left) = (0, 0);
            for _ in 0..150_000 {
                let p = asked.near(&mut r);
                let (foot, triangle) = asked.foot(p);
                let by_normal = normals.side(asked.tree.facet(triangle), p, &foot, triangle);
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
    fn points_put_on_faces_are_decided_by_their_planes() {
        for far in [0.0, 1e6] {
            let ball = star(0.5, 0);
            let vertices = ball.vertices().iter().map(|&v| v + DVec3::new(far, -far, far)).collect();
            let asked = Asked::new(TriangleMesh::new(vertices, ball.triangles().to_vec()).expect("a mesh"), SignChoice::Auto);
            let decided = asked.signs.decided.as_ref().expect("a rule");
            let mut r = random(23);
            let (mut both, mut known, mut asked_for) = (0, 0, 0);
            for _ in 0..30_000 {
                let [a, b, c] = asked.mesh.corners((r() * asked.mesh.triangles().len() as f64) as u32);
                let (s, t) = (0.1 + 0.4 * r(), 0.1 + 0.4 * r());
                let p = a + (b - a) * s + (c - a) * t;
                let (foot, triangle) = asked.foot(p);
                if foot.distance_squared == 0.0 {
                    continue;
                }
                asked_for += 1;
                let Some((side, _)) = decided.near(asked.tree.facet(triangle), p, &foot, triangle) else { continue };
                known += 1;
                // Well off the face on that side, as far as the face is all there is.
                let normal = (b - a).cross(c - a).normalize();
                let off = p + normal * if side == Side::Outside { 1e-6 } else { -1e-6 };
                let (there, nearest) = asked.foot(off);
                if nearest == triangle && there.feature == crate::geom::Feature::Face {
                    both += 1;
                    assert_eq!(side, asked.side(off), "{p}: {foot:?}");
                }
            }
            assert!(asked_for > 3000 && f64::from(known) > 0.9 * f64::from(asked_for), "{known} of {asked_for}");
            assert!(both > 3000, "{both}");
        }
    }

    #[test]
    fn points_put_on_edges_ask_for_no_sums() {
        let asked = Asked::new(star(0.5, 0), SignChoice::Auto);
        let decided = asked.signs.decided.as_ref().expect("a rule");
        let mut r = random(31);
        let (mut hidden, mut sums) = (0, 0);
        for _ in 0..30_000 {
            let [a, b, _] = asked.mesh.corners((r() * asked.mesh.triangles().len() as f64) as u32);
            let p = a + (b - a) * r();
            let (foot, triangle) = asked.foot(p);
            let facet = asked.tree.facet(triangle);
            if foot.distance_squared == 0.0 || decided.near(facet, p, &foot, triangle).is_some() {
                continue;
            }
            match decided.hidden(facet, p, &foot, triangle) {
                Some(guess) => {
                    hidden += 1;
                    assert!(!guess.is_certain() && foot.distance_squared.sqrt() < 1e-15, "{p}: {guess:?}, {foot:?}");
                }
                None => sums += 1,
            }
        }
        assert!(hidden > 5000 && sums * 20 < hidden, "{hidden} {sums}");
    }

    /// Several meshes in one, each moved and turned inside out or not.
    fn together(parts: &[(&TriangleMesh, DVec3, bool)]) -> TriangleMesh {
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        for &(mesh, by, flipped) in parts {
            let first = vertices.len() as u32;
            vertices.extend(mesh.vertices().iter().map(|&v| v + by));
            triangles.extend(mesh.triangles().iter().map(|t| {
                let [a, b, c] = t.map(|v| v + first);
                if flipped { [a, c, b] } else { [a, b, c] }
            }));
        }
        TriangleMesh::new(vertices, triangles).expect("a mesh")
    }

    /// What keeps a mesh from being proven as a whole, and how much of it must be known all the same.
    fn faulty() -> Vec<(&'static str, TriangleMesh, f64)> {
        let (whole, far) = (star(0.4, 0), DVec3::X * 5.0);
        let small = TriangleMesh::new(whole.vertices().iter().map(|v| v * 0.05).collect(), whole.triangles().to_vec()).expect("a mesh");
        let mut holes = whole.triangles().to_vec();
        holes.retain({
            let mut r = random(3);
            move |_| r() > 0.03
        });
        let mut copied = whole.triangles().to_vec();
        copied.extend_from_slice(&whole.triangles()[40..60]);
        copied.extend(whole.triangles()[100..110].iter().map(|&[a, b, c]| [a, c, b]));
        let mut turned = whole.triangles().to_vec();
        turned[77..80].iter_mut().for_each(|t| t.swap(0, 1));
        let mut seams: Vec<DVec3> = whole.triangles().iter().flat_map(|t| t.map(|v| whole.vertices()[v as usize])).collect();
        seams.iter_mut().enumerate().filter(|(i, _)| i % 5 == 0).for_each(|(_, v)| *v *= 1.0 + f64::EPSILON);
        let torn = (0..seams.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let with = |triangles| TriangleMesh::new(whole.vertices().to_vec(), triangles).expect("a mesh");
        vec![
            ("open", star(0.3, 2), 0.3),
            ("half", star(0.3, 7), 0.2),
            ("holes", with(holes), 0.01),
            ("copies", with(copied), 0.3),
            ("turned", with(turned), 0.3),
            ("seams", TriangleMesh::new(seams, torn).expect("a mesh"), 0.6),
            ("crossing", together(&[(&whole, DVec3::ZERO, false), (&whole, DVec3::new(0.4, 0.1, 0.2), false)]), 0.3),
            ("nested", together(&[(&whole, DVec3::ZERO, false), (&small, DVec3::ZERO, false)]), 0.6),
            ("inside out", together(&[(&whole, DVec3::ZERO, true), (&small, far, false)]), 0.6),
            ("crossing, one inside out", together(&[(&whole, DVec3::ZERO, true), (&whole, DVec3::new(0.4, 0.1, 0.2), false)]), 0.3),
            ("open beside whole", together(&[(&star(0.3, 7), DVec3::ZERO, false), (&whole, far, false)]), 0.4),
        ]
    }

    #[test]
    fn walls_and_winding_numbers_never_disagree() {
        for (what, mesh, least) in faulty() {
            let asked = Asked::new(mesh, SignChoice::Auto);
            let Decided { sum, walls, .. } = asked.signs.decided.as_ref().expect("a rule");
            let decided = asked.signs.decided.as_ref().expect("a rule");
            assert!(asked.signs.rule.kind == SignKind::Winding && !matches!(walls, Walls::Trusted), "{what}: {}", asked.signs.rule.reason);
            let size = asked.mesh.extent().diagonal();
            let mut r = random(29);
            let (mut asked_near, mut known) = (0, 0);
            for index in 0..60_000 {
                let far = DVec3::new(r() - 0.5, r() - 0.5, r() - 0.5) * (0.2 * size);
                let p = if index % 3 == 0 { asked.near(&mut r) + far } else { asked.near(&mut r) };
                let (foot, triangle) = asked.foot(p);
                if asked.signs.blurred(&foot) {
                    continue;
                }
                asked_near += 1;
                let Some((side, carry)) = decided.near(asked.tree.facet(triangle), p, &foot, triangle) else { continue };
                known += 1;
                assert!(side.is_certain() && carry > 0.0);
                let by_sum = sum.side(p);
                assert!(by_sum == side || !by_sum.is_certain(), "{what} at {p}: {side:?}, {by_sum:?}, {foot:?} of {triangle}");
                // Along any path off the surface that is not too long; the shortest may round to the surface.
                if foot.distance_squared.sqrt() <= decided.normals.rounding() {
                    continue;
                }
                let step = carry.min(foot.distance_squared.sqrt()) * 0.999;
                let q = p + DVec3::new(r() - 0.5, r() - 0.5, r() - 0.5).normalize_or_zero() * step;
                let there = sum.side(q);
                assert!(there == side || !there.is_certain(), "{what} from {p} to {q}: {side:?}, {there:?}");
            }
            assert!(f64::from(known) >= least * f64::from(asked_near), "{what}: {known} of {asked_near}");
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
                let Some(side) = asked.signs.side_of_ball(asked.tree.facet(triangle), p, &foot, triangle, radius) else {
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
