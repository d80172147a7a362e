//! Wall thickness at one place: the inscribed ball that touches there, and the ray straight across.
//!
//! The ball is found by shrinking (Ma, Bae and Choi, *3D medial axis point approximation using
//! nearest neighbors and the normal field*, 2012): a ball that touches the wall at `p` and is too
//! large has a surface point inside; the nearest one to its centre sets the next, smaller ball.
//! With exact nearest points this is Newton's iteration on the opposite wall.

use super::samples::Place;
use crate::bvh::{Candidate, Ray};
use crate::distance::Distance;
use crate::geom::DVec3;
use crate::source::mesh::{SignKind, Surface};

/// Balls tried at most; a dozen is much.
const STEPS: usize = 100;

/// Two walls oppose each other if the ball touches them at least this far apart: cosine of 135 degrees.
const OPPOSITE: f64 = -std::f64::consts::FRAC_1_SQRT_2;

/// What kind of place a sample is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// On a wall: the ball spans from this wall to one that opposes it.
    Wall,
    /// In a convex edge: the ball is held by two walls that meet just beyond it, so its diameter
    /// tells how near the edge is and not how thick the wall is. Also where the ball is smaller than
    /// the tolerance: such folds and needles are no walls.
    Edge,
    /// Not between inside and outside: a face inside the material, or a sheet without thickness.
    Inner,
}

/// A wall point, the point across, and the thickness between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Across {
    /// In model units.
    pub thickness: f64,
    /// Where the ball or the ray touches the other wall.
    pub opposite: DVec3,
    /// The triangle touched there.
    pub triangle: u32,
}

/// The wall at one place of the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// The place.
    pub point: DVec3,
    /// Unit normal of the wall, out of the material.
    pub normal: DVec3,
    /// The triangle that holds the place.
    pub triangle: u32,
    /// Surface area that the sample stands for.
    pub area: f64,
    /// What kind of place it is.
    pub kind: Kind,
    /// By inscribed ball; absent on inner faces.
    pub sphere: Option<Across>,
    /// Along the inward normal; absent on inner faces and where the ray leaves without a hit.
    pub ray: Option<Across>,
    /// How far the ball may stay from the wall here: what the facets of a curved wall stray from it.
    pub slack: f64,
}

/// Measures walls.
pub(super) struct Gauge<'a> {
    surface: &'a Surface,
    /// Rounding error of a distance.
    rounding: f64,
    /// Whether the rule for sides follows the orientation of the triangles.
    oriented: bool,
    /// Distance at which the two sides of the surface are told apart.
    aside: f64,
    /// Balls no larger across than this are not taken for walls.
    tolerance: f64,
    /// No inscribed ball has a larger radius.
    largest: f64,
}

/// A ball that touches the wall, and the point that holds it from growing.
struct Ball {
    center: DVec3,
    radius: f64,
    held: DVec3,
    triangle: u32,
}

impl<'a> Gauge<'a> {
    /// `largest` is an upper bound of the part's greatest depth.
    pub fn new(surface: &'a Surface, rounding: f64, tolerance: f64, largest: f64) -> Self {
        let aside = (1e-7 * surface.mesh().extent().diagonal()).max(100.0 * rounding);
        let oriented = surface.sign_rule().kind == SignKind::Pseudonormal;
        Self { surface, rounding, oriented, aside, tolerance, largest }
    }

    pub fn sample(&self, place: &Place) -> Sample {
        let &Place { point, normal, triangle, area, slack } = place;
        let sample = Sample { point, normal, triangle, area, kind: Kind::Inner, sphere: None, ray: None, slack };
        // Where pseudonormals decide, the inside is behind the triangles; else ask both sides.
        let behind = self.oriented || self.inside(point - normal * self.aside);
        let before = !self.oriented && self.inside(point + normal * self.aside);
        if behind == before || normal == DVec3::ZERO {
            return sample;
        }
        let inward = if behind { -normal } else { normal };
        let ray = self.ray(point, inward, triangle);
        let ball = self.ball(point, inward, slack, ray);
        let tiny = 2.0 * ball.radius <= self.tolerance;
        let kind = if tiny || self.in_edge(point, inward, slack, &ball) { Kind::Edge } else { Kind::Wall };
        let sphere = Some(Across { thickness: 2.0 * ball.radius, opposite: ball.held, triangle: ball.triangle });
        Sample { normal: -inward, kind, sphere, ray, ..sample }
    }

    fn inside(&self, p: DVec3) -> bool {
        self.surface.at(p).upper < 0.0
    }

    fn ray(&self, point: DVec3, inward: DVec3, triangle: u32) -> Option<Across> {
        let scale = self.surface.scale();
        let ray = Ray { origin: point * scale, direction: inward, beyond: 4.0 * self.rounding * scale, ignore: triangle };
        self.surface.tree().first_hit(self.surface.work(), &ray).map(|hit| {
            let thickness = hit.distance / scale;
            Across { thickness, opposite: point + inward * thickness, triangle: hit.triangle }
        })
    }

    /// The largest inscribed ball that touches the wall at `p` up to `slack`.
    fn ball(&self, p: DVec3, inward: DVec3, slack: f64, ray: Option<Across>) -> Ball {
        let play = |radius: f64| slack.min(0.1 * radius).max(8.0 * self.rounding);
        let mut radius = self.largest;
        let (mut held, mut triangle) = (p + inward * (2.0 * radius), u32::MAX);
        if let Some(across) = ray.filter(|across| across.thickness < 2.0 * radius) {
            (radius, held, triangle) = (0.5 * across.thickness, across.opposite, across.triangle);
        }
        for _ in 0..STEPS {
            let Some((q, t)) = self.nearest(p + inward * radius, radius - play(radius)) else { break };
            let across = q - p;
            let height = inward.dot(across);
            let next = 0.5 * across.length_squared() / height;
            // A point of the tangent plane or behind it cannot be inside the ball but by rounding.
            if !(height > 0.0 && next < radius) {
                break;
            }
            (radius, held, triangle) = (next, q, t);
        }
        let center = p + inward * radius;
        // Twice a true distance: the ball lies inside the part, whatever the iteration did.
        let depth = self.nearest(center, f64::INFINITY).map_or(radius, |(q, t)| {
            if triangle == u32::MAX {
                (held, triangle) = (q, t);
            }
            q.distance(center)
        });
        Ball { center, radius: depth, held, triangle }
    }

    fn nearest(&self, p: DVec3, within: f64) -> Option<(DVec3, u32)> {
        if within <= 0.0 {
            return None;
        }
        let (tree, scale) = (self.surface.tree(), self.surface.scale());
        let found = tree.nearest(p * scale, Candidate::within(within * scale));
        found.found().then(|| (tree.facet(found.triangle).nearest(p * scale).point / scale, found.triangle))
    }

    /// Whether the ball sits in a convex edge: nothing opposes the wall at `p`, and the wall ends
    /// before the line where its plane meets the plane that holds the ball.
    fn in_edge(&self, p: DVec3, inward: DVec3, slack: f64, ball: &Ball) -> bool {
        let cosine = |q: DVec3| (p - ball.center).normalize_or_zero().dot((q - ball.center).normalize_or_zero());
        let turn = cosine(ball.held);
        if turn <= OPPOSITE {
            return false;
        }
        // Balls in round bars touch all around, as well as the facets' normals can tell.
        let play = if slack > 0.0 { (4.0 * slack + 0.1 * ball.radius).min(0.2 * ball.radius) } else { 1e-6 * ball.radius };
        let reach = ball.radius + play;
        let across = self.nearest(ball.center + inward * ball.radius, f64::INFINITY);
        if across.is_some_and(|(q, _)| q.distance(ball.center) <= reach && cosine(q) <= OPPOSITE) {
            return false;
        }
        let along = ball.held - p;
        let Some(along) = (along - inward * inward.dot(along)).try_normalize() else { return false };
        // tan(beta / 2) from cos(beta): where the two tangent planes meet.
        let meet = ball.radius * ((1.0 - turn) / (1.0 + turn)).sqrt();
        // Just beyond that line and below the plane that holds the ball, but above the wall's own.
        let sine = (1.0 - turn * turn).max(0.0).sqrt();
        !self.inside(p + along * (1.05 * meet) + inward * (0.02 * sine * meet))
    }
}
