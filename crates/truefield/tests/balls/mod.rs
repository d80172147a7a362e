//! Solids made of balls, one after the other, of which the distance is known exactly.

use truefield::{Aabb, DVec3, Distance, Interval, Result, Source};

/// A ball.
#[derive(Clone, Copy, Debug)]
pub struct Ball {
    pub center: DVec3,
    pub radius: f64,
}

impl Ball {
    pub fn new(x: f64, y: f64, z: f64, radius: f64) -> Self {
        Self { center: DVec3::new(x, y, z), radius }
    }

    pub fn value(&self, p: DVec3) -> f64 {
        (p - self.center).length() - self.radius
    }
}

impl Distance for Ball {
    fn extent(&self) -> Option<Aabb> {
        Some(Aabb::new(self.center - self.radius, self.center + self.radius))
    }

    fn at(&self, p: DVec3) -> Interval {
        Interval::exact(self.value(p))
    }
}

impl Source for Ball {
    fn values(&self, points: &[DVec3], out: &mut [f64]) -> Result<()> {
        for (p, out) in points.iter().zip(out) {
            *out = self.value(*p);
        }
        Ok(())
    }

    fn bend(&self, cell: &Aabb) -> Interval {
        Interval { lower: 0.0, upper: 1.0 / cell.distance_squared(self.center).sqrt() }
    }
}

/// What is done with the next ball.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    Carve,
    Fill,
    Intersect,
}

/// A ball, and what others did to it.
#[derive(Clone, Debug)]
pub struct Solid {
    pub balls: Vec<Ball>,
    pub steps: Vec<Step>,
    /// Points where three spheres meet on the surface.
    corners: Vec<DVec3>,
}

impl Solid {
    pub fn new(first: Ball, rest: &[(Step, Ball)]) -> Self {
        let mut solid = Self { balls: vec![first], steps: Vec::new(), corners: Vec::new() };
        for (step, ball) in rest {
            solid.steps.push(*step);
            solid.balls.push(*ball);
        }
        let n = solid.balls.len();
        for i in 0..n {
            for j in i + 1..n {
                let Some(circle) = solid.circle(i, j) else { continue };
                for k in j + 1..n {
                    for p in circle.meets(&solid.balls[k]) {
                        if solid.is_edge(p, &[i, j, k]) {
                            solid.corners.push(p);
                        }
                    }
                }
            }
        }
        solid
    }

    /// The value that editing is to follow.
    pub fn value(&self, p: DVec3) -> f64 {
        let mut value = self.balls[0].value(p);
        for (step, ball) in self.steps.iter().zip(&self.balls[1..]) {
            let tool = ball.value(p);
            value = match step {
                Step::Carve => value.max(-tool),
                Step::Fill => value.min(tool),
                Step::Intersect => value.max(tool),
            };
        }
        value
    }

    fn is_inside(&self, inside: &[bool]) -> bool {
        let mut value = inside[0];
        for (step, &ball) in self.steps.iter().zip(&inside[1..]) {
            value = match step {
                Step::Carve => value && !ball,
                Step::Fill => value || ball,
                Step::Intersect => value && ball,
            };
        }
        value
    }

    /// Whether a point on some of the spheres is on the surface: being in those or not makes a difference.
    fn is_edge(&self, p: DVec3, on: &[usize]) -> bool {
        let mut inside: Vec<bool> = self.balls.iter().map(|ball| ball.value(p) < 0.0).collect();
        let mut seen = [false; 2];
        for choice in 0..1 << on.len() {
            for (bit, &ball) in on.iter().enumerate() {
                inside[ball] = choice >> bit & 1 == 1;
            }
            seen[usize::from(self.is_inside(&inside))] = true;
        }
        seen == [true; 2]
    }

    fn circle(&self, i: usize, j: usize) -> Option<Circle> {
        let (a, b) = (self.balls[i], self.balls[j]);
        let way = b.center - a.center;
        let d = way.length();
        let along = (d * d + a.radius * a.radius - b.radius * b.radius) / (2.0 * d);
        let square = a.radius * a.radius - along * along;
        (d > 0.0 && square > 0.0).then(|| Circle { center: a.center + way * (along / d), axis: way / d, radius: square.sqrt() })
    }

    /// The signed distance, exactly; infinite for no solid.
    pub fn distance(&self, p: DVec3) -> f64 {
        let mut best = f64::INFINITY;
        let n = self.balls.len();
        for i in 0..n {
            let ball = self.balls[i];
            let on = ball.center + (p - ball.center).normalize() * ball.radius;
            if (on - p).length() < best && self.is_edge(on, &[i]) {
                best = (on - p).length();
            }
            for j in i + 1..n {
                if let Some(circle) = self.circle(i, j) {
                    let on = circle.nearest(p);
                    if (on - p).length() < best && self.is_edge(on, &[i, j]) {
                        best = (on - p).length();
                    }
                }
            }
        }
        best = self.corners.iter().map(|corner| (*corner - p).length()).fold(best, f64::min);
        let inside: Vec<bool> = self.balls.iter().map(|ball| ball.value(p) < 0.0).collect();
        if self.is_inside(&inside) { -best } else { best }
    }
}

struct Circle {
    center: DVec3,
    axis: DVec3,
    radius: f64,
}

impl Circle {
    fn nearest(&self, p: DVec3) -> DVec3 {
        let way = p - self.center;
        let flat = way - self.axis * way.dot(self.axis);
        self.center + flat.normalize_or(self.axis.any_orthonormal_vector()) * self.radius
    }

    fn meets(&self, ball: &Ball) -> Vec<DVec3> {
        // On the circle at angle t from u: |c + r (u cos t + v sin t) - m|^2 = R^2.
        let (u, v) = self.axis.any_orthonormal_pair();
        let way = self.center - ball.center;
        let (a, b) = (2.0 * self.radius * way.dot(u), 2.0 * self.radius * way.dot(v));
        let c = ball.radius * ball.radius - way.length_squared() - self.radius * self.radius;
        let size = a.hypot(b);
        if !(size > 0.0 && c.abs() <= size) {
            return Vec::new();
        }
        let (middle, turn) = (b.atan2(a), (c / size).acos());
        [middle - turn, middle + turn].map(|t| self.center + (u * t.cos() + v * t.sin()) * self.radius).to_vec()
    }
}
