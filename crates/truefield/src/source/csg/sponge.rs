//! The Menger sponge.

use crate::error::{Error, Result};
use crate::geom::{Aabb, DVec3, Interval};

use super::exact::Exact;
use super::measure::length;

/// Level n of the Menger sponge: a cube around the origin, drilled through n times, each time a third as wide.
///
/// A point is in it if at no level two of its coordinates, written to base three, have the digit 1. So what was removed is
/// one periodic family of square bars for each level and axis, which go on through everything, and the depth is the least
/// of the ways to them: exact. Outside, mirrors keep nearest points on the point's own side, where two of the twenty parts are left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sponge {
    /// Half the edge of the cube.
    half: f64,
    level: u32,
}

/// Holes of the finest level are this part of the cube.
const FINEST: u32 = 16;

impl Sponge {
    /// Level 0 is the cube of edge `size`.
    pub fn new(level: u32, size: f64) -> Result<Self> {
        if level > FINEST {
            return Err(Error::invalid(format!(
                "level is {level}; give 0 to {FINEST}: beyond, holes are narrower than 3e-8 of the sponge"
            )));
        }
        Ok(Self { half: 0.5 * length("size", size)?, level })
    }

    /// The nearest removed point: the way to it, or 0.
    fn depth(&self, p: DVec3) -> (f64, DVec3) {
        let outer = self.half - p.abs();
        let axis = outer.min_position();
        let mut best = (outer[axis].max(0.0), DVec3::AXES[axis] * 1f64.copysign(p[axis]));
        let mut period = 2.0 * self.half;
        for _ in 0..self.level {
            let away = self.away(p, period);
            let beyond = (away.abs() - period / 6.0).max(DVec3::ZERO);
            for along in 0..3 {
                let mut across = beyond;
                across[along] = 0.0;
                let way = across.length();
                if way < best.0 {
                    // On a wall, out of it.
                    let toward = across.try_normalize().unwrap_or_else(|| {
                        let mut walls = away.abs();
                        walls[along] = 0.0;
                        DVec3::AXES[walls.max_position()]
                    });
                    best = (way, -toward * DVec3::ONE.copysign(away));
                }
            }
            period /= 3.0;
        }
        best
    }

    /// The nearest point of the sponge of a level, in a cube of half edge `half` around the origin: squared distance, if
    /// it is less than `best`, and that point.
    fn nearest(p: DVec3, half: f64, level: u32, best: &mut f64) -> Option<DVec3> {
        // All mirrors of the cube: nearest points lie on the point's own side of each.
        let sides = DVec3::ONE.copysign(p);
        let folded = p.abs();
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| folded[b].total_cmp(&folded[a]));
        let q = DVec3::from_array(order.map(|axis| folded[axis]));
        let unfold = |found: DVec3| {
            let mut back = DVec3::ZERO;
            for (place, axis) in order.into_iter().enumerate() {
                back[axis] = found[place];
            }
            back * sides
        };
        let box_squared = (q - half).max(DVec3::ZERO).length_squared();
        if box_squared >= *best {
            return None;
        }
        if level == 0 {
            *best = box_squared;
            return Some(unfold(q.min(DVec3::splat(half))));
        }
        // The corner and the edge between corners; the nearer one first.
        let third = half / 3.0;
        let mut centers = [DVec3::splat(2.0 * third), DVec3::new(2.0 * third, 2.0 * third, 0.0)];
        let way = |center: DVec3| ((q - center).abs() - third).max(DVec3::ZERO).length_squared();
        if way(centers[1]) < way(centers[0]) {
            centers.swap(0, 1);
        }
        let mut found = None;
        for center in centers {
            found = Self::nearest(q - center, third, level - 1, best).map(|near| near + center).or(found);
        }
        found.map(unfold)
    }

    /// Distance and nearest point of the surface, or the way out.
    fn ask(&self, p: DVec3) -> (f64, DVec3) {
        let (depth, out) = self.depth(p);
        let outside = (p.abs() - self.half).max_element();
        if depth > 0.0 && outside < 0.0 {
            return (-depth, out);
        }
        let mut best = f64::INFINITY;
        let foot = Self::nearest(p, self.half, self.level, &mut best).unwrap_or(p);
        (best.sqrt(), (p - foot).normalize_or(out))
    }

    /// From the middle of the nearest bar of a period, across each axis.
    fn away(&self, p: DVec3, period: f64) -> DVec3 {
        let turns = (p + self.half) / period;
        p + self.half - (turns.floor() + 0.5) * period
    }

    /// Whether the distance is that of one plane all over the cell, `way` from its middle to the foot along an axis.
    ///
    /// The plane is a wall of bars, or of the cube, as wide as the cell. Before it, nothing of the sponge may be nearer: the
    /// other walls of the widest bar are not. Behind it, no other hole.
    fn is_flat(&self, cell: &Aabb, value: f64, out: DVec3) -> bool {
        let axis = out.abs().max_position();
        if out[axis].abs() < 1.0 - 1e-12 {
            return false;
        }
        let (center, half, sign) = (cell.center(), 0.5 * cell.size(), out[axis].signum());
        let foot = center - out * value;
        let round = 1e-12 * self.half;
        let (above, below) = ((value + half[axis]).max(0.0), (half[axis] - value).max(0.0));
        // From the foot, where the cell reaches across the plane, and else from the middle of the cell.
        let behind = foot - out * round;
        let (from, clear) = if above > 0.0 {
            (behind, (half.length_squared() - half[axis] * half[axis]).max(0.0).sqrt() + 2.0 * below)
        } else {
            (center, half.length() + below)
        };
        let (mut free, mut other): (f64, f64) = (-1.0, f64::INFINITY);
        for face in 0..3 {
            for side in [-1.0, 1.0] {
                let way = self.half - side * from[face];
                if face == axis && side == sign && (self.half - side * foot[face]).abs() <= round {
                    free = f64::INFINITY;
                } else {
                    other = other.min(way);
                }
            }
        }
        let mut period = 2.0 * self.half;
        for _ in 0..self.level {
            let width = period / 3.0;
            let (away, aside) = (self.away(behind, period), self.away(from, period));
            for along in 0..3 {
                // The axis that is neither the plane's nor the bar's.
                let across = (0..3).find(|&other| other != axis && other != along).unwrap_or(axis);
                let wall = along != axis && (-sign * away[axis] - 0.5 * width).abs() <= 4.0 * round;
                let level = away[across].abs() + half[across] <= 0.5 * width;
                if wall && level {
                    let side = 0.5 * width - away[across].abs() - half[across];
                    free = free.max(side.min(width - above));
                    other = other.min(2.0 * width - value.abs());
                } else {
                    let mut beyond = (aside.abs() - 0.5 * width).max(DVec3::ZERO);
                    beyond[along] = 0.0;
                    other = other.min(beyond.length());
                }
            }
            period = width;
        }
        free >= above && other >= clear + 8.0 * round
    }
}

impl Exact for Sponge {
    fn hull(&self) -> Option<Aabb> {
        let half = DVec3::splat(self.half);
        Some(Aabb::new(-half, half))
    }

    fn value(&self, p: DVec3) -> f64 {
        self.ask(p).0
    }

    fn slope(&self, p: DVec3) -> DVec3 {
        self.ask(p).1
    }

    /// Nothing where one wall is nearest all over the cell; else the way to sets of points: ridges between them outside,
    /// valleys inside, and circles around each.
    fn curving(&self, cell: &Aabb) -> Interval {
        let (value, out) = self.ask(cell.center());
        if self.is_flat(cell, value, out) {
            return Interval::exact(0.0);
        }
        let least = value.abs() - cell.radius() * (1.0 + 1e-9);
        if !(least > 0.0) {
            return Interval::ALL;
        }
        let most = (1.0 + 1e-9) / least;
        if value < 0.0 { Interval { lower: -most, upper: f64::INFINITY } } else { Interval { lower: f64::NEG_INFINITY, upper: most } }
    }
}
