//! Generalised winding numbers with a proven error.
//!
//! The winding number of a surface S around p is the solid angle of S over 4 pi (Jacobson, Kavan and
//! Sorkine-Hornung 2013). A triangle's is known in closed form (van Oosterom and Strackee 1983); a
//! group of triangles that is small for its distance is summed up by its first two moments (Barill et
//! al. 2018). Unlike there, what the moments leave out is bounded, so every answer is an interval:
//!
//! With r = c - p for the group's centre c, R = |r| and G(x) = -1 / |x - p|, the winding number is
//! `1/(4 pi) * integral of n . grad G(c + y) dA`. The k-th derivative of G along unit directions is at
//! most k! / R^(k+1) (its diagonal is a Legendre polynomial, and a symmetric form attains its norm
//! on the diagonal), so the k-th Taylor term of `n . grad G(c + y)` in y is at most
//! `(k+1)!/k! |y|^k / R^(k+2)`. The sum keeps k = 0 and 1. With |y| <= a, t = a / R < 1 and
//! `B = integral of |y|^2 dA`, the rest is at most
//!
//! `1/(4 pi) * B / R^4 * sum over k >= 2 of (k+1) t^(k-2) = B / (4 pi R^4) * (3 - 2t) / (1 - t)^2`.

use std::f64::consts::{FRAC_1_PI, FRAC_PI_2, FRAC_PI_4, PI};
use std::sync::{Mutex, PoisonError};

use crate::error::Result;
use crate::geom::{Aabb, DVec3};
use crate::run::Run;
use crate::simd::{Fuse, multiversion};

/// Children of a node and triangles of a leaf.
const WIDTH: usize = 8;

/// Marks a child that is a leaf.
const LEAF: u32 = 1 << 31;

/// Marks a child that is not there.
const ABSENT: u32 = u32::MAX;

/// Half an ulp of 1.
const UNIT: f64 = f64::EPSILON / 2.0;

/// Rounding of a triangle's numerator and denominator, relative to the product of the three
/// distances: fewer than 53 units by the count of operations.
const TRIANGLE_ROUNDING: f64 = 64.0 * UNIT;

/// Rounding of a group's value relative to area / (4 pi R^2), the moments' own included.
const MOMENT_ROUNDING: f64 = 1024.0 * UNIT;

/// Largest error of [`arctangent`].
const ARCTANGENT_ERROR: f64 = 3e-10;

/// A triangle is worth at most this, on either side.
const DOUBT: f64 = 0.5;

/// Errors of groups that are worth a place in the list: at first, and at last, when only the sum
/// over all triangles can decide. These and [`FIRST_TOLERANCE`] were tuned on scans of 80,000 triangles.
const FIRST_FLOOR: f64 = 1.0 / 64.0;
/// See [`FIRST_FLOOR`].
const LAST_FLOOR: f64 = 1e-12;

/// Error above which a group is taken apart in the first round.
const FIRST_TOLERANCE: f64 = 0.125;

type Lanes = [f64; WIDTH];

/// Moments of up to eight groups about their centres, already divided by 4 pi.
#[derive(Clone, Debug)]
#[repr(align(64))]
struct Node {
    center: [Lanes; 3],
    /// Radius of a ball around the centre that holds the group.
    radius: Lanes,
    /// Sum of area vectors.
    dipole: [Lanes; 3],
    /// Three times the symmetric traceless part of the integral of n y^T: xx, yy, zz, xy, xz, yz.
    moment: [Lanes; 6],
    /// Integral of |y|^2 over the area.
    spread: Lanes,
    /// Area times the part of it that rounding may spoil.
    rounding: Lanes,
    /// No group is worth more: half its number of triangles.
    most: Lanes,
    child: [u32; WIDTH],
}

/// Up to eight triangles in lanes; unused lanes repeat the last and count for nothing.
#[derive(Clone, Debug)]
#[repr(align(64))]
struct Packet {
    corners: [[Lanes; 3]; 3],
    count: usize,
}

/// A group not yet taken apart.
#[derive(Clone, Copy)]
struct Group {
    value: f64,
    error: f64,
    child: u32,
}

/// A value and the largest possible difference from the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Not below |value - truth|.
    pub error: f64,
    /// The part of `error` that no work removes: one half for each triangle so near that rounding
    /// hides which side of it the point is on.
    pub doubt: f64,
}

/// A tree of moments over triangles. Memory: about 250 bytes a triangle.
#[derive(Clone, Debug)]
pub struct Winding {
    nodes: Vec<Node>,
    packets: Vec<Packet>,
    count: usize,
}

/// What the builder knows about a group; not divided by 4 pi.
#[derive(Clone, Copy)]
struct Moments {
    center: DVec3,
    area: f64,
    dipole: DVec3,
    /// Rows of the integral of n y^T.
    first: [DVec3; 3],
    spread: f64,
}

impl Winding {
    /// Builds the tree over triangles given by their corners; a triangle given twice counts twice.
    /// None at all have the winding number 0 everywhere. O(n log n).
    pub fn build(triangles: &[[DVec3; 3]], run: &Run<'_>) -> Result<Self> {
        let mut order: Vec<u32> = (0..triangles.len() as u32).collect();
        let middles: Vec<DVec3> = triangles.iter().map(middle).collect();
        let parts: Vec<Mutex<&mut [u32]>> = divide(&mut order, &middles).into_iter().map(Mutex::new).collect();
        // The children of the root side by side.
        let children = run.blocks("winding numbers", parts.len(), |index| {
            let mut part = parts[index].lock().unwrap_or_else(PoisonError::into_inner);
            let mut builder = Builder { triangles, middles: &middles, nodes: Vec::new(), packets: Vec::new() };
            let (child, moments) = builder.child(&mut part, run)?;
            Ok((child, moments, builder.radius(&part, &moments), part.len(), builder.nodes, builder.packets))
        })?;
        let mut whole = Self { nodes: vec![Node::EMPTY], packets: Vec::new(), count: triangles.len() };
        for (lane, (child, moments, radius, count, nodes, packets)) in children.into_iter().enumerate() {
            let (first, leaf) = (whole.nodes.len() as u32, whole.packets.len() as u32);
            let moved = |child: u32| match child {
                ABSENT => ABSENT,
                packet if packet & LEAF != 0 => packet + leaf,
                node => node + first,
            };
            whole.nodes[0].set(lane, moved(child), &moments, radius, count);
            whole.nodes.extend(nodes.into_iter().map(|node| Node { child: node.child.map(moved), ..node }));
            whole.packets.extend(packets);
        }
        Ok(whole)
    }

    /// The winding number around `p`, to within `accuracy` where rounding allows it; the error is
    /// what was reached. 0 as accuracy asks for all that f64 can give, in O(n) time.
    pub fn number(&self, p: DVec3, accuracy: f64) -> Estimate {
        self.refine(p, |e| e.error <= accuracy)
    }

    /// Takes groups apart, the most doubtful first, until `enough` or until only single triangles are left.
    pub fn refine(&self, p: DVec3, enough: impl Fn(Estimate) -> bool) -> Estimate {
        // Groups of less error are not even listed at first: they seldom have to be taken apart.
        let mut floor = FIRST_FLOOR;
        let mut groups: Vec<Group> = Vec::with_capacity(128);
        while floor >= LAST_FLOOR {
            groups.clear();
            let (estimate, done) = self.descend(p, &enough, floor, &mut groups);
            if done {
                return estimate;
            }
            floor *= 1.0 / 64.0;
        }
        self.exact(p)
    }

    /// Takes groups of an error above `floor` apart; whether that was `enough`.
    fn descend(&self, p: DVec3, enough: impl Fn(Estimate) -> bool, floor: f64, groups: &mut Vec<Group>) -> (Estimate, bool) {
        // Sums kept up to date by differences drift by at most this.
        let drift = (self.count + WIDTH) as f64 * (64.0 * UNIT);
        let most = 0.5 * self.count as f64;
        // No triangles, no error: nothing to take apart.
        if most > floor {
            groups.push(Group { value: 0.0, error: most, child: 0 });
        }
        let mut total = Estimate { value: 0.0, error: most, doubt: 0.0 };
        let mut tolerance = FIRST_TOLERANCE;
        let mut lanes = Values { value: [0.0; WIDTH], error: [0.0; WIDTH] };
        while !groups.is_empty() {
            let mut index = 0;
            while index < groups.len() {
                let group = groups[index];
                if group.error <= tolerance {
                    index += 1;
                    continue;
                }
                groups.swap_remove(index);
                let leaf = group.child & LEAF != 0;
                if leaf {
                    packet_values(&self.packets[(group.child & !LEAF) as usize], p, &mut lanes);
                } else {
                    node_values(&self.nodes[group.child as usize], p, &mut lanes);
                }
                total.value += lanes.value.iter().sum::<f64>() - group.value;
                total.error += lanes.error.iter().sum::<f64>() - group.error;
                let lanes = lanes.value.iter().zip(lanes.error);
                if leaf {
                    // Single triangles: taken for good.
                    total.doubt += lanes.map(|(_, error)| if error == DOUBT { DOUBT } else { 0.0 }).sum::<f64>();
                } else {
                    let children = self.nodes[group.child as usize].child;
                    for ((&value, error), child) in lanes.zip(children) {
                        if error > floor {
                            groups.push(Group { value, error, child });
                        }
                    }
                }
                let widened = Estimate { error: total.error + drift, ..total };
                if enough(widened) {
                    return (widened, true);
                }
            }
            tolerance = if tolerance > floor { (tolerance * 0.25).max(floor) } else { 0.0 };
        }
        (total, false)
    }

    /// The sum over all triangles, with rounding the only error.
    pub fn exact(&self, p: DVec3) -> Estimate {
        let mut total = Estimate { value: 0.0, error: 0.0, doubt: 0.0 };
        let mut compensation = 0.0;
        for packet in &self.packets {
            for lane in 0..packet.count {
                let corners = std::array::from_fn(|k| DVec3::from_array(std::array::from_fn(|axis| packet.corners[k][axis][lane])));
                let one = triangle(&corners, p);
                // Neumaier's sum: its rounding stays below that of one term.
                let sum = total.value + one.value;
                compensation +=
                    if total.value.abs() >= one.value.abs() { (total.value - sum) + one.value } else { (one.value - sum) + total.value };
                total.value = sum;
                total.error += one.error;
                total.doubt += one.doubt;
            }
        }
        let value = total.value + compensation;
        Estimate { value, error: total.error * (1.0 + 1e-9) + 4.0 * UNIT * value.abs(), doubt: total.doubt }
    }
}

/// The winding number of one triangle around `p`: its solid angle over 4 pi.
pub fn triangle(corners: &[DVec3; 3], p: DVec3) -> Estimate {
    let [a, b, c] = corners.map(|v| v - p);
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let lengths = la * lb * lc;
    let numerator = a.dot(b.cross(c));
    let denominator = lengths + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    // As in lanes, so that both doubt the same triangles.
    let size = (numerator * numerator + denominator * denominator).sqrt();
    let noise = TRIANGLE_ROUNDING * lengths;
    // Too near a corner or an edge, or in the plane of the triangle: either side.
    if size <= 8.0 * noise || lengths < 1e-130 || (denominator < 8.0 * noise && numerator.abs() <= noise) {
        return Estimate { value: 0.0, error: DOUBT, doubt: DOUBT };
    }
    // An arctangent turns by at most 1.01 * noise / size here.
    Estimate { value: numerator.atan2(denominator) * (0.5 * FRAC_1_PI), error: 0.17 * noise / size + 4.0 * UNIT, doubt: 0.0 }
}

struct Values {
    value: Lanes,
    error: Lanes,
}

multiversion!(fn node_values(node: &Node, p: DVec3, out: &mut Values) = node_values_body);
multiversion!(fn packet_values(packet: &Packet, p: DVec3, out: &mut Values) = packet_values_body);

#[inline(always)]
fn node_values_body<F: Fuse>(node: &Node, p: DVec3, out: &mut Values) {
    for lane in 0..WIDTH {
        let (x, y, z) = (node.center[0][lane] - p.x, node.center[1][lane] - p.y, node.center[2][lane] - p.z);
        let squared = x * x + y * y + z * z;
        let inverse = 1.0 / squared;
        let reciprocal = inverse.sqrt();
        let flux = node.dipole[0][lane] * x + node.dipole[1][lane] * y + node.dipole[2][lane] * z;
        let [xx, yy, zz, xy, xz, yz] = std::array::from_fn(|k| node.moment[k][lane]);
        let bent = x * (xx * x + 2.0 * (xy * y + xz * z)) + y * (yy * y + 2.0 * yz * z) + zz * z * z;
        let value = (flux - bent * inverse) * (inverse * reciprocal);
        let t = node.radius[lane] * reciprocal;
        let gap = 1.0 - t;
        let rest = node.spread[lane] * inverse * inverse * (3.0 - 2.0 * t) / (gap * gap);
        let error = rest * 1.000_001 + node.rounding[lane] * inverse;
        let most = node.most[lane];
        let holds = (t < 0.95) & (error < most);
        out.value[lane] = if holds { value } else { 0.0 };
        out.error[lane] = if holds { error } else { most };
    }
}

/// As [`triangle`], in lanes and with a quicker arctangent.
#[inline(always)]
fn packet_values_body<F: Fuse>(packet: &Packet, p: DVec3, out: &mut Values) {
    let p = p.to_array();
    for lane in 0..WIDTH {
        let [a, b, c]: [[f64; 3]; 3] = std::array::from_fn(|k| std::array::from_fn(|axis| packet.corners[k][axis][lane] - p[axis]));
        let dot = |u: &[f64; 3], v: &[f64; 3]| u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
        let (la, lb, lc) = (dot(&a, &a).sqrt(), dot(&b, &b).sqrt(), dot(&c, &c).sqrt());
        let lengths = la * lb * lc;
        let cross = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
        let numerator = dot(&a, &cross);
        let denominator = lengths + dot(&a, &b) * lc + dot(&b, &c) * la + dot(&c, &a) * lb;
        let size = (numerator * numerator + denominator * denominator).sqrt();
        let noise = TRIANGLE_ROUNDING * lengths;
        let doubtful = (size <= 8.0 * noise) | (lengths < 1e-130) | ((denominator < 8.0 * noise) & (numerator.abs() <= noise));
        let value = arctangent(numerator, denominator) * (0.5 * FRAC_1_PI);
        let error = 0.17 * noise / size + (0.16 * ARCTANGENT_ERROR + 4.0 * UNIT);
        let there = lane < packet.count;
        out.value[lane] = if there & !doubtful { value } else { 0.0 };
        out.error[lane] = if there { if doubtful { DOUBT } else { error } } else { 0.0 };
    }
}

/// atan2(y, x) within [`ARCTANGENT_ERROR`], without branches; (y, x) must not be (0, 0).
#[inline(always)]
fn arctangent(y: f64, x: f64) -> f64 {
    let (ax, ay) = (x.abs(), y.abs());
    let (low, high) = (ax.min(ay), ax.max(ay));
    // Beyond tan(pi/8), turn by pi/4.
    let far = low > high * 0.414_213_562_373_095;
    let ratio = if far { (low - high) / (low + high) } else { low / high };
    let s = ratio * ratio;
    // Taylor series of atan(z)/z; it alternates, and the first term left out is below 0.4143^23 / 23 < 8e-11.
    let series = 1.0
        - s * (1.0 / 3.0
            - s * (1.0 / 5.0
                - s * (1.0 / 7.0
                    - s * (1.0 / 9.0
                        - s * (1.0 / 11.0
                            - s * (1.0 / 13.0 - s * (1.0 / 15.0 - s * (1.0 / 17.0 - s * (1.0 / 19.0 - s * (1.0 / 21.0))))))))));
    let angle = ratio * series + if far { FRAC_PI_4 } else { 0.0 };
    let angle = if ay > ax { FRAC_PI_2 - angle } else { angle };
    let angle = if x < 0.0 { PI - angle } else { angle };
    if y < 0.0 { -angle } else { angle }
}

struct Builder<'a> {
    triangles: &'a [[DVec3; 3]],
    middles: &'a [DVec3],
    nodes: Vec<Node>,
    packets: Vec<Packet>,
}

impl Builder<'_> {
    /// Adds the node or leaf over the triangles of `order` and returns its name and moments.
    fn child(&mut self, order: &mut [u32], run: &Run<'_>) -> Result<(u32, Moments)> {
        if order.len() <= WIDTH {
            return Ok(self.packet(order));
        }
        if order.len() > 4096 {
            run.cancel.check()?;
        }
        let index = self.nodes.len();
        self.nodes.push(Node::EMPTY);
        let mut all = Vec::with_capacity(WIDTH);
        for (lane, part) in divide(order, self.middles).into_iter().enumerate() {
            let (child, moments) = self.child(part, run)?;
            let radius = self.radius(part, &moments);
            self.nodes[index].set(lane, child, &moments, radius, part.len());
            all.push(moments);
        }
        Ok((index as u32, Moments::sum(&all)))
    }

    /// Radius of the ball around the centre of some triangles that holds them.
    fn radius(&self, part: &[u32], moments: &Moments) -> f64 {
        let corners = part.iter().flat_map(|&t| self.triangles[t as usize]);
        corners.map(|v| (v - moments.center).length_squared()).fold(0.0, f64::max).sqrt()
    }

    fn packet(&mut self, order: &[u32]) -> (u32, Moments) {
        let mut packet = Packet { corners: [[[0.0; WIDTH]; 3]; 3], count: order.len() };
        let mut all = Vec::with_capacity(WIDTH);
        for lane in 0..WIDTH {
            let corners = self.triangles[order[lane.min(order.len() - 1)] as usize];
            for (k, corner) in corners.iter().enumerate() {
                for axis in 0..3 {
                    packet.corners[k][axis][lane] = corner[axis];
                }
            }
            if lane < order.len() {
                all.push(Moments::of(&corners));
            }
        }
        self.packets.push(packet);
        (LEAF | (self.packets.len() - 1) as u32, Moments::sum(&all))
    }
}

/// Up to eight parts of even size, none empty.
fn divide<'o>(order: &'o mut [u32], middles: &[DVec3]) -> Vec<&'o mut [u32]> {
    let mut parts = vec![order];
    while parts.len() < WIDTH {
        let largest = (0..parts.len()).rev().max_by_key(|&i| parts[i].len()).filter(|&i| parts[i].len() > WIDTH);
        let Some(largest) = largest else { break };
        let (left, right) = halve(parts.swap_remove(largest), middles);
        parts.push(left);
        parts.push(right);
    }
    parts.retain(|part| !part.is_empty());
    parts
}

/// Halves by count along the longest axis.
fn halve<'o>(order: &'o mut [u32], middles: &[DVec3]) -> (&'o mut [u32], &'o mut [u32]) {
    let size = Aabb::around(order.iter().map(|&t| middles[t as usize])).size();
    let axis = if size.x >= size.y.max(size.z) {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    };
    let half = (order.len() / 2).next_multiple_of(WIDTH).min(order.len() - 1);
    order.select_nth_unstable_by(half, |&a, &b| middles[a as usize][axis].total_cmp(&middles[b as usize][axis]).then(a.cmp(&b)));
    order.split_at_mut(half)
}

impl Node {
    const EMPTY: Self = Self {
        center: [[0.0; WIDTH]; 3],
        radius: [0.0; WIDTH],
        dipole: [[0.0; WIDTH]; 3],
        moment: [[0.0; WIDTH]; 6],
        spread: [0.0; WIDTH],
        rounding: [0.0; WIDTH],
        most: [0.0; WIDTH],
        child: [ABSENT; WIDTH],
    };

    fn set(&mut self, lane: usize, child: u32, m: &Moments, radius: f64, count: usize) {
        const SHARE: f64 = 0.25 * FRAC_1_PI;
        for axis in 0..3 {
            self.center[axis][lane] = m.center[axis];
            self.dipole[axis][lane] = m.dipole[axis] * SHARE;
        }
        let trace = (m.first[0].x + m.first[1].y + m.first[2].z) / 3.0;
        let half = |i: usize, j: usize| 0.5 * (m.first[i][j] + m.first[j][i]);
        let parts = [m.first[0].x - trace, m.first[1].y - trace, m.first[2].z - trace, half(0, 1), half(0, 2), half(1, 2)];
        for (k, part) in parts.into_iter().enumerate() {
            self.moment[k][lane] = part * (3.0 * SHARE);
        }
        self.radius[lane] = radius * (1.0 + 1e-12);
        self.spread[lane] = m.spread * SHARE * (1.0 + 1e-9);
        self.rounding[lane] = m.area * SHARE * (4.0 * MOMENT_ROUNDING);
        self.most[lane] = 0.5 * count as f64;
        self.child[lane] = child;
    }
}

impl Moments {
    fn of(corners: &[DVec3; 3]) -> Self {
        let [a, b, c] = *corners;
        let (ab, ac, bc) = (b - a, c - a, c - b);
        let dipole = ab.cross(ac) * 0.5;
        // For slivers the cross product may be mostly rounding; the area then bounds that rounding.
        let area = dipole.length() + 4.0 * UNIT * ab.length() * ac.length();
        let center = middle(corners);
        let off = (a - center) + (b - center) + (c - center);
        // The centre's own rounding is in the first moment.
        let first = std::array::from_fn(|i| off * (dipole[i] / 3.0));
        let spread = area * ((ab.length_squared() + ac.length_squared() + bc.length_squared()) / 36.0 + off.length_squared() / 9.0);
        Self { center, area, dipole, first, spread }
    }

    fn sum(parts: &[Self]) -> Self {
        let area: f64 = parts.iter().map(|m| m.area).sum();
        let base = parts.first().map_or(DVec3::ZERO, |m| m.center);
        // Where nothing has an area any centre serves.
        let weight = |m: &Self| if area > 0.0 { m.area / area } else { 0.0 };
        let center = base + parts.iter().map(|m| (m.center - base) * weight(m)).sum::<DVec3>();
        let mut sum = Self { center, area, dipole: DVec3::ZERO, first: [DVec3::ZERO; 3], spread: 0.0 };
        for m in parts {
            let shift = m.center - center;
            sum.dipole += m.dipole;
            for axis in 0..3 {
                sum.first[axis] += m.first[axis] + shift * m.dipole[axis];
            }
            // |y + shift| <= |y| + |shift|; the mixed term vanishes up to the rounding of the centres.
            let off = m.center.abs().max_element() * (16.0 * UNIT);
            sum.spread += m.spread + m.area * shift.length() * (shift.length() + 2.0 * off);
        }
        sum
    }
}

fn middle(corners: &[DVec3; 3]) -> DVec3 {
    let [a, b, c] = *corners;
    a + ((b - a) + (c - a)) / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn random(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        }
    }

    /// Triangles of all shapes and sizes: clusters, slivers, points, far from the origin too.
    fn soup(seed: u64, count: usize, offset: f64) -> Vec<[DVec3; 3]> {
        let mut r = random(seed);
        let mut any = move |size: f64| DVec3::new(r() - 0.5, r() - 0.5, r() - 0.5) * size;
        (0..count)
            .map(|i| {
                let at = any(2.0) + DVec3::splat(offset);
                let size = 10f64.powf(f64::from(i as u32 % 5) - 4.0);
                let (u, v) = (any(size), any(size));
                match i % 7 {
                    0 => [at, at + u, at + u * 0.5 + v * 1e-6],
                    1 => [at, at, at],
                    2 => [at, at + u, at + u * 3.0],
                    _ => [at, at + u, at + v],
                }
            })
            .collect()
    }

    fn near(triangles: &[[DVec3; 3]], r: &mut impl FnMut() -> f64) -> DVec3 {
        let [a, b, c] = triangles[(r() * triangles.len() as f64) as usize];
        let away = DVec3::new(r() - 0.5, r() - 0.5, r() - 0.5) * 10f64.powf(2.0 - 18.0 * r());
        let (s, t) = (r() * 1.2, r() * 1.2);
        a + (b - a) * s + (c - a) * t + away
    }

    #[test]
    fn whatever_the_moments_leave_out_is_within_the_error() {
        for (seed, count, offset) in [(1, 1, 0.0), (2, 8, 0.0), (3, 9, 0.0), (4, 700, 0.0), (5, 700, 1e5), (6, 3000, 3.0)] {
            let triangles = soup(seed, count, offset);
            let winding = Winding::build(&triangles, &Run::default()).expect("a tree");
            let mut r = random(seed + 100);
            let tries = 1_000_000 / (count + 400);
            let mut sharp = 0;
            for index in 0..tries {
                let p = near(&triangles, &mut r);
                let exact = winding.exact(p);
                sharp += usize::from(exact.error < 1e-9);
                let accuracy = 10f64.powf(1.0 - 8.0 * r());
                let quick = winding.number(p, accuracy);
                assert!(quick.error <= accuracy || quick.error <= exact.error, "{index}: {p} {quick:?} {exact:?} for {accuracy}");
                assert!((quick.value - exact.value).abs() <= quick.error + exact.error, "{index}: {p} {quick:?} {exact:?}");
                // Every group that refinement passes through encloses the truth too.
                let first = winding.refine(p, |_| true);
                assert!((first.value - exact.value).abs() <= first.error + exact.error, "{index}: {p} {first:?} {exact:?}");
            }
            assert!(sharp > tries / 2, "{sharp} of {tries}");
        }
    }

    #[test]
    fn groups_hold_their_bound_one_by_one() {
        // Node by node, against the sum over its own triangles: sharper than any total.
        let triangles = soup(8, 640, 0.0);
        let winding = Winding::build(&triangles, &Run::default()).expect("a tree");
        let mut r = random(9);
        let (mut held, mut sharpest) = (0, 0.0f64);
        for node in &winding.nodes {
            for _ in 0..500 {
                let p = DVec3::new(r() - 0.5, r() - 0.5, r() - 0.5) * 10f64.powf(3.0 * r());
                let mut lanes = Values { value: [0.0; WIDTH], error: [0.0; WIDTH] };
                node_values(node, p, &mut lanes);
                for lane in (0..WIDTH).filter(|&lane| node.child[lane] & LEAF != 0 && node.child[lane] != ABSENT) {
                    let packet = &winding.packets[(node.child[lane] & !LEAF) as usize];
                    let (mut sum, mut error) = (0.0, 0.0);
                    for k in 0..packet.count {
                        let corners = std::array::from_fn(|i| DVec3::from_array(std::array::from_fn(|axis| packet.corners[i][axis][k])));
                        let one = triangle(&corners, p);
                        (sum, error) = (sum + one.value, error + one.error);
                    }
                    let off = (lanes.value[lane] - sum).abs();
                    assert!(off <= lanes.error[lane] + error, "{p}: {off} > {} + {error}", lanes.error[lane]);
                    if lanes.error[lane] < node.most[lane] {
                        held += 1;
                        sharpest = sharpest.max((off - error) / lanes.error[lane]);
                    }
                }
            }
        }
        // The bound is not idle either.
        assert!(held > 10_000 && sharpest > 0.05, "{held} {sharpest}");
    }

    #[test]
    fn single_triangles_in_lanes_and_alone() {
        let triangles = soup(11, 8, 0.0);
        let winding = Winding::build(&triangles, &Run::default()).expect("a tree");
        let mut r = random(12);
        for _ in 0..200_000 {
            let p = near(&triangles, &mut r);
            let mut lanes = Values { value: [0.0; WIDTH], error: [0.0; WIDTH] };
            packet_values(&winding.packets[0], p, &mut lanes);
            for lane in 0..WIDTH {
                let packet = &winding.packets[0];
                let corners = std::array::from_fn(|i| DVec3::from_array(std::array::from_fn(|axis| packet.corners[i][axis][lane])));
                let one = triangle(&corners, p);
                assert!((one.value - lanes.value[lane]).abs() <= lanes.error[lane] + one.error, "{p} {one:?}");
            }
        }
        for _ in 0..1_000_000 {
            let (y, x) = ((r() - 0.5) * 10f64.powf(20.0 * r() - 10.0), r() - 0.5);
            assert!((arctangent(y, x) - y.atan2(x)).abs() <= ARCTANGENT_ERROR, "{y} {x}");
        }
        for (y, x) in [(0.0, 1.0), (0.0, -1.0), (1.0, 0.0), (-1.0, 0.0), (1.0, 1.0), (-1.0, -1.0), (1e-300, 1e-300)] {
            assert!((arctangent(y, x) - f64::atan2(y, x)).abs() <= ARCTANGENT_ERROR, "{y} {x}");
        }
    }

    #[test]
    fn a_solid_angle_is_known_where_symmetry_says_so() {
        // Half a face of a cube: a twelfth from the middle; a 48th from the opposite corner, where three faces fill an eighth.
        let face = [DVec3::new(-1.0, -1.0, 1.0), DVec3::new(1.0, -1.0, 1.0), DVec3::new(1.0, 1.0, 1.0)];
        let one = triangle(&face, DVec3::ZERO);
        assert!((one.value - 1.0 / 12.0).abs() <= one.error && one.error < 1e-13, "{one:?}");
        let corner = triangle(&face, DVec3::new(-1.0, -1.0, -1.0));
        assert!((corner.value - 1.0 / 48.0).abs() <= corner.error, "{corner:?}");
        // In the plane beside it: nothing, and certain. In the plane on it: doubt.
        assert!(triangle(&face, DVec3::new(3.0, 0.0, 1.0)).error < 1e-13);
        assert_eq!(triangle(&face, DVec3::new(0.5, 0.0, 1.0)).doubt, 0.5);
        assert_eq!(Winding::build(&[], &Run::default()).expect("a tree").number(DVec3::ONE, 0.0).value, 0.0);
    }
}
