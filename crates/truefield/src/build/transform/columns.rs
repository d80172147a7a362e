//! Columns of one array, lent to several threads at once.
//!
//! Unsafe, because a band of columns is no slice: its rows lie apart, with other bands between them. A [`Band`] owns
//! its columns as a `&mut` slice owns its items: bands are only made by [`bands`] and [`Band::whole`], which
//! hand out each column once, and every access is checked against the band's own rows and width.

#![allow(unsafe_code)]

use std::marker::PhantomData;

/// Neighbouring columns of a row-major array, for one thread to read and write.
pub(super) struct Band<'a, T> {
    corner: *mut T,
    rows: usize,
    stride: usize,
    /// Number of columns.
    pub width: usize,
    /// Where the first item lies in the array.
    pub start: usize,
    owner: PhantomData<&'a mut [T]>,
}

// SAFETY: a band is an exclusive loan of its items, like `&mut [T]`.
unsafe impl<T: Send> Send for Band<'_, T> {}

impl<'a, T: Copy> Band<'a, T> {
    /// All columns of a slab of rows of `stride` items that begins at item `start` of the array.
    pub fn whole(slab: &'a mut [T], stride: usize, start: usize) -> Self {
        Self { corner: slab.as_mut_ptr(), rows: slab.len() / stride, stride, width: stride, start, owner: PhantomData }
    }

    /// Where item (row, column) lies in the array.
    pub fn index(&self, row: usize, column: usize) -> usize {
        self.start + row * self.stride + column
    }

    /// Copies the items of a row that begin at `column`.
    #[inline(always)]
    pub fn read(&self, row: usize, column: usize, into: &mut [T]) {
        assert!(row < self.rows && column + into.len() <= self.width);
        // SAFETY: the items belong to this band, as was just checked, and to nobody else.
        unsafe { std::ptr::copy_nonoverlapping(self.corner.add(row * self.stride + column), into.as_mut_ptr(), into.len()) }
    }

    /// Overwrites the items of a row that begin at `column`.
    #[inline(always)]
    pub fn write(&mut self, row: usize, column: usize, from: &[T]) {
        assert!(row < self.rows && column + from.len() <= self.width);
        // SAFETY: the items belong to this band, as was just checked, and to nobody else.
        unsafe { std::ptr::copy_nonoverlapping(from.as_ptr(), self.corner.add(row * self.stride + column), from.len()) }
    }
}

/// Splits an array of slabs of `rows` rows of `stride` items into bands of at most `width` columns.
pub(super) fn bands<T: Copy>(data: &mut [T], rows: usize, stride: usize, width: usize) -> Vec<Band<'_, T>> {
    let mut made = Vec::new();
    for (slab, items) in data.chunks_exact_mut(rows * stride).enumerate() {
        let corner = items.as_mut_ptr();
        for column in (0..stride).step_by(width) {
            // SAFETY: the column lies inside the slab, which has at least one row.
            let corner = unsafe { corner.add(column) };
            let start = slab * rows * stride + column;
            made.push(Band { corner, rows, stride, width: width.min(stride - column), start, owner: PhantomData });
        }
    }
    made
}

/// Floats as the words that they take, so that whole numbers can be kept there until the last pass.
pub(super) fn words(floats: &mut [f32]) -> &mut [u32] {
    // SAFETY: both types have the same size and alignment, and every pattern of bits is one of either.
    unsafe { std::slice::from_raw_parts_mut(floats.as_mut_ptr().cast(), floats.len()) }
}
