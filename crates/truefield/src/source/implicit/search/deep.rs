//! Where much of the surface is as near: hundreds of thousands of boxes, of which none is kept.

use super::super::boxes::halves;
use super::super::sheet::Sheet;
use super::super::taylor::Taylor;
use super::{Effort, Search};
use crate::run::is_cancelled;

/// Boxes that a search makes in the depth at most, in some ten seconds.
const DEEPEST: usize = 4_000_000;

/// Boxes between two looks at whether the job was cancelled.
const LOOK: usize = 64;

impl Search<'_> {
    /// Whether what is not kept is looked at nevertheless: around a foot, without which there is no end.
    pub(super) fn goes_deep(&self) -> bool {
        self.effort == Effort::Whole && self.upper < f64::INFINITY
    }

    /// Goes on with what a full search still makes, depth first: that takes no room, and no look at what was proven.
    pub(super) fn go_deep(&mut self) {
        // The middle of bounds that far apart is as near as the noise.
        let enough = 1.9 * self.accuracy.hard;
        let mut stopped = false;
        while let Some((bound, extent)) = self.deep.pop() {
            stopped = stopped || self.made.is_multiple_of(LOOK) && is_cancelled();
            if self.is_done(bound, enough) {
                continue;
            }
            if stopped || self.made > DEEPEST || extent.size().max_element() <= 0.125 * self.accuracy.smooth {
                self.set_aside(bound, false);
                continue;
            }
            for half in halves(&extent) {
                self.made += 1;
                let taylor = Taylor::of(self.tape, &Sheet::over(self.tape, &half));
                let bound = bound.max(taylor.rough(self.p, &half));
                if !self.is_done(bound, enough) {
                    let bound = bound.max(taylor.least(self.p, &half).0);
                    if bound < self.upper * self.upper {
                        self.deep.push((bound, half));
                    }
                }
            }
        }
    }
}
