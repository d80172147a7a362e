//! Lower bounds where nothing is known, from samples where something is.

use crate::error::{Error, Result};
use crate::lattice::Lattice;
use crate::run::Run;

/// Sweeps there and back; two hand bounds round corners too.
const ROUNDS: usize = 2;

/// Nobody has handed a bound on yet.
const NONE: u32 = u32::MAX;

/// Raises lower bounds that are minus infinity as far as the samples around allow.
///
/// A distance changes by no more than one moves, so a sample q bounds every other: d(p) >= lower(q) - |p - q|. The q
/// that bounds best is handed from neighbour to neighbour, 26 of them, in sweeps along the numbers of the samples and
/// back (as Danielsson 1980 hands on nearest points): not always the best of all, but each bound holds, since |p - q| is
/// computed for the pair itself. Takes 4 bytes a sample, on one thread.
pub(super) fn tighten(lattice: &Lattice, lower: &mut [f32], run: &Run<'_>) -> Result<()> {
    if !lower.contains(&f32::NEG_INFINITY) {
        return Ok(());
    }
    let [nx, ny, nz] = lattice.shape.map(i64::from);
    if lower.len() >= NONE as usize {
        return Err(Error::invalid(format!("{nx} x {ny} x {nz} samples are too many to combine; work on parts of the lattice")));
    }
    let open: Vec<bool> = lower.iter().map(|&v| v == f32::NEG_INFINITY).collect();
    let mut from: Vec<u32> = (0..lower.len() as u32).map(|n| if open[n as usize] { NONE } else { n }).collect();
    let before: Vec<[i64; 3]> = (0..13).map(|n| [n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1]).collect();
    let steps = 2 * ROUNDS * nx as usize;
    for step in 0..steps {
        run.cancel.check()?;
        let (sweep, along) = (step / nx as usize, (step % nx as usize) as i64);
        let sign = if sweep % 2 == 0 { 1 } else { -1 };
        let at = |count: i64, along: i64| if sign > 0 { along } else { count - 1 - along };
        let i = at(nx, along);
        for j in (0..ny).map(|along| at(ny, along)) {
            for k in (0..nz).map(|along| at(nz, along)) {
                let number = ((i * ny + j) * nz + k) as usize;
                if !open[number] {
                    continue;
                }
                // Neighbours mostly have the same source: it is tried once.
                let mut tried = from[number];
                for way in &before {
                    let [a, b, c] = [i + sign * way[0], j + sign * way[1], k + sign * way[2]];
                    if !((0..nx).contains(&a) && (0..ny).contains(&b) && (0..nz).contains(&c)) {
                        continue;
                    }
                    let source = from[((a * ny + b) * nz + c) as usize];
                    if source == NONE || source == tried || source == from[number] {
                        continue;
                    }
                    tried = source;
                    let bound = handed(lattice, lower[source as usize], source, [i, j, k]);
                    if bound > lower[number] {
                        (lower[number], from[number]) = (bound, source);
                    }
                }
            }
        }
        run.progress.report("bound the samples", step + 1, steps);
    }
    Ok(())
}

/// What the bound of sample `source` says of sample `to`, rounded down.
fn handed(lattice: &Lattice, bound: f32, source: u32, to: [i64; 3]) -> f32 {
    let [_, ny, nz] = lattice.shape;
    let row = source / nz;
    let from = [row / ny, row % ny, source % nz];
    let steps: [i64; 3] = std::array::from_fn(|axis| to[axis] - i64::from(from[axis]));
    let way: f64 = (0..3).map(|axis| (steps[axis] as f64 * lattice.spacing[axis]).powi(2)).sum::<f64>().sqrt();
    crate::field::sampled::rounded_down(f64::from(bound) - way * (1.0 + 1e-12))
}
