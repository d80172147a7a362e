//! The least upper bound that weighted means of convex functions give over a box.
//!
//! With `D[i][k]` the value of convex function `i` at corner `k`, every set of weights `w` bounds
//! the smallest of the functions over the whole box by `max_k sum_i w_i D[i][k]`. The best weights
//! are the optimal mixed strategy of a matrix game, found by the simplex method (Dantzig 1951);
//! the other player's strategy mixes the corners to the place where the bound is attained.

const CORNERS: usize = 8;
const WIDTH: usize = 2 * CORNERS + 1;
const PIVOTS: usize = 48;

/// The bound, and weights of the corners that point to where it is attained.
///
/// Up to eight functions are used. Whatever rounding does to the weights, the bound holds up to
/// an ulp or two of the values, because it is evaluated from the weights afterwards.
pub(super) fn solve(columns: &[[f64; CORNERS]]) -> (f64, [f64; CORNERS]) {
    let columns = &columns[..columns.len().min(CORNERS)];
    let uniform = [1.0 / CORNERS as f64; CORNERS];
    let values = || columns.iter().flatten().copied();
    let least = values().fold(f64::INFINITY, f64::min);
    let most = values().fold(f64::NEG_INFINITY, f64::max);
    let spread = most - least;
    if !(spread > 0.0 && spread.is_finite()) {
        return (most, uniform);
    }
    // Scaled to [0.1, 1.1]: the value of the game is positive, so weights / value are a linear programme.
    let mut table = [[0.0; WIDTH]; CORNERS + 1];
    for (i, column) in columns.iter().enumerate() {
        for k in 0..CORNERS {
            table[k][i] = (column[k] - least) / spread + 0.1;
        }
        table[CORNERS][i] = 1.0;
    }
    let mut basis = [0; CORNERS];
    for k in 0..CORNERS {
        table[k][CORNERS + k] = 1.0;
        table[k][WIDTH - 1] = 1.0;
        basis[k] = CORNERS + k;
    }
    for _ in 0..PIVOTS {
        let gains = &table[CORNERS][..WIDTH - 1];
        let Some(enter) = (0..WIDTH - 1).filter(|&j| gains[j] > 1e-12).max_by(|&a, &b| gains[a].total_cmp(&gains[b])) else { break };
        let ratio = |k: usize| table[k][WIDTH - 1] / table[k][enter];
        let Some(leave) = (0..CORNERS).filter(|&k| table[k][enter] > 1e-12).min_by(|&a, &b| ratio(a).total_cmp(&ratio(b))) else { break };
        let pivot = 1.0 / table[leave][enter];
        for value in &mut table[leave] {
            *value *= pivot;
        }
        let row = table[leave];
        for (k, other) in table.iter_mut().enumerate() {
            let factor = other[enter];
            if k != leave && factor != 0.0 {
                for (value, by) in other.iter_mut().zip(row) {
                    *value -= factor * by;
                }
            }
        }
        basis[leave] = enter;
    }
    let mut weights = [0.0; CORNERS];
    for k in 0..CORNERS {
        if basis[k] < columns.len() {
            weights[basis[k]] = table[k][WIDTH - 1].max(0.0);
        }
    }
    let mixture: [f64; CORNERS] = std::array::from_fn(|k| (-table[CORNERS][CORNERS + k]).max(0.0));
    let (Some(weights), Some(mixture)) = (normalised(weights), normalised(mixture)) else { return (most, uniform) };
    let bound = (0..CORNERS)
        .map(|k| columns.iter().zip(weights).map(|(column, weight)| column[k] * weight).sum::<f64>())
        .fold(f64::NEG_INFINITY, f64::max);
    (bound, mixture)
}

fn normalised(weights: [f64; CORNERS]) -> Option<[f64; CORNERS]> {
    let total: f64 = weights.iter().sum();
    (total > 0.0 && total.is_finite()).then(|| weights.map(|w| w / total))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A small generator, so that tests need no crate: numbers in [0, 1).
    fn random(state: &mut u64) -> f64 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 11) as f64 / (1u64 << 53) as f64
    }

    #[test]
    fn two_opposite_walls_meet_half_way() {
        // A slab of thickness 3 seen from a unit cell at height 1 to 2: the bound is exactly 1.5.
        let below = std::array::from_fn(|k| 1.0 + (k >> 2) as f64);
        let above = below.map(|z| 3.0 - z);
        let (bound, mixture) = solve(&[below, above]);
        assert!((bound - 1.5).abs() < 1e-14, "{bound}");
        let height: f64 = mixture.iter().zip(below).map(|(w, z)| w * z).sum();
        assert!((height - 1.5).abs() < 1e-14, "{height}");
    }

    #[test]
    fn bound_and_place_agree_on_random_games() {
        let mut state = 7;
        for round in 0..2000 {
            let count = 1 + round % 8;
            let scale = 10f64.powi((round % 13) - 6);
            let columns: Vec<[f64; 8]> = (0..count).map(|_| std::array::from_fn(|_| scale * random(&mut state))).collect();
            let (bound, mixture) = solve(&columns);
            // Weak duality from the other side: the corner mixture guarantees at least this much.
            let floor = columns
                .iter()
                .map(|column| column.iter().zip(mixture).map(|(value, weight)| value * weight).sum::<f64>())
                .fold(f64::INFINITY, f64::min);
            assert!((bound - floor).abs() <= 1e-9 * scale, "game {round}: {bound} and {floor}");
            let single = columns.iter().map(|c| c.iter().copied().fold(0.0, f64::max)).fold(f64::INFINITY, f64::min);
            assert!(bound <= single * (1.0 + 1e-12));
        }
    }
}
