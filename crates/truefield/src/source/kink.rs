//! What is known, between samples, of the least of several numbers where it passes from one to another.
//!
//! Let F be the least of a_1 .. a_n, I linear interpolation in a box, l_i <= a_i - I(a_i) <= u_i, and M what is said,
//! linear along each axis of the box. With t_i = a_i - M at the corners:
//! 1. F - M <= a_i - M <= I(t_i) + u_i for every i, and so for every mean of two of them, which is largest at a corner.
//!    Where a seam crosses a box, the best mean is next to what the samples already differ by: interpolation of the lesser
//!    of two straight slopes is off by no more than that.
//! 2. F is one of the a_i, and a_i - M >= I(t_i) + l_i: interpolation makes no valleys deeper.

use crate::distance::{SampleBlock, Source};
use crate::error::Result;
use crate::geom::Interval;

/// A number that may be the least somewhere in a block.
pub(crate) struct Operand {
    /// At the nodes.
    pub values: Vec<f64>,
    /// Contains it minus its interpolation, for each box.
    pub between: Vec<Interval>,
}

impl Operand {
    /// The value of a shape.
    pub fn of(shape: &dyn Source, block: &SampleBlock<'_>) -> Result<Self> {
        let mut values = vec![0.0; block.points.len()];
        shape.values(block.points, &mut values)?;
        let mut between = vec![Interval::ALL; block.len()];
        shape.residual(&block.with(&values, &values), &mut between)?;
        Ok(Self { values, between })
    }

    /// Known values of a number that changes by no more than one moves, but for noise, and bends by so much in the block.
    pub fn bent(values: Vec<f64>, bend: Interval, noise: f64, block: &SampleBlock<'_>) -> Self {
        Self { values, between: vec![block.between(bend, noise); block.len()] }
    }
}

/// How the least passes from one to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Seam {
    /// At once.
    Sharp,
    /// As (a + b) / 2 - f(a - b) of two, with f convex, |f'| <= 1/2 and this bound of f''.
    Smooth(f64),
}

/// Narrows, for each box, what contains the least of the operands minus what is said; the least has the block's values.
pub(crate) fn least(block: &SampleBlock<'_>, operands: &[Operand], seam: Seam, out: &mut [Interval]) {
    block.each_box(|number, corners| {
        let found = match seam {
            Seam::Sharp => sharp(block, operands, number, &corners),
            Seam::Smooth(curve) => smooth(block, operands, number, &corners, curve),
        };
        out[number] = out[number].intersection(found);
    });
}

/// [`least`] of the greatest.
pub(crate) fn greatest(block: &SampleBlock<'_>, operands: &mut [Operand], seam: Seam, out: &mut [Interval]) {
    let [values, said] = [block.values, block.said].map(|numbers| numbers.iter().map(|number| -number).collect::<Vec<f64>>());
    for operand in operands.iter_mut() {
        operand.values.iter_mut().for_each(|value| *value = -*value);
        operand.between.iter_mut().for_each(|between| *between = between.negated());
    }
    out.iter_mut().for_each(|out| *out = out.negated());
    least(&block.with(&values, &said), operands, seam, out);
    out.iter_mut().for_each(|out| *out = out.negated());
}

fn sharp(block: &SampleBlock<'_>, operands: &[Operand], number: usize, corners: &[usize; 8]) -> Interval {
    if operands.is_empty() {
        return Interval::ALL;
    }
    let mut lower = f64::INFINITY;
    // The two with the least bounds: what they may exceed what is said by at the corners, and the larger of that.
    let mut best = [(f64::INFINITY, [0.0; 8]); 2];
    for operand in operands {
        let Interval { lower: below, upper: above } = operand.between[number];
        let apart = corners.map(|node| operand.values[node] - block.said[node]);
        let least = apart.iter().copied().fold(f64::INFINITY, f64::min) + below;
        lower = if least.is_nan() || apart.iter().any(|apart| apart.is_nan()) { f64::NEG_INFINITY } else { lower.min(least) };
        let apart = apart.map(|apart| apart + above);
        let most = apart.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        if most < best[0].0 {
            best = [(most, apart), best[0]];
        } else if most < best[1].0 {
            best[1] = (most, apart);
        }
    }
    let [(first, a), (second, b)] = best;
    let upper = if second < f64::INFINITY { first.min(mean(&a, &b)) } else { first };
    Interval { lower, upper }
}

/// The largest of the means of two numbers at each corner, for the weights that make it least, nearly.
fn mean(a: &[f64; 8], b: &[f64; 8]) -> f64 {
    let highest = |share: f64| {
        (0..8).fold((f64::NEG_INFINITY, 0), |best, corner| {
            let mean = share * a[corner] + (1.0 - share) * b[corner];
            if mean > best.0 { (mean, corner) } else { best }
        })
    };
    // Convex in the share: between two corners, one of which falls with it and one rises, the lines' meeting point is better.
    let (from_b, from_a) = (highest(0.0), highest(1.0));
    let (mut falls, mut rises) = (from_b.1, from_a.1);
    let mut least = from_a.0.min(from_b.0);
    for _ in 0..3 {
        let (down, up) = (b[falls] - a[falls], a[rises] - b[rises]);
        if !(down > 0.0 && up > 0.0) {
            break;
        }
        let (bound, corner) = highest((b[falls] - b[rises]) / (down + up));
        least = least.min(bound);
        if a[corner] < b[corner] { falls = corner } else { rises = corner }
    }
    least
}

/// The mean of f exceeds f of the mean by no more than half its bend times how the difference varies.
fn smooth(block: &SampleBlock<'_>, operands: &[Operand], number: usize, corners: &[usize; 8], curve: f64) -> Interval {
    let [a, b] = operands else { return Interval::ALL };
    let range = |values: [f64; 8]| Interval {
        lower: values.into_iter().fold(f64::INFINITY, f64::min),
        upper: values.into_iter().fold(f64::NEG_INFINITY, f64::max),
    };
    let difference = range(corners.map(|node| a.values[node] - b.values[node])).width();
    let fill = 0.125 * curve * difference * difference * (1.0 + 1e-12);
    let apart = range(corners.map(|node| block.values[node] - block.said[node]));
    apart.plus(a.between[number].hull(b.between[number])).plus(Interval { lower: 0.0, upper: fill })
}
