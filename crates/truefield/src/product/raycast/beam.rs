//! Rays side by side: what they all pass over before any of them can meet something is looked for once.

use super::caster::{Caster, Child};
use super::lanes::{Lanes, RAYS};
use super::walk::FULL;

/// Nodes looked at for one beam; then it starts where it has come to.
const NODES: usize = 512;

/// Where rays that run to the same octant lie, in the frame of the walk.
struct Beam {
    origin: [[f64; 2]; 3],
    inverse: [[f64; 2]; 3],
    mask: usize,
}

impl Beam {
    /// The earliest and the latest parameter at which any of the rays meets a plane.
    #[inline(always)]
    fn at_plane(&self, axis: usize, plane: f64) -> [f64; 2] {
        let (near, far) = (plane - self.origin[axis][1], plane - self.origin[axis][0]);
        let [slow, fast] = self.inverse[axis];
        [near * if near < 0.0 { fast } else { slow }, far * if far < 0.0 { slow } else { fast }]
    }

    /// Before which parameter none of the rays is in a box, if any may ever be.
    #[inline(always)]
    fn enters(&self, place: [u32; 3], sizes: [u32; 3]) -> Option<f64> {
        let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
        for axis in 0..3 {
            enter = enter.max(self.at_plane(axis, f64::from(place[axis]))[0]);
            leave = leave.min(self.at_plane(axis, f64::from(place[axis] + sizes[axis]))[1]);
        }
        (enter <= leave).then_some(enter)
    }
}

impl Caster {
    /// A parameter before which none of the rays meets anything, counted for each from where it enters the domain;
    /// infinite where none ever does. Zero where nothing is gained by asking.
    pub(super) fn free(&self, rays: &Lanes<RAYS>) -> f64 {
        let Some(first) = (0..RAYS).find(|&lane| rays.meets(lane)) else { return f64::INFINITY };
        let mask = rays.mask[first];
        let together = |lane: usize| !rays.meets(lane) | (rays.outside(lane) & (rays.mask[lane] == mask));
        if !(0..RAYS).fold(true, |all, lane| all & together(lane)) {
            return 0.0;
        }
        let range = |values: &[f64; RAYS]| {
            let (mut low, mut high) = (values[first], values[first]);
            for lane in 0..RAYS {
                let value = if rays.meets(lane) { values[lane] } else { values[first] };
                low = if value < low { value } else { low };
                high = if value > high { value } else { high };
            }
            [low, high]
        };
        let beam = Beam {
            origin: std::array::from_fn(|axis| range(&rays.origin[axis])),
            inverse: std::array::from_fn(|axis| range(&rays.inverse[axis])),
            mask: mask as usize,
        };
        self.search(&beam)
    }

    fn search(&self, beam: &Beam) -> f64 {
        let (axes, octants, mask) = if self.columns { (2, 4, beam.mask & 3) } else { (3, 8, beam.mask) };
        let mut best = f64::INFINITY;
        // A node, where it lies and from when on.
        let mut stack = vec![(self.root, [0u32; 3], FULL, 0.0)];
        let mut looked = 0;
        while let Some((word, place, size, enter)) = stack.pop() {
            if enter >= best {
                continue;
            }
            let Child::Branch(node) = Child::of(word) else {
                best = enter;
                continue;
            };
            looked += 1;
            if looked > NODES {
                best = stack.iter().fold(best.min(enter), |best, later| best.min(later.3));
                break;
            }
            let half = size / 2;
            let sizes = if axes == 3 { [half; 3] } else { [half, half, FULL] };
            // The nearest child comes last, to be taken first.
            for octant in (0..octants).rev() {
                let word = self.nodes[node as usize][octant ^ mask];
                if Child::of(word) == Child::Empty(false) {
                    continue;
                }
                let mut at = place;
                for axis in 0..axes {
                    at[axis] += half * (octant as u32 >> axis & 1);
                }
                if let Some(enter) = beam.enters(at, sizes)
                    && enter < best
                {
                    stack.push((word, at, half, enter));
                }
            }
        }
        best
    }
}
