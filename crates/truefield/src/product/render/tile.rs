//! Tiles of the picture and the samples of a pixel.

/// Edge of a tile in pixels.
pub(super) const TILE: u32 = 32;

/// Where in a pixel the `N` samples lie, N an odd square.
///
/// A sheared square grid (Kensler 2013): every row and every column of N x N cells holds one sample, so
/// edges near the axes get N levels of grey, not the square root of N; the middle sample is the pixel's centre.
pub(super) struct Pattern<const N: usize> {
    pub x: [f64; N],
    pub y: [f64; N],
}

impl<const N: usize> Pattern<N> {
    /// Index of the sample at the pixel's centre.
    pub const MIDDLE: usize = N / 2;

    pub fn new() -> Self {
        let side = N.isqrt();
        let place = |major: usize, minor: usize| (major as f64 + (minor as f64 + 0.5) / side as f64) / side as f64;
        Self { x: std::array::from_fn(|k| place(k % side, k / side)), y: std::array::from_fn(|k| place(k / side, k % side)) }
    }

    /// Mean position of the samples of a mask.
    pub fn centroid(&self, mask: u32) -> [f64; 2] {
        let (mut x, mut y) = (0.0, 0.0);
        for k in (0..N).filter(|k| mask >> k & 1 == 1) {
            x += self.x[k];
            y += self.y[k];
        }
        let count = f64::from(mask.count_ones().max(1));
        [x / count, y / count]
    }
}

/// Pixels `x0..x1` by `y0..y1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Area {
    pub x0: u32,
    pub y0: u32,
    pub x1: u32,
    pub y1: u32,
}

impl Area {
    /// Tile `index` of a picture of `width` x `height` pixels.
    pub fn of_tile(index: usize, width: u32, height: u32) -> Self {
        let across = width.div_ceil(TILE);
        let (x0, y0) = (index as u32 % across * TILE, index as u32 / across * TILE);
        Self { x0, y0, x1: (x0 + TILE).min(width), y1: (y0 + TILE).min(height) }
    }

    /// The pixels that a rectangle `[x0, y0, x1, y1]` touches.
    pub fn within(self, bounds: [f64; 4]) -> Self {
        let clip = |value: f64, low: u32, high: u32| value.clamp(f64::from(low), f64::from(high)) as u32;
        Self {
            x0: clip(bounds[0].floor(), self.x0, self.x1),
            y0: clip(bounds[1].floor(), self.y0, self.y1),
            x1: clip(bounds[2].floor() + 1.0, self.x0, self.x1),
            y1: clip(bounds[3].floor() + 1.0, self.y0, self.y1),
        }
    }

    /// The rows `y0..y1` of it.
    pub fn rows(self, y0: u32, y1: u32) -> Self {
        Self { y0: self.y0.max(y0), y1: self.y1.min(y1), ..self }
    }

    /// Number of pixels.
    pub fn len(self) -> usize {
        ((self.x1 - self.x0) * (self.y1 - self.y0)) as usize
    }

    /// Index of a pixel of the area.
    pub fn index(self, x: u32, y: u32) -> usize {
        ((y - self.y0) * (self.x1 - self.x0) + (x - self.x0)) as usize
    }
}
