//! What a formula's distance may differ by from what is said between samples.

use super::shape::Implicit;
use crate::distance::SampleBlock;
use crate::error::Result;
use crate::geom::Interval;
use crate::source::balls;

/// Farther than so many radii of the cell, balls around feet say nearly all that can be said.
const FAR: f64 = 3.0;

/// Feet of one sheet lie no farther apart than so many radii of the cell, but for where it bends as much as a ball around the cell.
const APART: f64 = 6.0;

/// [`residual`](crate::distance::Source::residual) of a formula: what is cheap and likely to do comes first.
///
/// Far from the surface balls around feet tell how the distance bends, and so do kinks where two sheets are as near: there no
/// bound of bends holds, nor do balls that are farther say more. Next to the surface the shape is likely to be smooth.
pub(super) fn residual(shape: &Implicit, block: &SampleBlock<'_>, out: &mut [Interval]) -> Result<()> {
    let off = balls::of_point(shape, block, out);
    if !balls::is_open(block, out) {
        return Ok(());
    }
    let (radius, ask) = (block.cell.radius(), balls::asked(shape));
    if off < radius && block.values.iter().all(|value| value.abs() > FAR * radius) {
        let apart = balls::feet(block, off, &ask, out)?;
        if apart.is_some_and(|apart| apart.length() <= APART * radius) && balls::is_open(block, out) {
            balls::of_bend(shape, block, out);
        }
    } else {
        balls::of_bend(shape, block, out);
        if balls::is_open(block, out) {
            balls::narrow(block, off, ask, out)?;
        }
    }
    Ok(())
}
