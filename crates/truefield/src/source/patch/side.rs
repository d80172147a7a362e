//! On which side of closed patches a point is.
//!
//! Farther from the patches than triangles next to them are, both have the same side. A ball that certainly holds no surface is
//! on one side, and two that overlap are on the same: large balls that touch the patches tell for most points, and a chain
//! of balls leads from any other to where the triangles decide.

use std::collections::HashMap;
use std::sync::Arc;

use super::bezier::Bezier;
use super::nearest::Foot;
use crate::distance::Distance;
use crate::error::{Error, Result};
use crate::geom::{Aabb, DVec3};
use crate::mesh::TriangleMesh;
use crate::run::Run;
use crate::source::mesh::{SignChoice, SignKind, Surface};

/// Triangles along the side of a patch, two for each square, that decide sides.
const FACETS: u32 = 24;

/// Balls along the side of a patch, two for each square.
const BALLS: usize = 8;

/// Of the largest ball that fits: from the middle of that one, much of the surface is as near, which makes searches long.
const ROOM: f64 = 0.7;

/// The radius of the largest balls, of the size of a patch.
const LARGEST: f64 = 0.25;

/// How often a ball is made smaller until it touches the patches where it should.
const FITS: usize = 6;

/// Balls that lead from a point off the surface until its triangles say on which side that is.
const STEPS: usize = 64;

/// How far ahead a larger ball is looked for, in errors of the triangles.
const AHEAD: f64 = 4.0;

/// Triangles next to closed patches, and balls between both.
#[derive(Debug)]
pub(super) struct Sided {
    surface: Surface,
    /// No point of a patch is farther from its place on the triangles.
    error: f64,
    /// What is nearer to the patches is on none of their sides.
    accuracy: f64,
    /// Of each square of each patch, on both sides of it.
    balls: Vec<[Ball; 2]>,
}

/// A ball without surface.
#[derive(Clone, Copy, Debug)]
struct Ball {
    center: DVec3,
    radius: f64,
    /// -1 inside, 1 outside.
    side: f64,
}

/// No ball.
const NONE: Ball = Ball { center: DVec3::ZERO, radius: f64::NEG_INFINITY, side: 1.0 };

impl Sided {
    /// Fails where the patches do not close up. `search` finds the nearest point.
    pub fn new(patches: &[Bezier], accuracy: f64, search: impl Fn(DVec3) -> Foot + Sync, run: &Run<'_>) -> Result<Self> {
        let mut sided = Self::of_triangles(patches, accuracy, run)?;
        let balls = run.blocks("look for sides", patches.len(), |patch| {
            let middle = |k: usize| (k as f64 + 0.5) / BALLS as f64;
            let largest = LARGEST * Aabb::around(patches[patch].controls()).diagonal();
            let squares = (0..BALLS * BALLS).map(|k| {
                let here = patches[patch].derivatives(middle(k / BALLS), middle(k % BALLS));
                let normal = here.u.cross(here.v).normalize_or_zero();
                [normal, -normal].map(|way| sided.ball(here.at, way, largest, &search))
            });
            Ok(squares.collect::<Vec<_>>())
        })?;
        sided.balls = balls.into_iter().flatten().collect();
        Ok(sided)
    }

    fn of_triangles(patches: &[Bezier], accuracy: f64, run: &Run<'_>) -> Result<Self> {
        let size = Aabb::around(patches.iter().flat_map(Bezier::controls));
        let mut weld = Weld { near: 1e-12 * (size.diagonal() + size.min.abs().max(size.max.abs()).max_element()), ..Weld::default() };
        let mut triangles = Vec::new();
        let mut error = 0.0_f64;
        for patch in patches {
            let mut vertex = |i: u32, j: u32| weld.vertex(patch.point(f64::from(i) / f64::from(FACETS), f64::from(j) / f64::from(FACETS)));
            for (i, j) in (0..FACETS * FACETS).map(|k| (k / FACETS, k % FACETS)) {
                let [a, b, c, d] = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| vertex(i, j));
                triangles.extend([[a, b, c], [a, c, d]].into_iter().filter(|[a, b, c]| a != b && b != c && a != c));
            }
            // Linear interpolation over a triangle is off by an eighth of its squared sides times second derivatives.
            let [.., uu, uv, vv] = patch.hulls().map(|hull| hull.min.abs().max(hull.max.abs()).length());
            error = error.max((uu + 2.0 * uv + vv) / (8.0 * f64::from(FACETS * FACETS)));
        }
        if triangles.is_empty() {
            return Err(Error::invalid("the patches have no area"));
        }
        let weld_error = weld.near;
        let surface = Surface::new(Arc::new(TriangleMesh::new(weld.vertices, triangles)?), SignChoice::Auto, run)?;
        let rule = surface.sign_rule();
        if rule.kind != SignKind::Pseudonormal {
            return Err(Error::invalid(format!(
                "the patches have no certain inside ({}); make them close up, with equal control points along shared edges, or take \
                 them unsigned",
                rule.reason
            )));
        }
        Ok(Self { surface, error: error * (1.0 + 1e-9) + 16.0 * weld_error, accuracy, balls: Vec::new() })
    }

    /// A ball that touches a patch from the direction `way`, as large as fits.
    fn ball(&self, at: DVec3, way: DVec3, largest: f64, search: &impl Fn(DVec3) -> Foot) -> Ball {
        let mut radius = largest;
        for _ in 0..FITS {
            let center = at + way * radius;
            let found = search(center);
            if found.lower >= 0.99 * radius {
                return self.side(center, found, search).map_or(NONE, |side| Ball { center, radius: found.lower, side });
            }
            // The ball that touches what is in the way.
            let chord = found.point - at;
            let fits = chord.length_squared() / (2.0 * chord.dot(way));
            radius = if fits > 0.0 && fits < radius { ROOM * fits } else { 0.5 * radius };
        }
        NONE
    }

    /// -1 inside, 1 outside; `None` where that is not certain.
    pub fn side(&self, p: DVec3, found: Foot, search: impl Fn(DVec3) -> Foot) -> Option<f64> {
        let (mut at, mut found) = (p, found);
        for _ in 0..STEPS {
            if let Some(side) = self.by_balls(at, &found) {
                return Some(side);
            }
            if found.lower > self.error {
                let there = self.surface.at(at);
                return if there.upper < 0.0 {
                    Some(-1.0)
                } else if there.lower > 0.0 {
                    Some(1.0)
                } else {
                    None
                };
            }
            if found.lower <= self.accuracy {
                return None;
            }
            // Within a ball there is no surface: all of it is on one side. Straight to where triangles decide if the ball there
            // overlaps, else within this one.
            let way = (at - found.point).normalize_or_zero();
            let ahead = at + way * (AHEAD * self.error);
            let next = search(ahead);
            if overlap(at, &found, ahead, next.lower) && next.lower > self.error {
                (at, found) = (ahead, next);
                continue;
            }
            at += way * (0.99 * found.lower);
            let next = search(at);
            if next.lower <= found.lower {
                return None;
            }
            found = next;
        }
        None
    }

    fn by_balls(&self, p: DVec3, found: &Foot) -> Option<f64> {
        let (patch, place) = found.place?;
        let [i, j] = place.map(|t| ((t * BALLS as f64) as usize).min(BALLS - 1));
        let pair = self.balls.get((patch as usize * BALLS + i) * BALLS + j)?;
        pair.iter().find(|ball| overlap(p, found, ball.center, ball.radius)).map(|ball| ball.side)
    }
}

/// Whether the ball around a point that holds no surface overlaps another one.
fn overlap(p: DVec3, found: &Foot, center: DVec3, radius: f64) -> bool {
    // Rounding is taken off both radii; that of the way between is less.
    p.distance(center) < (found.lower + radius) * (1.0 - 1e-12)
}

/// Points of several patches that are one but for rounding.
#[derive(Default)]
struct Weld {
    vertices: Vec<DVec3>,
    cells: HashMap<[i64; 3], u32>,
    near: f64,
}

impl Weld {
    /// The number of a point, or of one known nearby.
    fn vertex(&mut self, p: DVec3) -> u32 {
        // What is near lies in the same cell, four times as wide, or just beyond its border.
        let cell = |q: DVec3| (q / (4.0 * self.near)).floor().to_array().map(|c| c as i64);
        let around = Aabb::new(p - self.near, p + self.near);
        if let Some(&known) = (0..8).find_map(|corner| self.cells.get(&cell(around.corner(corner)))) {
            return known;
        }
        let number = self.vertices.len() as u32;
        let home = cell(p);
        self.vertices.push(p);
        self.cells.insert(home, number);
        number
    }
}
