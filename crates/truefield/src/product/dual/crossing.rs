//! Edges of the tree that the surface crosses.

use super::skeleton::{Copy, Leaf};
use crate::error::Result;
use crate::field::adaptive::Leaf as Kind;
use crate::geom::DVec3;
use crate::run::Run;

/// Jobs that the search for edges is divided into, at least.
const JOBS: usize = 2048;

/// Steps that find where a leaf that does not interpolate linearly is at the distance.
const STEPS: usize = 40;

/// The cells around an edge, in this order: each touches the next in a face.
pub(super) const AROUND: [usize; 4] = [0, 1, 3, 2];

/// An edge from a corner inside to one outside that no smaller cell divides.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossing {
    /// The leaves around it, in the order in which a walk about the edge's axis meets them; one may fill two places.
    pub leaves: [u32; 4],
    /// Where the surface crosses.
    pub point: DVec3,
    /// Which way is out there.
    pub normal: [f32; 3],
    pub axis: u8,
    /// Whether the end at low coordinates is the one inside.
    pub rising: bool,
}

impl Crossing {
    /// The places that start a leaf.
    #[inline]
    pub fn places(&self) -> impl Iterator<Item = usize> {
        let leaves = self.leaves;
        (0..4).filter(move |&k| leaves[k] != leaves[(k + 3) % 4])
    }

    /// The last place of the leaf that starts at place `k`.
    #[inline]
    pub fn last(&self, k: usize) -> usize {
        let next = (k + 1) % 4;
        if self.leaves[next] == self.leaves[k] { next } else { k }
    }

    /// The face between place `k` and the next: its axis, and whether place `k` is on its low side.
    #[inline]
    pub fn face(&self, k: usize) -> (usize, bool) {
        ((self.axis as usize + 1 + k % 2) % 3, k < 2)
    }
}

/// All crossings, in an order that depends on the tree alone.
pub(super) fn crossings(copy: &Copy<'_>, distance: f64, run: &Run<'_>) -> Result<Vec<Crossing>> {
    let found = run.blocks("find crossed edges", copy.jobs.len(), |number| {
        let mut found = Vec::new();
        copy.edges(copy.jobs[number], |nodes, axis| {
            let leaves = AROUND.map(|place| nodes[place]);
            // The deepest leaf has the whole edge as one of its own.
            let depth = |place: usize| copy.skeleton.leaves[nodes[place] as usize].cell.depth();
            let mut place = 0;
            for other in 1..4 {
                place = if depth(other) > depth(place) { other } else { place };
            }
            let leaf = &copy.skeleton.leaves[nodes[place] as usize];
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let low = (1 - (place & 1)) << u | (1 - (place >> 1)) << v;
            let high = low | 1 << axis;
            let rising = leaf.inside(low);
            if rising == leaf.inside(high) {
                return;
            }
            let (inside, outside) = if rising { (low, high) } else { (high, low) };
            let (point, normal) = place_on(leaf, inside, outside, axis, distance);
            found.push(Crossing { leaves, point, normal, axis: axis as u8, rising });
        });
        Ok(found)
    })?;
    Ok(super::joined(found))
}

/// Divides the work.
pub(super) fn divide(copy: &mut Copy<'_>) {
    copy.divide(JOBS);
}

/// Where a leaf's own edge crosses the distance, and which way is out.
fn place_on(leaf: &Leaf<'_>, inside: usize, outside: usize, axis: usize, distance: f64) -> (DVec3, [f32; 3]) {
    let extent = leaf.extent();
    let (from, to) = (extent.corner(inside), extent.corner(outside));
    let mut out = DVec3::ZERO;
    out[axis] = if inside < outside { 1.0 } else { -1.0 };
    let (low, high) = (leaf.value(inside), leaf.value(outside));
    if high < distance {
        // Closed where the domain ends.
        return (to, out.to_array().map(|x| x as f32));
    }
    let mut part = ((distance - low) / (high - low)).clamp(0.0, 1.0);
    if !matches!(leaf.cell.leaf(), Kind::Linear) {
        // The secant is a good first guess; halving is certain.
        let (mut a, mut b) = (0.0, 1.0);
        for _ in 0..STEPS {
            let value = leaf.cell.value(from + (to - from) * part);
            if value < distance {
                a = part;
            } else {
                b = part;
            }
            part = 0.5 * (a + b);
        }
    }
    // Across the edge both ends have the same coordinates, and so has every point between.
    let point = from + (to - from) * part;
    (point, leaf.cell.gradient(point).try_normalize().unwrap_or(out).to_array().map(|x| x as f32))
}
