//! The image as it was given: no copy, whatever its type.

use crate::error::{Error, Result};
use crate::simd::{Fuse, multiversion};

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
        foreground(self, start, length, bits);
    }

    /// One bit a voxel, set where a label differs from the one before it; the first bit is clear.
    pub(super) fn changes(&self, start: usize, length: usize, bits: &mut Vec<u64>) {
        changes(self, start, length, bits);
    }
}

multiversion!(
    fn foreground(image: &Image<'_>, start: usize, length: usize, bits: &mut Vec<u64>) = foreground_body
);

multiversion!(
    fn changes(image: &Image<'_>, start: usize, length: usize, bits: &mut Vec<u64>) = changes_body
);

#[inline(always)]
fn foreground_body<F: Fuse>(image: &Image<'_>, start: usize, length: usize, bits: &mut Vec<u64>) {
    let range = start..start + length;
    match image {
        Image::U8(v) => pack::<_, Foreground>(&v[range], bits),
        Image::U16(v) => pack::<_, Foreground>(&v[range], bits),
        Image::U32(v) => pack::<_, Foreground>(&v[range], bits),
        Image::U64(v) => pack::<_, Foreground>(&v[range], bits),
        Image::F32(v) => pack::<_, Foreground>(&v[range], bits),
        Image::F64(v) => pack::<_, Foreground>(&v[range], bits),
    }
}

#[inline(always)]
fn changes_body<F: Fuse>(image: &Image<'_>, start: usize, length: usize, bits: &mut Vec<u64>) {
    let range = start..start + length;
    match image {
        Image::U8(v) => pack::<_, Changes>(&v[range], bits),
        Image::U16(v) => pack::<_, Changes>(&v[range], bits),
        Image::U32(v) => pack::<_, Changes>(&v[range], bits),
        Image::U64(v) => pack::<_, Changes>(&v[range], bits),
        Image::F32(v) => pack::<_, Changes>(&v[range], bits),
        Image::F64(v) => pack::<_, Changes>(&v[range], bits),
    }
}

/// A question about a value and the one before it.
trait Test<T> {
    fn holds(value: T, before: T) -> bool;
}

/// Whether the value is not zero.
struct Foreground;

/// Whether the value is not the one before it.
struct Changes;

impl<T: Default + PartialEq> Test<T> for Foreground {
    #[inline(always)]
    fn holds(value: T, _: T) -> bool {
        value != T::default()
    }
}

impl<T: PartialEq> Test<T> for Changes {
    #[inline(always)]
    fn holds(value: T, before: T) -> bool {
        value != before
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
fn pack<T: Copy, Q: Test<T>>(values: &[T], bits: &mut Vec<u64>) {
    bits.clear();
    let Some(&first) = values.first() else { return };
    let mut before = first;
    let (groups, rest) = values.as_chunks::<64>();
    for group in groups {
        let mut earlier = [before; 64];
        earlier[1..].copy_from_slice(&group[..63]);
        let mut bytes = [0; 64];
        for i in 0..64 {
            bytes[i] = u8::from(Q::holds(group[i], earlier[i]));
        }
        before = group[63];
        bits.push(squeeze(&bytes));
    }
    if !rest.is_empty() {
        let mut bytes = [0; 64];
        for (byte, &value) in bytes.iter_mut().zip(rest) {
            *byte = u8::from(Q::holds(value, before));
            before = value;
        }
        bits.push(squeeze(&bytes));
    }
}

/// Bytes of 0 or 1 as bits.
#[inline(always)]
fn squeeze(bytes: &[u8; 64]) -> u64 {
    let mut word = 0;
    for (i, eight) in bytes.as_chunks::<8>().0.iter().enumerate() {
        // The product brings byte k to bit 56 + k.
        word |= (u64::from_le_bytes(*eight).wrapping_mul(0x0102_0408_1020_4080) >> 56) << (8 * i);
    }
    word
}
