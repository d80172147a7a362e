//! Whether a surface at a distance stays in the domain of an adaptively sampled field.

use crate::error::{Error, Result};
use crate::field::AdaptiveField;
use crate::field::adaptive::Coverage;

/// Refuses a distance that is reached on the border of the domain, where the surface would end: of a field whose whole solid
/// lies inside. A domain that cuts its solid was meant to.
pub(super) fn check(field: &AdaptiveField, distance: f64) -> Result<()> {
    if field.coverage() != Coverage::Whole || !(distance > 0.0) {
        return Ok(());
    }
    let axes = field.division().children().ilog2() as usize;
    let mut least = f64::INFINITY;
    field.walk(&mut |cell| {
        let (index, last) = (cell.index(), (1u32 << cell.depth()) - 1);
        // The sides of the domain that it lies at: bit 0 the low one, bit 1 the high one.
        let sides: [u32; 3] =
            std::array::from_fn(|axis| if axis < axes { u32::from(index[axis] == 0) | u32::from(index[axis] == last) << 1 } else { 0 });
        let outer = |corner: usize| (0..axes).any(|axis| sides[axis] >> (corner >> axis & 1) & 1 == 1);
        if cell.is_leaf() {
            let values = (0..8).filter(|&corner| outer(corner)).map(|corner| f64::from(cell.corners()[corner]));
            least = values.fold(least, f64::min);
        }
        sides != [0; 3]
    });
    if least >= distance {
        return Ok(());
    }
    Err(Error::invalid(format!(
        "the surface at distance {distance:?} would end where the field's domain does, which comes as near as {least:.3e} to the solid; build \
         the field in a domain that reaches farther, or take a smaller distance"
    )))
}
