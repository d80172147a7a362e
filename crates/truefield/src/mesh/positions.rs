//! Which of many positions are equal: a table of numbers, found by their coordinates.

use crate::geom::DVec3;

/// A place that holds no number.
const EMPTY: u32 = u32::MAX;

/// Numbers of distinct positions, which are kept elsewhere. -0 equals 0.
///
/// Four to eight bytes a position, or twelve for a moment while the table grows.
#[derive(Clone, Debug, Default)]
pub(crate) struct Positions {
    /// A power of two of them, at least twice as many as are held.
    places: Vec<u32>,
    held: usize,
}

impl Positions {
    /// The number that is held for a position equal to `p`; if none is, `number`, which is held from now on. `at` says
    /// where the numbers that are held lie.
    pub fn number(&mut self, p: DVec3, number: u32, at: impl Fn(u32) -> DVec3) -> u32 {
        if 2 * self.held >= self.places.len() {
            self.grow(&at);
        }
        let key = key(p);
        let mut place = self.start(key);
        loop {
            match self.places[place] {
                EMPTY => {
                    self.places[place] = number;
                    self.held += 1;
                    return number;
                }
                held if self::key(at(held)) == key => return held,
                _ => place = (place + 1) & (self.places.len() - 1),
            }
        }
    }

    fn grow(&mut self, at: impl Fn(u32) -> DVec3) {
        let more = vec![EMPTY; (2 * self.places.len()).max(64)];
        for number in std::mem::replace(&mut self.places, more).into_iter().filter(|&number| number != EMPTY) {
            let mut place = self.start(key(at(number)));
            while self.places[place] != EMPTY {
                place = (place + 1) & (self.places.len() - 1);
            }
            self.places[place] = number;
        }
    }

    /// Where the search for a position starts.
    fn start(&self, key: [u64; 3]) -> usize {
        // Coordinates of single precision differ in their upper bits only, which a product moves no lower: so it is folded.
        let hash = key.into_iter().fold(0u64, |hash, bits| {
            let product = u128::from(hash ^ bits ^ 0x9e37_79b9_7f4a_7c15) * 0xd6e8_feb8_6659_fd93_u128;
            product as u64 ^ (product >> 64) as u64
        });
        hash as usize & (self.places.len() - 1)
    }
}

/// Equal where the positions are. Adding zero turns -0 into 0.
fn key(p: DVec3) -> [u64; 3] {
    (p + DVec3::ZERO).to_array().map(f64::to_bits)
}

/// Positions in order of first appearance, each once; -0 becomes 0.
#[derive(Clone, Debug, Default)]
pub struct Distinct {
    points: Vec<[f64; 3]>,
    positions: Positions,
}

impl Distinct {
    /// The number of a position, which is the next one if it is new; `None` where there are 2^32 - 1 already.
    pub fn number(&mut self, p: DVec3) -> Option<u32> {
        let next = u32::try_from(self.points.len()).ok().filter(|&next| next != EMPTY)?;
        let number = self.positions.number(p, next, |number| DVec3::from_array(self.points[number as usize]));
        if number == next {
            self.points.push((p + DVec3::ZERO).to_array());
        }
        Some(number)
    }

    /// The positions, by number.
    pub fn into_points(self) -> Vec<[f64; 3]> {
        self.points
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    #[test]
    fn numbers_are_those_of_first_appearance() {
        // Many equal, many that differ in their last or first bits only, zeros of both signs and what is no number.
        let axis = [0.0, -0.0, 1.0, 1.0 + f64::EPSILON, -1.0, 1e-300, 1e300, f64::NAN, f64::INFINITY];
        let mut distinct = Distinct::default();
        let mut expected: HashMap<[u64; 3], u32> = HashMap::new();
        let mut state = 1u64;
        for i in 0..200_000u32 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let pick = |shift: u32| axis[(state >> shift) as usize % axis.len()];
            let p = if i % 2 == 0 { DVec3::new(pick(20), pick(33), pick(46)) } else { DVec3::splat(f64::from((i % 30_011) as f32 * 0.1)) };
            let next = expected.len() as u32;
            let number = *expected.entry(key(p)).or_insert(next);
            assert_eq!(distinct.number(p), Some(number));
        }
        let points = distinct.into_points();
        assert_eq!(points.len(), expected.len());
        for (key, number) in expected {
            assert_eq!(points[number as usize].map(f64::to_bits), key);
        }
    }
}
