//! Which elements touch which tile.

use super::tile::TILE;
use crate::error::{Error, Result};
use crate::run::Run;

/// For every tile the elements whose pixel rectangle touches it, in rising order.
pub(super) struct Bins {
    start: Vec<u32>,
    items: Vec<u32>,
}

/// Two GiB of indices.
const MOST: u64 = 1 << 29;
const BLOCK: usize = 1 << 14;

impl Bins {
    /// `bounds(element)` is the pixel rectangle, `None` for what is out of sight; 8 bytes per element and 4 per entry.
    pub fn sort(run: &Run<'_>, count: usize, [across, down]: [u32; 2], bounds: impl Fn(usize) -> Option<[f64; 4]> + Sync) -> Result<Self> {
        // First and last tile in x and y; an empty range where nothing is touched.
        let tiles = |element: usize| -> [u16; 4] {
            let cell = |value: f64, most: u32| (value / f64::from(TILE)).floor().clamp(-1.0, f64::from(most)) as i64;
            let Some(b) = bounds(element) else { return [1, 0, 1, 0] };
            let [x0, x1, y0, y1] = [cell(b[0], across), cell(b[2], across), cell(b[1], down), cell(b[3], down)];
            if x1 < 0 || y1 < 0 || x0 >= i64::from(across) || y0 >= i64::from(down) {
                return [1, 0, 1, 0];
            }
            [x0.max(0), x1.min(i64::from(across) - 1), y0.max(0), y1.min(i64::from(down) - 1)].map(|v| v as u16)
        };
        let spans = run.blocks("picture: sort", count.div_ceil(BLOCK), |block| {
            Ok((block * BLOCK..((block + 1) * BLOCK).min(count)).map(tiles).collect::<Vec<_>>())
        })?;
        let mut sums = vec![0_u64; (across * down) as usize + 1];
        let each = |span: [u16; 4]| {
            (u32::from(span[2])..=u32::from(span[3]))
                .flat_map(move |y| (u32::from(span[0])..=u32::from(span[1])).map(move |x| (y * across + x) as usize))
        };
        for span in spans.iter().flatten().filter(|s| s[0] <= s[1]) {
            each(*span).for_each(|tile| sums[tile + 1] += 1);
        }
        for tile in 1..sums.len() {
            sums[tile] += sums[tile - 1];
        }
        let total = sums.last().copied().unwrap_or(0);
        if total > MOST {
            return Err(Error::Memory {
                what: "sorting the scene into the tiles of the picture".into(),
                needed: 4 * total,
                allowed: 4 * MOST,
            });
        }
        let start: Vec<u32> = sums.iter().map(|&s| s as u32).collect();
        let mut fill = start.clone();
        let mut items = vec![0; total as usize];
        for (element, span) in spans.iter().flatten().enumerate().filter(|(_, s)| s[0] <= s[1]) {
            each(*span).for_each(|tile| {
                items[fill[tile] as usize] = element as u32;
                fill[tile] += 1;
            });
        }
        Ok(Self { start, items })
    }

    /// The elements of a tile.
    pub fn of(&self, tile: usize) -> &[u32] {
        &self.items[self.start[tile] as usize..self.start[tile + 1] as usize]
    }
}
