//! Rays side by side: what they all pass over before any of them can meet something is looked for once.

use super::caster::{Caster, Child};
use super::walk::{FULL, Prepared};

/// Rays of a beam.
pub(super) const RAYS: usize = 32;

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
    pub(super) fn free(&self, rays: &[Option<Prepared>]) -> f64 {
        let mut met = rays.iter().flatten();
        let Some(first) = met.next() else { return f64::INFINITY };
        let alone = |value: [f64; 3]| value.map(|v| [v, v]);
        let mut beam = Beam { origin: alone(first.turned.origin), inverse: alone(first.turned.inverse), mask: first.turned.mask };
        for ray in rays.iter().flatten() {
            if !ray.outside || ray.turned.mask != beam.mask {
                return 0.0;
            }
            let widen = |range: &mut [f64; 2], value: f64| *range = [range[0].min(value), range[1].max(value)];
            for axis in 0..3 {
                widen(&mut beam.origin[axis], ray.turned.origin[axis]);
                widen(&mut beam.inverse[axis], ray.turned.inverse[axis]);
            }
        }
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
