//! Crossings asked of the shape itself: interpolation rounds edges off that the shape has.

use super::crossing::Crossing;
use super::skeleton::Leaf;
use crate::distance::Source;
use crate::error::Result;
use crate::geom::DVec3;
use crate::run::Run;

/// Rounds that find the crossing on an edge.
const ROUNDS: usize = 16;

/// Crossings that a worker takes at a time.
const CHUNK: usize = 1024;

/// Moves crossings to where the shape is at the distance, with the shape's own gradients; `size` is that of a large leaf.
pub(super) fn sharpen(
    crossings: &mut [Crossing],
    leaves: &[Leaf<'_>],
    size: f64,
    shape: &dyn Source,
    distance: f64,
    run: &Run<'_>,
) -> Result<()> {
    let own = |crossing: &Crossing| crossing.leaves.map(|leaf| &leaves[leaf as usize]).into_iter().max_by_key(|leaf| leaf.cell.depth());
    // What is closed at the border of the domain is not the shape's.
    let wanted = |e: &usize| own(&crossings[*e]).is_some_and(|leaf| !leaf.on_border);
    let list: Vec<usize> = (0..crossings.len()).filter(wanted).collect();
    // No nearer than the shape's own values tell apart.
    let close = (1e-12 * size).max(shape.noise().min(1e-9 * size));
    let found = run.blocks("ask the shape", list.len().div_ceil(CHUNK), |chunk| {
        let list = &list[chunk * CHUNK..((chunk + 1) * CHUNK).min(list.len())];
        // From inside to outside, with what is known there.
        let mut ends = Vec::with_capacity(list.len());
        for &e in list {
            let crossing = &crossings[e];
            let Some(leaf) = own(crossing) else { continue };
            let (extent, axis) = (leaf.extent(), crossing.axis as usize);
            let (mut inside, mut outside) = (crossing.point, crossing.point);
            (inside[axis], outside[axis]) =
                if crossing.rising { (extent.min[axis], extent.max[axis]) } else { (extent.max[axis], extent.min[axis]) };
            ends.push((inside, outside));
        }
        let ask = |points: &[DVec3]| {
            let mut values = vec![0.0; points.len()];
            shape.values(points, &mut values)?;
            Ok(values)
        };
        let low = ask(&ends.iter().map(|ends| ends.0).collect::<Vec<_>>())?;
        let high = ask(&ends.iter().map(|ends| ends.1).collect::<Vec<_>>())?;
        let mut parts: Vec<[f64; 4]> = low.iter().zip(&high).map(|(low, high)| [0.0, low - distance, 1.0, high - distance]).collect();
        let at = |[a, low, b, high]: [f64; 4], round: usize| {
            // Halving after each secant keeps both ends moving.
            let secant = if round.is_multiple_of(2) { a + (b - a) * (low / (low - high)) } else { 0.5 * (a + b) };
            if secant > a && secant < b { secant } else { 0.5 * (a + b) }
        };
        let far = |[_, low, _, high]: &[f64; 4]| low.abs().min(high.abs()) > close;
        let mut open: Vec<usize> = (0..parts.len()).filter(|&i| far(&parts[i])).collect();
        for round in 0..ROUNDS {
            if open.is_empty() {
                break;
            }
            let way = |&i: &usize| ends[i].0 + (ends[i].1 - ends[i].0) * at(parts[i], round);
            let values = ask(&open.iter().map(way).collect::<Vec<_>>())?;
            for (&i, value) in open.iter().zip(values) {
                let (part, value) = (&mut parts[i], value - distance);
                let middle = at(*part, round);
                if value < 0.0 {
                    (part[0], part[1]) = (middle, value);
                } else {
                    (part[2], part[3]) = (middle, value);
                }
            }
            open.retain(|&i| far(&parts[i]));
        }
        let best = |[a, low, b, high]: [f64; 4]| if -low < high { a } else { b };
        let points: Vec<DVec3> = ends.iter().zip(&parts).map(|(&(from, to), &part)| from + (to - from) * best(part)).collect();
        let mut gradients = vec![DVec3::ZERO; points.len()];
        shape.gradients(&points, &mut gradients)?;
        // Where the shape and the field do not agree on the ends, as rounding may have it, the field is right.
        let agree = low.iter().zip(&high).map(|(&low, &high)| low < distance && high >= distance);
        Ok(points.into_iter().zip(gradients).zip(agree).map(|((p, n), agree)| agree.then_some((p, n))).collect::<Vec<_>>())
    })?;
    for (e, found) in list.into_iter().zip(found.into_iter().flatten()) {
        if let Some((point, gradient)) = found
            && let Some(unit) = gradient.try_normalize()
        {
            crossings[e].point = point;
            crossings[e].normal = unit.to_array().map(|x| x as f32);
        }
    }
    Ok(())
}
