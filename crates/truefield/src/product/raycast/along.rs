//! Where a cell is crossed along a way through it.

/// Parts of the way that a search for the first sign is not divided below.
const FINEST: f64 = 1.0 / 1_099_511_627_776.0;

/// Steps of the search within one crossing.
const STEPS: usize = 60;

/// Trilinear interpolation; coordinates run from 0 to 1.
#[inline(always)]
pub(super) fn trilinear(corners: &[f32; 8], [x, y, z]: [f64; 3]) -> f64 {
    let c = |i: usize| f64::from(corners[i]);
    let row = |i: usize| c(i) + (c(i + 1) - c(i)) * x;
    let (a, b, d, e) = (row(0), row(2), row(4), row(6));
    let (low, high) = (a + (b - a) * y, d + (e - d) * y);
    low + (high - low) * z
}

/// Its slopes along the three axes.
#[inline(always)]
pub(super) fn trilinear_slopes(corners: &[f32; 8], at: [f64; 3]) -> [f64; 3] {
    let c = corners.map(f64::from);
    std::array::from_fn(|axis| {
        let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
        let edge = |low: usize| c[low + (1 << axis)] - c[low];
        let row = |low: usize| edge(low) + (edge(low + (1 << i)) - edge(low)) * at[i];
        row(0) + (row(1 << j) - row(0)) * at[j]
    })
}

/// A cubic from 0 to 1 in Bernstein form, from its values at 0, 1/3, 2/3 and 1.
#[inline(always)]
pub(super) fn bernstein([a, b, c, d]: [f64; 4]) -> [f64; 4] {
    [a, (-5.0 * a + 18.0 * b - 9.0 * c + 2.0 * d) / 6.0, (2.0 * a - 9.0 * b + 18.0 * c - 5.0 * d) / 6.0, d]
}

/// Where a cubic first changes its sign between 0 and 1; zero counts as positive.
///
/// The cubic lies in the hull of its coefficients, so parts of one sign are passed over, and no two crossings are farther
/// apart than what they are told apart by.
#[inline]
pub(super) fn first_root(cubic: [f64; 4]) -> Option<f64> {
    match changes(&cubic) {
        0 => None,
        1 => Some(only_root(&cubic)),
        _ => search(cubic),
    }
}

fn changes(c: &[f64; 4]) -> usize {
    (0..3).filter(|&i| (c[i] < 0.0) != (c[i + 1] < 0.0)).count()
}

/// The same by halving.
#[cold]
fn search(cubic: [f64; 4]) -> Option<f64> {
    let mut stack = [([0.0; 4], 0.0, 0.0); 48];
    let mut count = 1;
    stack[0] = (cubic, 0.0, 1.0);
    while count > 0 {
        count -= 1;
        let (c, from, to) = stack[count];
        match changes(&c) {
            0 => {}
            // One change: one crossing.
            1 => return Some(from + (to - from) * only_root(&c)),
            _ if to - from < FINEST || count + 2 > stack.len() => {
                if (c[0] < 0.0) != (c[3] < 0.0) {
                    return Some(from);
                }
            }
            _ => {
                let (low, high) = halves(&c);
                let middle = 0.5 * (from + to);
                (stack[count], stack[count + 1]) = ((high, middle, to), (low, from, middle));
                count += 2;
            }
        }
    }
    None
}

/// De Casteljau's halves.
fn halves(&[a, b, c, d]: &[f64; 4]) -> ([f64; 4], [f64; 4]) {
    let half = |p: f64, q: f64| 0.5 * (p + q);
    let (ab, bc, cd) = (half(a, b), half(b, c), half(c, d));
    let (abc, bcd) = (half(ab, bc), half(bc, cd));
    let middle = half(abc, bcd);
    ([a, ab, abc, middle], [middle, bcd, cd, d])
}

/// Newton's steps, kept between ends of different signs.
fn only_root(c: &[f64; 4]) -> f64 {
    let value = |t: f64| {
        let s = 1.0 - t;
        ((c[0] * s + 3.0 * c[1] * t) * s + 3.0 * c[2] * t * t) * s + c[3] * t * t * t
    };
    let slope = |t: f64| {
        let s = 1.0 - t;
        3.0 * ((c[1] - c[0]) * s * s + 2.0 * (c[2] - c[1]) * s * t + (c[3] - c[2]) * t * t)
    };
    let (mut low, mut high) = (0.0, 1.0);
    let mut t = if c[0] == c[3] { 0.5 } else { (c[0] / (c[0] - c[3])).clamp(0.0, 1.0) };
    for _ in 0..STEPS {
        let v = value(t);
        if (v < 0.0) == (c[0] < 0.0) {
            low = t;
        } else {
            high = t;
        }
        let next = t - v / slope(t);
        let next = if next > low && next < high { next } else { 0.5 * (low + high) };
        if (next - t).abs() < 1e-15 {
            return next;
        }
        t = next;
    }
    t
}

/// Where a function that changes by no more than `slope` times the way first changes its sign between 0 and `length`; it is
/// of the side `inside` at 0.
///
/// Goes as far as the value says, and no less than a millionth of the way: two crossings nearer to each other may be missed.
pub(super) fn first_change(value: impl Fn(f64) -> f64, length: f64, slope: f64, inside: bool) -> Option<f64> {
    let mut t = 0.0;
    let mut steps = 0;
    while t < length {
        steps += 1;
        let least = if steps < 200 { 1e-6 } else { 1.0 / 64.0 } * length;
        let next = (t + (value(t).abs() / slope).max(least)).min(length);
        if (value(next) < 0.0) != inside {
            let (mut low, mut high) = (t, next);
            for _ in 0..STEPS {
                let middle = 0.5 * (low + high);
                if (value(middle) < 0.0) == inside {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            return Some(high);
        }
        t = next;
    }
    None
}
