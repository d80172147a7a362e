//! Closed polygons in the plane, the same at every height: exact distances to their edges.

use crate::distance::{Distance, SampleBlock, Source};
use crate::error::{Error, Result};
use crate::geom::{Aabb, DVec3, Interval};
use crate::source::balls;

/// Edges whose box is looked at together.
const GROUP: usize = 8;

/// What is inside, from how often the loops run around a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fill {
    /// Where they run around an odd number of times: a loop in a loop is a hole, whatever its direction.
    EvenOdd,
    /// Where they run around at all: a hole runs the other way.
    Winding,
}

/// The points of the plane between closed loops of straight edges, at every z.
#[derive(Clone, Debug)]
pub struct Polygon {
    edges: Vec<Edge>,
    /// Box of every so many edges.
    groups: Vec<Aabb>,
    extent: Aabb,
    fill: Fill,
}

/// From one corner to the next; z is zero.
#[derive(Clone, Copy, Debug)]
struct Edge {
    a: DVec3,
    b: DVec3,
}

impl Edge {
    /// Where the nearest point lies on the line, 0 at `a` and 1 at `b`.
    fn part(&self, p: DVec3) -> f64 {
        let way = self.b - self.a;
        (p - self.a).dot(way) / way.length_squared()
    }

    fn distance_squared(&self, p: DVec3) -> f64 {
        let nearest = match self.part(p) {
            part if part <= 0.0 => self.a,
            part if part >= 1.0 => self.b,
            part => self.a + (self.b - self.a) * part,
        };
        (p - nearest).length_squared()
    }
}

impl Polygon {
    /// Loops of corners, the last joined to the first. An edge that is there twice, in the middle of what is inside or of
    /// what is outside, counts as a boundary for the distance.
    pub fn new(loops: &[Vec<[f64; 2]>], fill: Fill) -> Result<Self> {
        let mut edges = Vec::new();
        for (number, corners) in loops.iter().enumerate() {
            if corners.iter().flatten().any(|v| !v.is_finite()) {
                return Err(Error::invalid(format!("loop {number} of the polygon has corners that are not finite; give finite numbers")));
            }
            let places: Vec<DVec3> = corners.iter().map(|&[x, y]| DVec3::new(x, y, 0.0)).collect();
            let before = edges.len();
            for (at, &a) in places.iter().enumerate() {
                let b = places[(at + 1) % places.len()];
                if a != b {
                    edges.push(Edge { a, b });
                }
            }
            if edges.len() < before + 3 {
                return Err(Error::invalid(format!("loop {number} of the polygon has fewer than three corners; give three or more")));
            }
        }
        if edges.is_empty() {
            return Err(Error::invalid("the polygon has no loops; give one or more"));
        }
        let around = |edges: &[Edge]| Aabb::around(edges.iter().flat_map(|edge| [edge.a, edge.b]));
        let mut extent = around(&edges);
        (extent.min.z, extent.max.z) = (f64::NEG_INFINITY, f64::INFINITY);
        Ok(Self { groups: edges.chunks(GROUP).map(around).collect(), edges, extent, fill })
    }

    fn is_inside(&self, p: DVec3) -> bool {
        let mut turns = 0;
        for Edge { a, b } in &self.edges {
            if (a.y <= p.y) != (b.y <= p.y) {
                let left = (*b - *a).cross(p - *a).z;
                if a.y < b.y && left > 0.0 {
                    turns += 1;
                } else if a.y > b.y && left < 0.0 {
                    turns -= 1;
                }
            }
        }
        match self.fill {
            Fill::EvenOdd => turns % 2 != 0,
            Fill::Winding => turns != 0,
        }
    }

    fn unsigned(&self, p: DVec3) -> f64 {
        let mut best = f64::INFINITY;
        for (group, edges) in self.groups.iter().zip(self.edges.chunks(GROUP)) {
            if group.distance_squared(p) < best {
                best = edges.iter().map(|edge| edge.distance_squared(p)).fold(best, f64::min);
            }
        }
        best.sqrt()
    }

    fn value(&self, p: DVec3) -> f64 {
        let p = p.with_z(0.0);
        let distance = self.unsigned(p);
        if self.is_inside(p) { -distance } else { distance }
    }

    /// The edges that can be nearest somewhere in a cell, without those that are so in a common corner only.
    fn candidates(&self, center: DVec3, half: DVec3) -> Vec<Edge> {
        let radius = half.length();
        let reach = self.unsigned(center) + 2.0 * radius;
        let near = |edge: &&Edge| edge.distance_squared(center) <= reach * reach * (1.0 + 1e-12);
        let mut found: Vec<Edge> = self.edges.iter().filter(near).copied().collect();
        // Where the nearest point of an edge is always the corner it shares with another, the other is as near.
        let mut number = 0;
        while number < found.len() {
            let edge = found[number];
            let way = edge.b - edge.a;
            let spread = half.dot(way.abs()) / way.length_squared() * (1.0 + 1e-9);
            let part = edge.part(center);
            let end = if part + spread < 0.0 {
                Some(edge.a)
            } else if part - spread > 1.0 {
                Some(edge.b)
            } else {
                None
            };
            let shared = |other: &Edge| end == Some(other.a) || end == Some(other.b);
            if found.iter().enumerate().any(|(other, edge)| other != number && shared(edge)) {
                found.remove(number);
            } else {
                number += 1;
            }
        }
        found
    }
}

impl Distance for Polygon {
    /// Without end along z.
    fn extent(&self) -> Option<Aabb> {
        Some(self.extent)
    }

    fn at(&self, p: DVec3) -> Interval {
        Interval::exact(self.value(p))
    }

    fn over(&self, cell: &Aabb) -> Interval {
        let half = (0.5 * cell.size()).with_z(0.0);
        self.at(cell.center().with_z(0.0)).widen(half.length() * (1.0 + 1e-12))
    }
}

impl Source for Polygon {
    fn values(&self, points: &[DVec3], out: &mut [f64]) -> Result<()> {
        for (p, out) in points.iter().zip(out) {
            *out = self.value(*p);
        }
        Ok(())
    }

    fn residual(&self, block: &SampleBlock<'_>, out: &mut [Interval]) -> Result<()> {
        block.residual(block.between(self.bend(&block.cell), self.noise()), out);
        let ask = |points: &[DVec3], out: &mut [Interval]| {
            self.at_many(points, out);
            Ok(())
        };
        balls::narrow(block, self.noise(), ask, out)
    }

    /// The distance to one edge is convex; so is its negative concave, inside. A cell with several edges has ridges.
    fn bend(&self, cell: &Aabb) -> Interval {
        let (center, half) = (cell.center().with_z(0.0), (0.5 * cell.size()).with_z(0.0));
        let value = self.value(center);
        let least = value.abs() - half.length() * (1.0 + 1e-12);
        let found = self.candidates(center, half);
        let [edge] = found[..] else {
            let curve = if least > 0.0 { 1.0 / least } else { f64::INFINITY };
            return if value > 0.0 && least > 0.0 {
                Interval { lower: f64::NEG_INFINITY, upper: curve }
            } else {
                Interval { lower: -curve, upper: f64::INFINITY }
            };
        };
        let way = edge.b - edge.a;
        let spread = half.dot(way.abs()) / way.length_squared() * (1.0 + 1e-9);
        let part = edge.part(center);
        if part - spread >= 0.0 && part + spread <= 1.0 {
            // Along the edge the distance is linear on either side, and with its sign across the edge too.
            let crossing = self.fill == Fill::EvenOdd || least > 0.0;
            return if crossing { Interval::exact(0.0) } else { Interval::ALL };
        }
        match least > 0.0 {
            true if value > 0.0 => Interval { lower: 0.0, upper: 1.0 / least },
            true => Interval { lower: -1.0 / least, upper: 0.0 },
            false => Interval::ALL,
        }
    }

    fn is_flat(&self) -> bool {
        true
    }

    fn noise(&self) -> f64 {
        16.0 * f64::EPSILON * self.extent.min.with_z(0.0).abs().max(self.extent.max.with_z(0.0).abs()).max_element()
    }
}
