//! From squared distances to distances.

use super::value::{Row, Value};
use crate::simd::{Fuse, multiversion};

/// Squared whole numbers below this are exact in single precision.
const SINGLE: u32 = 1 << 24;

/// Where a distance that single precision cannot hold goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rounding {
    Nearest,
    Down,
    Up,
}

/// How squared distances become distances.
#[derive(Clone, Copy, Debug)]
pub(super) struct Finish {
    /// The length whose square counts one.
    pub unit: f64,
    pub rounding: Rounding,
}

impl Finish {
    /// The distance of one squared value.
    #[inline(always)]
    pub fn distance(self, square: f64) -> f32 {
        let length = square.sqrt() * self.unit;
        let rounded = length as f32;
        // A unit that is a power of two costs no rounding; others, and squares of other spacings, are given some.
        let slack = if self.scales() { 0.0 } else { 4.0 * f64::EPSILON * length };
        match self.rounding {
            Rounding::Nearest => rounded,
            _ if rounded == 0.0 && square == 0.0 || rounded.is_infinite() && square.is_infinite() => rounded,
            Rounding::Down if f64::from(rounded) > length - slack => rounded.next_down().max(0.0),
            Rounding::Up if f64::from(rounded) < length + slack => rounded.next_up(),
            _ => rounded,
        }
    }

    /// Whether the unit is a power of two, in the middle of the range of single precision.
    #[inline(always)]
    fn scales(self) -> bool {
        let mantissa = self.unit.to_bits() & ((1 << 52) - 1);
        mantissa == 0 && (1e-15..1e15).contains(&self.unit)
    }

    /// Writes the distances of whole numbers over them, as bits; `inside` are the lanes that get a minus.
    pub fn rows(self, rows: &mut [Row<u32>], labels: Option<&[Row<u32>]>) {
        finish_rows(rows, labels, self);
    }
}

multiversion!(
    fn finish_rows(rows: &mut [Row<u32>], labels: Option<&[Row<u32>]>, finish: Finish) = finish_rows_body
);

#[inline(always)]
fn finish_rows_body<F: Fuse>(rows: &mut [Row<u32>], labels: Option<&[Row<u32>]>, finish: Finish) {
    let quick = finish.scales() && finish.rounding == Rounding::Nearest;
    let unit = finish.unit as f32;
    for row in rows.iter_mut() {
        if quick && !F::any_above(row, SINGLE) {
            for square in row {
                *square = ((*square as i32 as f32).sqrt() * unit).to_bits();
            }
        } else {
            for square in row {
                *square = finish.distance(square.to_f64()).to_bits();
            }
        }
    }
    if let Some(labels) = labels {
        for (row, labels) in rows.iter_mut().zip(labels) {
            for (bits, label) in row.iter_mut().zip(labels) {
                // Inside is label 1, outside 0; the highest bit is the sign.
                *bits |= label << 31;
            }
        }
    }
}
