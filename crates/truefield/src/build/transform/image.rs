//! The image as it was given: no copy, whatever its type.

use crate::error::{Error, Result};

/// Voxels, the last axis contiguous. Signed integers are given as the unsigned ones of the same width, booleans as bytes.
#[derive(Clone, Copy, Debug)]
pub enum Image<'a> {
    /// Bytes or booleans.
    U8(&'a [u8]),
    /// Two bytes a voxel.
    U16(&'a [u16]),
    /// Four bytes a voxel.
    U32(&'a [u32]),
    /// Eight bytes a voxel; not as labels.
    U64(&'a [u64]),
    /// Single precision; not as labels.
    F32(&'a [f32]),
    /// Double precision; not as labels.
    F64(&'a [f64]),
}

/// What a voxel is taken for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reading {
    /// 1 where the value is not zero.
    Foreground,
    /// The value itself.
    Label,
}

impl Image<'_> {
    /// Number of voxels.
    pub fn len(&self) -> usize {
        match self {
            Self::U8(v) => v.len(),
            Self::U16(v) => v.len(),
            Self::U32(v) => v.len(),
            Self::U64(v) => v.len(),
            Self::F32(v) => v.len(),
            Self::F64(v) => v.len(),
        }
    }

    /// Whether there is no voxel.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether its values can be told apart as labels.
    pub(super) fn has_labels(&self) -> bool {
        matches!(self, Self::U8(_) | Self::U16(_) | Self::U32(_))
    }

    /// The labels of the voxels that begin at `start`.
    #[inline]
    pub(super) fn labels(&self, reading: Reading, start: usize, into: &mut [u32]) {
        let range = start..start + into.len();
        match (self, reading) {
            (Self::U8(v), Reading::Label) => each(&v[range], into, u32::from),
            (Self::U16(v), Reading::Label) => each(&v[range], into, u32::from),
            (Self::U32(v), Reading::Label) => into.copy_from_slice(&v[range]),
            (Self::U8(v), _) => each(&v[range], into, |x| u32::from(x != 0)),
            (Self::U16(v), _) => each(&v[range], into, |x| u32::from(x != 0)),
            (Self::U32(v), _) => each(&v[range], into, |x| u32::from(x != 0)),
            (Self::U64(v), _) => each(&v[range], into, |x| u32::from(x != 0)),
            (Self::F32(v), _) => each(&v[range], into, |x| u32::from(x != 0.0)),
            (Self::F64(v), _) => each(&v[range], into, |x| u32::from(x != 0.0)),
        }
    }

    /// Refuses values that are not a number, among the voxels that begin at `start`.
    pub(super) fn check_numbers(&self, start: usize, length: usize) -> Result<()> {
        let range = start..start + length;
        let unordered = match self {
            Self::F32(v) => v[range].iter().fold(false, |any, x| any | x.is_nan()),
            Self::F64(v) => v[range].iter().fold(false, |any, x| any | x.is_nan()),
            _ => false,
        };
        if unordered {
            return Err(Error::invalid("the image holds values that are not a number; replace them, with numpy.nan_to_num for example"));
        }
        Ok(())
    }

    /// One bit a voxel, set where the value is not zero, for the row that begins at `start`.
    pub(super) fn foreground(&self, start: usize, length: usize, bits: &mut Vec<u64>) {
        let range = start..start + length;
        match self {
            Self::U8(v) => pack(&v[range], |x, _| x != 0, bits),
            Self::U16(v) => pack(&v[range], |x, _| x != 0, bits),
            Self::U32(v) => pack(&v[range], |x, _| x != 0, bits),
            Self::U64(v) => pack(&v[range], |x, _| x != 0, bits),
            Self::F32(v) => pack(&v[range], |x, _| x != 0.0, bits),
            Self::F64(v) => pack(&v[range], |x, _| x != 0.0, bits),
        }
    }

    /// One bit a voxel, set where a label differs from the one before it; the first bit is clear.
    pub(super) fn changes(&self, start: usize, length: usize, bits: &mut Vec<u64>) {
        let range = start..start + length;
        match self {
            Self::U8(v) => pack(&v[range], |x, before| x != before, bits),
            Self::U16(v) => pack(&v[range], |x, before| x != before, bits),
            Self::U32(v) => pack(&v[range], |x, before| x != before, bits),
            Self::U64(v) => pack(&v[range], |x, before| x != before, bits),
            Self::F32(v) => pack(&v[range], |x, before| x != before, bits),
            Self::F64(v) => pack(&v[range], |x, before| x != before, bits),
        }
    }
}

#[inline(always)]
fn each<T: Copy>(from: &[T], into: &mut [u32], label: impl Fn(T) -> u32) {
    for (to, &value) in into.iter_mut().zip(from) {
        *to = label(value);
    }
}

/// One bit for each value and the value before it (itself at the start).
#[inline(always)]
fn pack<T: Copy>(values: &[T], test: impl Fn(T, T) -> bool, bits: &mut Vec<u64>) {
    bits.clear();
    let Some(&first) = values.first() else { return };
    let mut bytes = [0u8; 64];
    let mut before = first;
    for group in values.chunks(64) {
        bytes[0] = u8::from(test(group[0], before));
        for i in 1..group.len() {
            bytes[i] = u8::from(test(group[i], group[i - 1]));
        }
        bytes[group.len()..].fill(0);
        before = group[group.len() - 1];
        let mut word = 0;
        for (i, eight) in bytes.as_chunks::<8>().0.iter().enumerate() {
            // Eight bytes of 0 or 1 to eight bits: the product brings byte k to bit 56 + k.
            word |= (u64::from_le_bytes(*eight).wrapping_mul(0x0102_0408_1020_4080) >> 56) << (8 * i);
        }
        bits.push(word);
    }
}
