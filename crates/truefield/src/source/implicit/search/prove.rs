//! Proofs that nothing is nearer than a foot.

use super::super::foot::{Foot, Proof};
use super::super::sheet::Sheet;
use super::{DONE, MANY, STEPS, Search};
use crate::geom::{Aabb, DVec3};

/// The box around a foot that is tried when what is known of the leaf does not do, in sizes of the box, to either side.
const WIDE: f64 = 0.5;

/// How often that is halved.
const SHRINKS: usize = 8;

impl Search<'_> {
    /// Looks for the foot on the sheet around a box, from `near`; whether what is known of the box is as good as wanted.
    pub(super) fn prove(&mut self, sheet: &Sheet, cell: &Aabb, near: DVec3) -> bool {
        // Where the foot next to the box is known, others look beyond the box.
        let extent = if self.free.iter().any(|foot| sheet.extent.contains(*foot)) { cell } else { &sheet.extent };
        // Around a foot that is known, only smaller boxes help.
        if self.feet.iter().any(|foot| cell.contains(*foot)) {
            return false;
        }
        let Some(foot) = Foot::find(|x| self.tape.jet(x), self.p, near, extent, STEPS, DONE) else { return false };
        let here = self.tape.jet_over::<0>(&Aabb::new(foot.point, foot.point));
        let far = (foot.point - self.p).length();
        if far < self.upper {
            let reached = foot.reached(self.tape, &here, self.p, self.side.other(), sheet, self.domain);
            if reached < self.upper {
                self.upper = reached;
                self.foot = Some(foot.point);
            }
        }
        let held = foot.is_held(extent, self.domain);
        if !held {
            self.free.push(foot.point);
        }
        if self.holds(&foot.proof(&here, self.p, sheet, extent)) && self.is_proven(cell) {
            // What holds around the leaf may hold far around it.
            while let Some((_, sheet)) = self.above.pop().and_then(|above| self.boxes.content(&self.boxes.nodes[above as usize]))
                && sheet.extent.contains(foot.point)
                && self.holds(&foot.proof(&here, self.p, sheet, &sheet.extent))
            {}
            return true;
        }
        if held || far > self.upper {
            return false;
        }
        self.feet.push(foot.point);
        // The wider the box around the foot, the more is proven at once; the smaller, the less derivatives differ.
        let mut half = WIDE * cell.size().max_element();
        for _ in 0..SHRINKS {
            let around = Aabb::new((foot.point - half).max(self.domain.min), (foot.point + half).min(self.domain.max));
            let proof = foot.proof(&here, self.p, &Sheet::over(self.tape, &around), &around);
            half *= 0.5;
            if self.holds(&proof) && (proof.within.max - proof.within.min).max_element() >= half {
                break;
            }
        }
        self.is_proven(cell)
    }

    /// Keeps what is proven, if it is as good as wanted.
    fn holds(&mut self, proof: &Proof) -> bool {
        let holds = self.is_enough(proof.bound);
        if holds {
            self.floor = self.floor.min(proof.bound);
            self.proven.retain(|proven| !(proof.within.contains(proven.min) && proof.within.contains(proven.max)));
            self.proven.push(proof.within);
        }
        holds
    }

    /// What is left of a box beside what is proven, where that is some of it.
    pub(super) fn unproven(&self, extent: &Aabb) -> Option<impl Iterator<Item = Aabb> + use<>> {
        let proven = *self.proven.iter().find(|proven| proven.min.max(extent.min).cmplt(proven.max.min(extent.max)).all())?;
        let mut rest = *extent;
        let parts: [Option<Aabb>; 6] = std::array::from_fn(|face| {
            let (axis, mut part) = (face / 2, rest);
            if face % 2 == 0 && rest.min[axis] < proven.min[axis] {
                (part.max[axis], rest.min[axis]) = (proven.min[axis], proven.min[axis]);
                Some(part)
            } else if face % 2 == 1 && rest.max[axis] > proven.max[axis] {
                (part.min[axis], rest.max[axis]) = (proven.max[axis], proven.max[axis]);
                Some(part)
            } else {
                None
            }
        });
        Some(parts.into_iter().flatten())
    }

    pub(super) fn is_proven(&self, extent: &Aabb) -> bool {
        self.proven.iter().any(|proven| proven.contains(extent.min) && proven.contains(extent.max))
    }

    /// Whether a squared lower bound is as good as wanted.
    pub(super) fn is_enough(&self, bound: f64) -> bool {
        self.is_within(bound, self.enough())
    }

    pub(super) fn is_within(&self, bound: f64, enough: f64) -> bool {
        bound.max(0.0).sqrt() >= self.upper - enough
    }

    /// How far apart the bounds may be: where much of the surface is nearly as far, less is asked for.
    pub(super) fn enough(&self) -> f64 {
        if self.pieces.len() < MANY { self.accuracy.smooth } else { self.accuracy.hard }
    }
}
