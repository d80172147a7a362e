//! Angle-weighted pseudonormals (Baerentzen and Aanaes 2005), with proof against rounding.
//!
//! At a point q of a closed, consistently oriented surface that does not meet itself, let N be the sum
//! of the unit normals of the triangles that meet there, each times its angle at q (2 pi inside a face, pi on an
//! edge). By the divergence theorem on a small ball around q, N . e = -2 * integral of cos over the directions
//! that lead inside, for any unit vector e and the angle to it. If q is the nearest point to p and e the direction
//! from q to p, all directions with a positive cosine lead to p's side, so N . e > 0 just if p is outside.
//!
//! In floating point q is only almost nearest: the ball around p is empty up to r - d, for r = |p - q| and d
//! the rounding. If the surface within s of q is nothing but the triangles that meet at q, the directions with
//! cosines above g = d / s + s / (2 r) still lead to p's side, and the others add at most
//! 2 pi g^2. So |N . e| > 2 pi g^2 proves the side; anything else is left to the winding number.
//!
//! The best s is the root of 2 r d. Where r > 8 d and there is room for s >= 4 d, both parts of g are at most 1/4 for that or
//! the largest s below it, so that |N . e| > pi / 2 is enough: that is asked first, without another root.

use std::f64::consts::{PI, TAU};

use crate::bvh::intersect::{Clearance, Meetings};
use crate::geom::{DVec3, Facet, FacetPoint, Feature};
use crate::mesh::TriangleMesh;
use crate::mesh::topology::{Topology, collapsed};

/// Half an ulp of 1.
const UNIT: f64 = f64::EPSILON / 2.0;

/// So many times the rounding is room enough, with some to spare.
const CLEAR: f64 = 8.0 * (1.0 + 1e-9);

/// No more than this comes from directions outside the cone, as the module's text says.
const QUARTER: f64 = TAU / 4.0 * (1.0 + 1e-9);

/// Squared sides over the squared area up to which the rounding of a face's normal does not count.
const SHARP: f64 = 1e16;

/// A sum of unit normals weighted by angles, and the rounding in it.
#[derive(Clone, Copy, Debug, Default)]
struct Pseudonormal {
    sum: DVec3,
    error: f64,
}

impl Pseudonormal {
    fn add(&mut self, normal: Self, angle: f64) {
        self.sum += normal.sum * angle;
        self.error += normal.error * angle + 16.0 * UNIT;
    }
}

/// What is proven about the triangles of a mesh.
pub(crate) struct Proof<'a> {
    pub meetings: &'a Meetings,
    /// Whether a triangle counts once in the winding number and meets others in corners and edges only.
    pub sound: &'a [bool],
    /// How far the mesh was moved to decide sides.
    pub moved: f64,
}

/// The pseudonormals of a mesh on its welded topology.
#[derive(Clone, Debug)]
pub(crate) struct Pseudonormals {
    /// By triangle: its edges 0, 1, 2 in `edges`.
    edge_of: Vec<[u32; 3]>,
    /// By triangle: its corners in `corners`.
    corner_of: Vec<[u32; 3]>,
    edges: Vec<Pseudonormal>,
    corners: Vec<Pseudonormal>,
    /// Proven room by triangle; empty when nothing is proven.
    room: Vec<[f32; 2]>,
    /// How far a nearest point may be off.
    rounding: f64,
}

impl Pseudonormals {
    /// For any mesh; nothing is proven.
    pub fn new(mesh: &TriangleMesh, topology: &Topology) -> Self {
        let faces: Vec<Pseudonormal> = (0..topology.triangles.len() as u32).map(|t| face(&mesh.facet(t))).collect();
        let mut corners = vec![Pseudonormal::default(); mesh.vertices().len()];
        for (t, (welded, &normal)) in topology.triangles.iter().zip(&faces).enumerate() {
            let at = mesh.corners(t as u32);
            for k in 0..3 {
                let (u, v) = (at[(k + 1) % 3] - at[k], at[(k + 2) % 3] - at[k]);
                corners[welded[k] as usize].add(normal, u.cross(v).length().atan2(u.dot(v)));
            }
        }
        let mut edge_of = vec![[u32::MAX; 3]; faces.len()];
        let mut edges = Vec::with_capacity(faces.len() * 3 / 2);
        let mut ends = Vec::with_capacity(faces.len() * 3 / 2);
        for sides in topology.edges() {
            let mut sum = Pseudonormal::default();
            for side in sides {
                edge_of[side.triangle as usize][usize::from(side.side)] = edges.len() as u32;
                sum.add(faces[side.triangle as usize], PI);
            }
            edges.push(sum);
            ends.push(sides[0].ends);
        }
        // A collapsed triangle is a segment: its sides are edges of others, if they are of any.
        for (t, welded) in topology.triangles.iter().enumerate().filter(|(_, welded)| collapsed(welded)) {
            for k in 0..3 {
                let (a, b) = (welded[k], welded[(k + 1) % 3]);
                if let Ok(edge) = ends.binary_search(&[a.min(b), a.max(b)]) {
                    edge_of[t][k] = edge as u32;
                }
            }
        }
        Self { edge_of, corner_of: topology.triangles.clone(), edges, corners, room: Vec::new(), rounding: rounding(mesh) }
    }

    /// Leaves only corners and edges around which the surface is whole their normal, and notes how much room they have.
    pub fn prove(mut self, topology: &Topology, proof: &Proof<'_>) -> Self {
        let unsound = topology.triangles.iter().zip(proof.sound).filter(|(welded, sound)| !**sound && !collapsed(welded));
        for &corner in unsound.flat_map(|(welded, _)| welded) {
            self.corners[corner as usize].error = f64::INFINITY;
        }
        for (corner, pinched) in self.corners.iter_mut().zip(topology.pinched()) {
            if *pinched {
                corner.error = f64::INFINITY;
            }
        }
        let sound = |t: u32| proof.sound[t as usize];
        for (sides, edge) in topology.edges().zip(&mut self.edges) {
            if !matches!(sides, [a, b] if a.forward != b.forward && sound(a.triangle) && sound(b.triangle)) {
                edge.error = f64::INFINITY;
                for end in sides[0].ends {
                    self.corners[end as usize].error = f64::INFINITY;
                }
            }
        }
        let room = |t: u32| {
            let Clearance { gap, slope } = proof.meetings.clearance(t);
            if sound(t) { [gap as f32, slope as f32] } else { [0.0; 2] }
        };
        self.room = (0..self.corner_of.len() as u32).map(room).collect();
        self.rounding += 2.0 * proof.moved;
        self
    }

    /// How far a nearest point may be off.
    pub fn rounding(&self) -> f64 {
        self.rounding
    }

    /// Whether the surface is proven to be whole all around a triangle: at its face, its edges and its corners.
    pub fn whole(&self, triangle: u32) -> bool {
        let t = triangle as usize;
        let edges = self.edge_of[t].iter().all(|&edge| self.edges.get(edge as usize).is_some_and(|normal| normal.error.is_finite()));
        let corners = self.corner_of[t].iter().all(|&corner| self.corners[corner as usize].error.is_finite());
        edges && corners && self.room.get(t).is_some_and(|room| room[0] > 0.0)
    }

    /// The side of `p`, whose nearest point is `nearest` on `triangle`, prepared as `facet`: positive outside, negative
    /// inside; `None` where rounding may have turned it.
    pub fn side(&self, facet: &Facet, p: DVec3, nearest: &FacetPoint, triangle: u32) -> Option<f64> {
        let away = p - nearest.point;
        let distance = away.length();
        let off = self.rounding.max(64.0 * UNIT * p.abs().max_element());
        if distance <= 8.0 * off {
            return None;
        }
        let t = triangle as usize;
        let room = self.room.get(t);
        let clear = room.is_none_or(|&[gap, slope]| {
            let (gap, slope) = (f64::from(gap), f64::from(slope));
            // Half the room is kept to, and four times the rounding has to fit in.
            gap > CLEAR * off && beyond_edges(facet, nearest, slope, (CLEAR + slope) * off)
        });
        let normal = match nearest.feature {
            Feature::Face => {
                let across = facet.ab.cross(facet.ac);
                let height = across.dot(away);
                let (length, sides) = (across.length(), facet.ab.length_squared() * facet.ac.length_squared());
                if clear && height.abs() > 0.5 * length * distance && sides < SHARP * (length * length) {
                    return Some(height);
                }
                let mut normal = Pseudonormal::default();
                normal.add(face(facet), TAU);
                normal
            }
            Feature::Edge(k) => *self.edges.get(self.edge_of[t][usize::from(k)] as usize)?,
            Feature::Vertex(k) => self.corners[self.corner_of[t][usize::from(k)] as usize],
        };
        let height = normal.sum.dot(away);
        let least = normal.error * distance + normal.sum.length() * off;
        if clear && height.abs() > QUARTER * distance + least {
            return Some(height);
        }
        let unsure = match room {
            None => 0.0,
            Some(&[gap, slope]) => {
                let clear = f64::from(gap).min(f64::from(slope) * (reach(facet, nearest) - off)) * 0.5;
                if clear <= 4.0 * off {
                    return None;
                }
                let ball = clear.min((2.0 * distance * off).sqrt()).min(distance);
                let cosine = off / ball + ball / (2.0 * distance);
                TAU * cosine * cosine
            }
        };
        (height.abs() > unsure * distance + least).then_some(height)
    }

    /// Whether all surface about a point that is within rounding of a face is that face.
    pub fn is_plane(&self, facet: &Facet, p: DVec3, nearest: &FacetPoint, triangle: u32) -> bool {
        let off = self.rounding.max(64.0 * UNIT * p.abs().max_element());
        // The point, its true nearest one and the one found are this near to each other.
        let near = 16.0 * off;
        let whole = |&[gap, slope]: &[f32; 2]| {
            let (gap, slope) = (f64::from(gap), f64::from(slope));
            gap > 2.0 * near && beyond_edges(facet, nearest, slope, 2.0 * near + slope * near)
        };
        let on_face = nearest.feature == Feature::Face && nearest.distance_squared <= 64.0 * off * off;
        on_face && self.room.get(triangle as usize).is_some_and(whole)
    }
}

/// The unit normal of a triangle; zero where it has none.
fn face(facet: &Facet) -> Pseudonormal {
    let (ab, ac) = (facet.ab, facet.ac);
    let cross = ab.cross(ac);
    let length = cross.length();
    if length == 0.0 {
        return Pseudonormal::default();
    }
    Pseudonormal { sum: cross / length, error: 8.0 * UNIT * ((ab.length_squared() * ac.length_squared()).sqrt() / length + 1.0) }
}

/// The edges of a triangle that do not contain the nearest point's feature: the squared area of the parallelogram over each
/// and the nearest point, and its squared length.
fn edges_off(facet: &Facet, nearest: &FacetPoint) -> impl Iterator<Item = (f64, f64)> {
    let (w, [ab, ac]) = (nearest.point - facet.a, [facet.ab, facet.ac]);
    let edges = [(ab, w), (ac - ab, w - ab), (ac, w)];
    let feature = nearest.feature;
    let counts = move |edge: u8| match feature {
        Feature::Face => true,
        Feature::Edge(own) => edge != own,
        Feature::Vertex(own) => edge == (own + 1) % 3,
    };
    (0..3).filter(move |&edge| counts(edge)).map(move |edge| {
        let (along, from) = edges[usize::from(edge)];
        (along.cross(from).length_squared(), along.length_squared())
    })
}

/// Whether `slope` times the distance to all those edges is above `limit`.
fn beyond_edges(facet: &Facet, nearest: &FacetPoint, slope: f64, limit: f64) -> bool {
    edges_off(facet, nearest).all(|(area, length)| slope * slope * area > limit * limit * length)
}

/// Distance from the nearest point to those edges.
fn reach(facet: &Facet, nearest: &FacetPoint) -> f64 {
    // One root of the least is quicker than a root for each.
    edges_off(facet, nearest).map(|(area, length)| area / length).fold(f64::INFINITY, f64::min).sqrt()
}

/// How far a nearest point may be off, for points within the box of the mesh.
pub(crate) fn rounding(mesh: &TriangleMesh) -> f64 {
    let extent = mesh.extent();
    64.0 * UNIT * extent.min.abs().max(extent.max.abs()).max_element()
}
