//! What is known between samples of a number that changes by no more than one moves, by samples that are far away.
//!
//! For every point q, F(p) <= F(q) + |p - q|: what a ball around q says that is filled as far as F(q) is negative. That is
//! convex in p, so that it lies below its interpolation, and so do means of such numbers, where two balls are as near. In the
//! same way from above, by balls that are empty. If the gradient leads straight to q, the bound is off by no more than the
//! square of the way aside over twice the way to q: far samples say how little the surface bends.

use crate::distance::{SampleBlock, Source};
use crate::error::Result;
use crate::geom::{Aabb, DVec3, Interval};
use crate::source::kink::{self, Operand, Seam};

/// How far away samples are taken, in radii of the cell.
const FAR: [f64; 3] = [2.0, 6.0, 18.0];

/// Where more is open than this part of the cell's radius, more is asked.
const OPEN: f64 = 0.1;

/// [`Source::residual`] of a shape whose values are its distances, but for its slack.
pub(crate) fn of_distance(source: &dyn Source, block: &SampleBlock<'_>, out: &mut [Interval]) -> Result<()> {
    let off = of_point(source, block, out);
    narrow(block, off, asked(source), out)?;
    if is_open(block, out) {
        of_bend(source, block, out);
    }
    Ok(())
}

/// What the distance to the samples says: off the surface a distance bends by no more than that of a point.
///
/// Returns how far values may be from distances.
pub(crate) fn of_point(source: &dyn Source, block: &SampleBlock<'_>, out: &mut [Interval]) -> f64 {
    let slack = source.slack(&block.cell);
    let off = slack.upper.max(-slack.lower);
    let nearest = block.values.iter().fold(f64::INFINITY, |nearest, value| nearest.min(value.abs()));
    let least = nearest - 0.5 * block.square.sqrt() * (1.0 + 1e-12) - off;
    let bend = if least > 0.0 {
        let of_point = Interval { lower: f64::NEG_INFINITY, upper: 1.0 / least };
        if block.values[0] > 0.0 { of_point } else { of_point.negated() }
    } else {
        Interval::ALL
    };
    let noise = source.noise_over(&block.cell);
    block.residual(block.between(bend, noise).widen(if least > 0.0 { 2.0 * off } else { 0.0 }), out);
    off
}

/// Narrows by how the source's values bend.
pub(crate) fn of_bend(source: &dyn Source, block: &SampleBlock<'_>, out: &mut [Interval]) {
    let mut bent = vec![Interval::ALL; out.len()];
    block.residual(block.between(source.bend(&block.cell), source.noise_over(&block.cell)), &mut bent);
    out.iter_mut().zip(bent).for_each(|(out, bent)| *out = out.intersection(bent));
}

/// Where a source is.
pub(crate) fn asked(source: &dyn Source) -> impl Fn(&[DVec3], &mut [Interval]) -> Result<()> {
    |points: &[DVec3], out: &mut [Interval]| {
        source.at_many(points, out);
        Ok(())
    }
}

/// Whether it is worth while to ask for more.
pub(crate) fn is_open(block: &SampleBlock<'_>, out: &[Interval]) -> bool {
    out.iter().any(|out| out.upper.max(-out.lower) > OPEN * block.cell.radius())
}

/// Narrows what contains a number minus what is said, for each box. `ask` answers where the number is at some points, and
/// the block's values are no farther from it than `off`.
pub(crate) fn narrow(
    block: &SampleBlock<'_>,
    off: f64,
    ask: impl Fn(&[DVec3], &mut [Interval]) -> Result<()>,
    out: &mut [Interval],
) -> Result<()> {
    if !(off < block.cell.radius()) {
        return Ok(());
    }
    far(block, off, &ask, out)?;
    if is_open(block, out) {
        feet(block, off, &ask, out)?;
    }
    Ok(())
}

/// [`narrow`] by balls whose centres lie far away to either side.
fn far(block: &SampleBlock<'_>, off: f64, ask: &impl Fn(&[DVec3], &mut [Interval]) -> Result<()>, out: &mut [Interval]) -> Result<()> {
    let (radius, center) = (block.cell.radius(), node(block, |n| n / 2));
    let slope = slope(block, center, |_| Side::Middle);
    if slope == DVec3::ZERO {
        return Ok(());
    }
    let ways = FAR.into_iter().flat_map(|far| [far * radius, -far * radius]);
    let far: Vec<DVec3> = ways.map(|way| block.points[center] + slope * way).collect();
    by_balls(block, off, &far, ask, out)
}

/// [`narrow`] by balls around where the surface seems nearest to the corners, if all samples are on one side.
///
/// Returns how far these are apart along each axis.
pub(crate) fn feet(
    block: &SampleBlock<'_>,
    off: f64,
    ask: &impl Fn(&[DVec3], &mut [Interval]) -> Result<()>,
    out: &mut [Interval],
) -> Result<Option<DVec3>> {
    if !block.values.iter().all(|value| (*value > 0.0) == (block.values[0] > 0.0)) {
        return Ok(None);
    }
    let corners = (0..8usize).filter(|corner| block.boxes[2] > 0 || corner & 4 == 0);
    let feet: Vec<DVec3> = corners
        .map(|corner| {
            let upper = |axis: usize| corner >> axis & 1 == 1;
            let at = node_at(block, |axis, n| if upper(axis) { n } else { 0 });
            let slope = slope(block, at, |axis| if upper(axis) { Side::Upper } else { Side::Lower });
            block.points[at] - slope * block.values[at]
        })
        .collect();
    by_balls(block, off, &feet, ask, out)?;
    Ok(Some(Aabb::around(feet).size()))
}

/// Balls around some points.
fn by_balls(
    block: &SampleBlock<'_>,
    off: f64,
    centers: &[DVec3],
    ask: &impl Fn(&[DVec3], &mut [Interval]) -> Result<()>,
    out: &mut [Interval],
) -> Result<()> {
    let mut there = vec![Interval::ALL; centers.len()];
    ask(centers, &mut there)?;
    let rounding = |q: DVec3| off + 16.0 * f64::EPSILON * q.abs().max(block.cell.max.abs()).max(block.cell.min.abs()).max_element();
    // What is known at the centre of each ball, and the sign with which the way from there counts.
    let operands = |end: &dyn Fn(&Interval) -> f64, sign: f64, between: Interval| -> Vec<Operand> {
        let known = centers.iter().zip(there.iter().map(end)).filter(|(q, end)| q.is_finite() && end.is_finite());
        let of = |(&q, end): (&DVec3, f64)| Operand {
            values: block.points.iter().map(|p| end + sign * (p.distance(q) + rounding(q))).collect(),
            between: vec![between; block.len()],
        };
        known.map(of).collect()
    };
    let filled = operands(&|there| there.upper, 1.0, Interval { lower: f64::NEG_INFINITY, upper: 0.0 });
    let mut empty = operands(&|there| there.lower, -1.0, Interval { lower: 0.0, upper: f64::INFINITY });
    kink::least(block, &filled, Seam::Sharp, out);
    kink::greatest(block, &mut empty, Seam::Sharp, out);
    Ok(())
}

/// Where a node lies along an axis.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Side {
    Lower,
    Middle,
    Upper,
}

/// The node whose place along each axis is some of the boxes there.
fn node_at(block: &SampleBlock<'_>, place: impl Fn(usize, usize) -> usize) -> usize {
    let [_, ny, nz] = block.boxes;
    let at = |axis: usize| place(axis, block.boxes[axis]);
    (at(0) * (ny + 1) + at(1)) * (nz + 1) + at(2)
}

fn node(block: &SampleBlock<'_>, place: impl Fn(usize) -> usize) -> usize {
    node_at(block, |_, n| place(n))
}

/// The direction in which samples grow at a node, looking into the block; zero where they do not.
fn slope(block: &SampleBlock<'_>, node: usize, side: impl Fn(usize) -> Side) -> DVec3 {
    let [_, ny, nz] = block.boxes;
    let strides = [(ny + 1) * (nz + 1), nz + 1, 1];
    let mut slope = DVec3::ZERO;
    for (axis, stride) in strides.into_iter().enumerate() {
        let boxes = block.boxes[axis];
        if boxes == 0 {
            continue;
        }
        let value = |at: usize| block.values[at];
        // To second order, where there are three nodes.
        let (along, change) = match side(axis) {
            Side::Middle if boxes > 1 => {
                (block.points[node + stride] - block.points[node - stride], value(node + stride) - value(node - stride))
            }
            Side::Upper => {
                let change = if boxes > 1 {
                    1.5 * value(node) - 2.0 * value(node - stride) + 0.5 * value(node - 2 * stride)
                } else {
                    value(node) - value(node - stride)
                };
                (block.points[node] - block.points[node - stride], change)
            }
            Side::Lower | Side::Middle => {
                let change = if boxes > 1 {
                    2.0 * value(node + stride) - 1.5 * value(node) - 0.5 * value(node + 2 * stride)
                } else {
                    value(node + stride) - value(node)
                };
                (block.points[node + stride] - block.points[node], change)
            }
        };
        slope += along * (change / along.length_squared());
    }
    slope.normalize_or_zero()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wall, of which nothing is known but its distances, is proven to be flat.
    #[test]
    fn far_samples_prove_walls_flat() {
        let cell = Aabb::new(DVec3::splat(-0.1), DVec3::splat(0.1));
        let normal = DVec3::new(1.0, 2.0, 3.0).normalize();
        let nodes: Vec<DVec3> = (0..27).map(|n| DVec3::new(f64::from(n / 9), f64::from(n / 3 % 3), f64::from(n % 3)) * 0.1 - 0.1).collect();
        let values: Vec<f64> = nodes.iter().map(|p| p.dot(normal)).collect();
        let block = SampleBlock { cell, points: &nodes, values: &values, said: &values, boxes: [2; 3], square: 0.03 };
        let mut out = vec![Interval::ALL; block.len()];
        let wall = |points: &[DVec3], out: &mut [Interval]| {
            out.iter_mut().zip(points).for_each(|(out, p)| *out = Interval::exact(p.dot(normal)));
            Ok(())
        };
        narrow(&block, 0.0, wall, &mut out).expect("bounds");
        let most = out.iter().map(|out| out.upper.max(-out.lower)).fold(0.0, f64::max);
        assert!(most < 0.5 * cell.radius() / FAR[2] * 1.01, "{most}");
    }
}
