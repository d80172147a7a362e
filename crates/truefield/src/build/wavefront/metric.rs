//! Squared distances as keys whose smallest five bits tell which neighbour offers them.

/// Bits of a key that name a neighbour.
const CODE: u32 = 31;

/// How far an offset is; the site of a voxel lies `offset` steps before it.
pub(super) trait Metric: Copy + Send + Sync {
    /// Sorts like the squared distance, then like the neighbour's number.
    type Key: Copy + Ord + Send + Sync;

    /// The key of a site.
    const SITE: Self::Key;

    /// The key of a voxel without a site; larger than all others.
    const NONE: Self::Key;

    /// The key of a voxel that takes the site of its neighbour `(X, Y, Z)`, which has key `key` and offset `x, y, z`.
    fn offer<const X: i16, const Y: i16, const Z: i16>(self, key: Self::Key, x: i16, y: i16, z: i16) -> Self::Key;

    /// `key`, or the first that is beyond the limit.
    fn within(self, key: Self::Key) -> Self::Key;

    /// Voxels with this key or a smaller one do not change in this pass or later: what comes is as many steps away.
    fn settled(self, pass: u16) -> Self::Key;

    /// The number of the neighbour, and the key without it.
    fn split(key: Self::Key) -> (usize, Self::Key);

    /// In model units.
    fn length(self, key: Self::Key) -> f64;
}

/// The number of neighbour `(x, y, z)`: 1 to 27 in the order of indices, so that 0 is the voxel itself.
pub(super) const fn code(x: i16, y: i16, z: i16) -> u32 {
    ((x + 1) * 9 + (y + 1) * 3 + z + 2) as u32
}

/// The step to the neighbour with a number.
pub(super) fn delta(code: usize) -> [i16; 3] {
    let n = code as i16 - 1;
    [n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1]
}

/// The same step along all axes: whole numbers of steps, squared.
#[derive(Clone, Copy, Debug)]
pub(super) struct Whole {
    step: f64,
    end: u32,
}

impl Whole {
    /// Squares below this fit a key.
    pub const LARGEST: u64 = 1 << 26;

    /// Sites up to `limit` away.
    pub fn new(step: f64, limit: f64) -> Self {
        let steps = limit / step;
        let squared = (steps * steps * (1.0 + 1e-15)).min(Self::LARGEST as f64 - 1.0) as u32;
        Self { step, end: (squared + 1) << 5 }
    }
}

impl Metric for Whole {
    type Key = u32;

    const SITE: u32 = 0;
    const NONE: u32 = (Self::LARGEST as u32) << 5;

    #[inline(always)]
    fn offer<const X: i16, const Y: i16, const Z: i16>(self, key: u32, x: i16, y: i16, z: i16) -> u32 {
        let along = |step: i16, offset: i16| match step {
            1 => i32::from(offset),
            -1 => -i32::from(offset),
            _ => 0,
        };
        let lean = along(X, x) + along(Y, y) + along(Z, z);
        let fixed = ((X * X + Y * Y + Z * Z) as u32) << 5 | code(X, Y, Z);
        key.wrapping_add(fixed).wrapping_sub((lean << 6) as u32)
    }

    #[inline(always)]
    fn within(self, key: u32) -> u32 {
        key.min(self.end)
    }

    fn settled(self, pass: u16) -> u32 {
        (u32::from(pass) * u32::from(pass)).min(Self::LARGEST as u32 - 1) << 5
    }

    fn split(key: u32) -> (usize, u32) {
        ((key & CODE) as usize, key & !CODE)
    }

    fn length(self, key: u32) -> f64 {
        f64::from(key >> 5).sqrt() * self.step
    }
}

/// A step for every axis. Squares that differ only in the last five of their 52 bits count as equal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scaled {
    squares: [f64; 3],
    end: u64,
}

impl Scaled {
    /// Sites up to `limit` away.
    pub fn new(steps: [f64; 3], limit: f64) -> Self {
        Self { squares: steps.map(|step| step * step), end: Self::split((limit * limit).to_bits()).1 + u64::from(CODE) + 1 }
    }
}

impl Metric for Scaled {
    type Key = u64;

    const SITE: u64 = 0;
    const NONE: u64 = f64::INFINITY.to_bits();

    #[inline(always)]
    fn offer<const X: i16, const Y: i16, const Z: i16>(self, key: u64, x: i16, y: i16, z: i16) -> u64 {
        let [x, y, z] = [i32::from(x) - i32::from(X), i32::from(y) - i32::from(Y), i32::from(z) - i32::from(Z)].map(f64::from);
        let squared = (x * x) * self.squares[0] + (y * y) * self.squares[1] + (z * z) * self.squares[2];
        let offered = (squared.to_bits() & !u64::from(CODE)) | u64::from(code(X, Y, Z));
        if key == Self::NONE { u64::MAX } else { offered }
    }

    #[inline(always)]
    fn within(self, key: u64) -> u64 {
        key.min(self.end)
    }

    fn settled(self, pass: u16) -> u64 {
        let [x, y, z] = self.squares;
        Self::split((f64::from(pass) * f64::from(pass) * x.min(y).min(z)).to_bits()).1
    }

    fn split(key: u64) -> (usize, u64) {
        ((key & u64::from(CODE)) as usize, key & !u64::from(CODE))
    }

    fn length(self, key: u64) -> f64 {
        f64::from_bits(key).sqrt()
    }
}
