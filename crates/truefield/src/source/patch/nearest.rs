//! The nearest point of patches, and the proof that none is nearer.
//!
//! The search goes down the tree, the nearest box first. Of a part over which the squared distance is certain to be convex,
//! Newton's method finds the nearest point, and how much lower any other can be follows from the slope that is left. Parts of
//! which that is not certain, next to collapsed edges or where much of the surface is as near, are taken apart at the end.

use std::collections::BinaryHeap;

use super::bends::{Convex, End};
use super::tree::{Half, NONE, PART, Part, Tree, WIDTH};
use crate::geom::DVec3;
use crate::simd::{Fuse, multiversion};
use crate::source::waiting::Waiting;

/// Newton steps of a part that is convex; mostly two or three are enough.
const STEPS: usize = 12;

/// Points that are looked at in a part that is not.
const WALK: usize = 5;

/// Of what is asked for: beyond it, a step costs little and the answers are good to rounding.
const GOAL: f64 = 1.0 / 64.0;

/// Pieces that one search keeps at most.
const MOST: usize = 20_000;

/// Pieces that it makes at most where values are asked for, in some seconds.
const DEEPEST: usize = 1_000_000;

/// What a search does about points that much of the surface is nearly as far from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Effort {
    /// It is cut off: bounds hold, and may be far apart.
    Short,
    /// It goes on, depth first, at fifty times the pieces.
    Whole,
}

/// What waits at most: a tree of four billion patches is 16 nodes deep.
const DEPTH: usize = 16 * WIDTH;

/// The nearest point found, and lengths.
#[derive(Clone, Copy, Debug)]
pub(super) struct Foot {
    /// No point is nearer.
    pub lower: f64,
    /// A point is no farther.
    pub upper: f64,
    /// Between both: the best guess.
    pub value: f64,
    pub point: DVec3,
    /// Where it lies, if it was found in a convex part: the patch, u and v.
    pub place: Option<(u32, [f64; 2])>,
}

/// The nearest point so far; lengths are squared.
#[derive(Clone, Copy, Debug)]
struct Found {
    /// No point of what was looked at is nearer.
    lower: f64,
    /// A point is no farther.
    upper: f64,
    /// Between both: the best guess.
    square: f64,
    point: DVec3,
    place: Option<(u32, [f64; 2])>,
}

multiversion!(
    /// The nearest point, its distance to `accuracy` wherever the search can be brought to an end.
    pub(super) fn nearest(tree: &Tree, p: DVec3, accuracy: f64, effort: Effort) -> Foot = nearest_body
);

#[inline(always)]
fn nearest_body<F: Fuse>(tree: &Tree, p: DVec3, accuracy: f64, effort: Effort) -> Foot {
    let mut best = Found { lower: f64::INFINITY, upper: f64::INFINITY, square: f64::INFINITY, point: DVec3::NAN, place: None };
    let mut rest = Vec::new();
    let mut stack = [(0.0, 0); DEPTH];
    (stack[0].1, stack[0].0) = (tree.root, 0.0);
    let mut height = 1;
    while height > 0 {
        height -= 1;
        let (bound, item) = stack[height];
        if bound >= best.upper {
            continue;
        }
        let (mut least, mut node) = (bound, item);
        if item & PART != 0 {
            let part = &tree.parts[(item & !PART) as usize];
            least = least.max(part.oriented.distance_squared(p));
            if least >= best.upper {
                continue;
            }
            if part.node == NONE {
                if !part.solve(tree, p, accuracy, &mut best) {
                    rest.push((least, item & !PART));
                }
                continue;
            }
            if part.solve_inside(tree, p, accuracy, &mut best) {
                continue;
            }
            node = part.node;
        }
        let node = &tree.nodes[node as usize];
        let squared = node.distances_squared(p);
        let first = height;
        for lane in 0..WIDTH {
            let bound = squared[lane].max(least);
            if bound < best.upper {
                // The nearest on top.
                let mut place = height;
                while place > first && stack[place - 1].0 < bound {
                    stack[place] = stack[place - 1];
                    place -= 1;
                }
                stack[place] = (bound, node.children[lane]);
                height += 1;
            }
        }
    }
    best.lower = best.lower.min(best.upper);
    rest.retain(|(bound, _)| *bound < best.upper);
    if !rest.is_empty() {
        take_apart(tree, p, accuracy, effort, &rest, &mut best);
    }
    let rounding = rounding(tree, p.abs().max_element());
    let lower = (best.lower.max(0.0).sqrt() - rounding).max(0.0);
    Foot { lower, upper: best.upper.sqrt() + rounding, value: best.square.sqrt(), point: best.point, place: best.place }
}

/// What rounding may do to distances of points with coordinates as large as that.
pub(super) fn rounding(tree: &Tree, size: f64) -> f64 {
    64.0 * f64::EPSILON * (size + tree.size)
}

impl Found {
    /// Takes a point of the patches into account.
    #[inline(always)]
    fn see(&mut self, point: DVec3, p: DVec3) {
        let square = (point - p).length_squared();
        self.upper = self.upper.min(square);
        if square < self.square {
            (self.square, self.point, self.place) = (square, point, None);
        }
    }

    #[inline(always)]
    fn take(&mut self, other: &Self) {
        let (lower, upper) = (self.lower.min(other.lower), self.upper.min(other.upper));
        if other.square < self.square {
            *self = *other;
        }
        (self.lower, self.upper) = (lower, upper);
    }
}

/// Newton's method over a part that is convex as seen from `p`, or over the ends at which the nearest point lies; whether the
/// goal was reached, or nothing nearer is there.
#[inline(always)]
fn newton(tree: &Tree, part: &Part, p: DVec3, ends: [Option<End>; 2], convex: &Convex, accuracy: f64, best: &mut Found) -> bool {
    let goal = accuracy * GOAL;
    let net = &tree.nets[part.patch as usize];
    let size = p.abs().max(part.middle.at.abs()).max_element();
    let (mut low, mut high) = (part.low, part.high);
    for k in 0..2 {
        match ends[k] {
            Some(End::Low) => high[k] = low[k],
            Some(End::High) => low[k] = high[k],
            None => {}
        }
    }
    let mut t = part.start(p, low, high);
    for _ in 0..STEPS {
        let here = net.derivatives(t);
        let way = here.at - p;
        let square = way.length_squared();
        let lengths = [here.u.length(), here.v.length()];
        let slope = [way.dot(here.u), way.dot(here.v)];
        let held: [bool; 2] = std::array::from_fn(|k| t[k] <= low[k] && slope[k] >= 0.0 || t[k] >= high[k] && slope[k] <= 0.0);
        // Way and derivatives are rounded.
        let noise = 32.0 * f64::EPSILON * (size + way.abs().max_element());
        let left: [f64; 2] = std::array::from_fn(|k| if held[k] { 0.0 } else { slope[k].abs() } + noise * lengths[k]);
        let fall = 2.0 * convex.fall(left);
        if square - fall >= best.upper {
            return true;
        }
        let bend = [lengths[0] * lengths[0] + way.dot(here.uu), lengths[1] * lengths[1] + way.dot(here.vv)];
        let mixed = here.u.dot(here.v) + way.dot(here.uv);
        let step = step(slope, bend, mixed, held, std::array::from_fn(|k| [low[k] - t[k], high[k] - t[k]]));
        let far = square.sqrt();
        if far <= goal || fall <= goal * (2.0 * far - goal) {
            let lower = (square - fall).max(0.0);
            // One more step, by the derivatives that are known.
            let [s, r] = step;
            let change = 2.0 * (slope[0] * s + slope[1] * r) + bend[0] * s * s + 2.0 * mixed * s * r + bend[1] * r * r;
            let point = here.at + (here.u * s + here.v * r) + (here.uu * (0.5 * s * s) + here.uv * (s * r) + here.vv * (0.5 * r * r));
            let place = [t[0] + s, t[1] + r];
            let square_there = (square + change).clamp(lower, square);
            best.take(&Found { lower, upper: square, square: square_there, point, place: Some((part.patch, place)) });
            return true;
        }
        let next: [f64; 2] = std::array::from_fn(|k| (t[k] + step[k]).clamp(low[k], high[k]));
        if next == t {
            return false;
        }
        t = next;
    }
    false
}

/// Newton's step within a rectangle, where what is held stays.
#[inline(always)]
fn step(slope: [f64; 2], bend: [f64; 2], mixed: f64, held: [bool; 2], room: [[f64; 2]; 2]) -> [f64; 2] {
    let within = |k: usize, step: f64| step.max(room[k][0]).min(room[k][1]);
    let alone = |k: usize, other: f64| within(k, -(slope[k] + mixed * other) / bend[k]);
    match held {
        [true, true] => [0.0; 2],
        [true, false] => [0.0, alone(1, 0.0)],
        [false, true] => [alone(0, 0.0), 0.0],
        [false, false] => {
            let inverse = 1.0 / (bend[0] * bend[1] - mixed * mixed);
            let both = [(mixed * slope[1] - bend[1] * slope[0]) * inverse, (mixed * slope[0] - bend[0] * slope[1]) * inverse];
            let kept = [within(0, both[0]), within(1, both[1])];
            if kept[0] != both[0] {
                [kept[0], alone(1, kept[0])]
            } else if kept[1] != both[1] {
                [alone(0, kept[1]), kept[1]]
            } else {
                kept
            }
        }
    }
}

impl Part {
    /// Takes the nearest point of the part into account; whether that is certain.
    #[inline(always)]
    fn solve(&self, tree: &Tree, p: DVec3, accuracy: f64, best: &mut Found) -> bool {
        self.solve_inside(tree, p, accuracy, best)
            || self.bends.at_edge(p).is_some_and(|(ends, convex)| newton(tree, self, p, ends, &convex, accuracy, best))
    }

    /// The same where the part is convex as seen from `p`; elsewhere looks at its middle.
    #[inline(always)]
    fn solve_inside(&self, tree: &Tree, p: DVec3, accuracy: f64, best: &mut Found) -> bool {
        let Some(convex) = self.bends.convex(p) else {
            best.see(self.middle.at, p);
            return false;
        };
        self.tangent(p) >= best.upper || newton(tree, self, p, [None; 2], &convex, accuracy, best)
    }

    /// Looks at some points on the way to the nearest one, where no bound on bends leads there.
    fn walk(&self, tree: &Tree, p: DVec3, best: &mut Found) {
        let mut t = [0.5 * (self.low[0] + self.high[0]), 0.5 * (self.low[1] + self.high[1])];
        for _ in 0..WALK {
            let here = tree.nets[self.patch as usize].derivatives(t);
            best.see(here.at, p);
            let way = here.at - p;
            // By first derivatives only, and never singular.
            let squares = [here.u.length_squared(), here.v.length_squared()];
            let more = 1e-9 * (squares[0] + squares[1]) + f64::MIN_POSITIVE;
            let room = std::array::from_fn(|k| [self.low[k] - t[k], self.high[k] - t[k]]);
            let slope = [way.dot(here.u), way.dot(here.v)];
            let step = step(slope, squares.map(|square| square + more), here.u.dot(here.v), [false; 2], room);
            t = std::array::from_fn(|k| (t[k] + step[k]).clamp(self.low[k], self.high[k]));
        }
    }

    /// The least squared distance along the tangent in the middle.
    #[inline(always)]
    fn tangent(&self, p: DVec3) -> f64 {
        let middle = &self.middle;
        let way = middle.at - p;
        let fall = way.dot(middle.u).abs() * (self.high[0] - self.low[0]) + way.dot(middle.v).abs() * (self.high[1] - self.low[1]);
        way.length_squared() - fall - self.noise(p, way)
    }

    /// No more than the squared distance to any of its points: the tangent, less how it bends at most away from it; or the
    /// expansion of second order, less how second derivatives differ: where a curve of points is as near, that loses the third
    /// power of the size only.
    fn least(&self, p: DVec3) -> f64 {
        let size = [self.high[0] - self.low[0], self.high[1] - self.low[1]];
        let (way, slope, [uu, vv], uv) = self.expansion(p);
        let [below_tangent, below_square] = self.bends.droop(p, size, [uu, vv, uv]);
        let [x, y] = size.map(|size| 0.5 * size);
        let noise = self.noise(p, way) + 1e-14 * (uu.abs() * x * x + vv.abs() * y * y + 2.0 * uv.abs() * x * y);
        let square = way.length_squared() + least_square(slope, [uu, vv], uv, [x, y]) - below_square - noise;
        square.max(self.tangent(p) - below_tangent)
    }

    /// The way to the middle, the slope of half the squared distance there, and its second derivatives along u u, v v and u v.
    #[inline(always)]
    fn expansion(&self, p: DVec3) -> (DVec3, [f64; 2], [f64; 2], f64) {
        let middle = &self.middle;
        let way = middle.at - p;
        let bend = [middle.u.length_squared() + way.dot(middle.uu), middle.v.length_squared() + way.dot(middle.vv)];
        (way, [way.dot(middle.u), way.dot(middle.v)], bend, middle.u.dot(middle.v) + way.dot(middle.uv))
    }

    /// What rounding does to squared distances of its points.
    #[inline(always)]
    fn noise(&self, p: DVec3, way: DVec3) -> f64 {
        64.0 * f64::EPSILON * (p.abs().max_element() + self.middle.at.abs().max_element()) * (way.length() + self.reach)
    }

    /// Where Newton's method starts: after one step from the middle.
    #[inline(always)]
    fn start(&self, p: DVec3, low: [f64; 2], high: [f64; 2]) -> [f64; 2] {
        let (_, slope, bend, mixed) = self.expansion(p);
        let center = [0.5 * (self.low[0] + self.high[0]), 0.5 * (self.low[1] + self.high[1])];
        let room = [[low[0] - center[0], high[0] - center[0]], [low[1] - center[1], high[1] - center[1]]];
        let step = step(slope, bend, mixed, [false; 2], room);
        // Not beyond the ends by rounding.
        [(center[0] + step[0]).clamp(low[0], high[0]), (center[1] + step[1]).clamp(low[1], high[1])]
    }
}

/// The least of 2 s t + t B t for t within a rectangle around 0 of these half sizes, with s a slope and B second derivatives.
///
/// If it is not on an edge, it is where the slope vanishes.
fn least_square(slope: [f64; 2], bend: [f64; 2], mixed: f64, half: [f64; 2]) -> f64 {
    let at = |t: [f64; 2]| (0..2).map(|k| (2.0 * slope[k] + bend[k] * t[k]) * t[k]).sum::<f64>() + 2.0 * mixed * t[0] * t[1];
    let mut least = f64::INFINITY;
    for k in 0..2 {
        for held in [-half[k], half[k]] {
            let along = -(slope[1 - k] + mixed * held) / bend[1 - k];
            for free in [-half[1 - k], half[1 - k], along.clamp(-half[1 - k], half[1 - k])] {
                if free.is_finite() {
                    least = least.min(at(if k == 0 { [held, free] } else { [free, held] }));
                }
            }
        }
    }
    let determinant = bend[0] * bend[1] - mixed * mixed;
    let still = [0, 1].map(|k| (mixed * slope[1 - k] - bend[1 - k] * slope[k]) / determinant);
    if !(determinant > 0.0 && still[0].abs() < half[0] && still[1].abs() < half[1]) {
        return least;
    }
    // Where the determinant is a small difference, rounding leaves a slope; what is convex lies above its tangent there.
    let left = |k: usize| 2.0 * (slope[k] + bend[k] * still[k] + mixed * still[1 - k]).abs() * (half[k] + still[k].abs());
    least.min(at(still) - left(0) - left(1))
}

/// Goes on with parts that no bound decided, halving them, the nearest first.
#[inline(never)]
fn take_apart(tree: &Tree, p: DVec3, accuracy: f64, effort: Effort, rest: &[(f64, u32)], best: &mut Found) {
    let mut heap = BinaryHeap::new();
    let mut halves: Vec<Half> = Vec::new();
    let (mut deep, mut made) = (Vec::new(), 0);
    for (number, &(bound, part)) in rest.iter().enumerate() {
        heap.push(Waiting { bound, number, item: number });
        halves.push(tree.half(&tree.parts[part as usize]));
    }
    while let Some(Waiting { bound, item, .. }) = heap.pop() {
        if is_reached(bound, accuracy, best) {
            best.lower = best.lower.min(bound);
            break;
        }
        if halves.len() <= MOST {
            let whole = halves[item].clone();
            cut(tree, p, accuracy, bound, &whole, best, |bound, half| {
                heap.push(Waiting { bound, number: halves.len(), item: halves.len() });
                halves.push(half);
            });
        } else if effort == Effort::Short {
            best.lower = best.lower.min(bound);
            break;
        } else {
            deep.push((bound, halves[item].clone()));
            // Depth first, which takes no room.
            while let Some((bound, half)) = deep.pop() {
                if is_reached(bound, accuracy, best) || made > DEEPEST {
                    best.lower = best.lower.min(bound);
                } else {
                    made += 2;
                    cut(tree, p, accuracy, bound, &half, best, |bound, half| deep.push((bound, half)));
                }
            }
        }
    }
    best.lower = best.lower.min(best.upper);
    best.square = best.square.clamp(best.lower, best.upper);
}

/// Whether a squared lower bound is as good as wanted.
fn is_reached(bound: f64, accuracy: f64, best: &Found) -> bool {
    bound.max(0.0).sqrt() >= best.upper.sqrt() - accuracy
}

/// Halves a part whose squared lower bound is known, and hands out what no bound decides.
fn cut(tree: &Tree, p: DVec3, accuracy: f64, bound: f64, whole: &Half, best: &mut Found, mut keep: impl FnMut(f64, Half)) {
    for half in whole.halves() {
        let part = tree.part(&half);
        let boxes = half.piece.extent().distance_squared(p) * (1.0 - 8.0 * f64::EPSILON);
        let bound = bound.max(boxes).max(part.oriented.distance_squared(p)).max(part.least(p));
        if is_reached(bound, accuracy, best) {
            best.lower = best.lower.min(bound);
        } else if !part.solve(tree, p, accuracy, best) {
            part.walk(tree, p, best);
            keep(bound, half);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laws::Random;

    #[test]
    fn nothing_is_below_the_least_of_a_square_that_hardly_bends_one_way() {
        let mut random = Random::new(3);
        for _ in 0..20_000 {
            let mut within = || random.within(&crate::geom::Aabb::new(DVec3::NEG_ONE, DVec3::ONE));
            let (t, of) = (within(), within());
            let mixed = 2.0 * of.x;
            let bend = [1.0, mixed * mixed + 10.0_f64.powf(7.5 * (of.y - 1.0))];
            let slope = [-(t.x + mixed * t.y), -(mixed * t.x + bend[1] * t.y)];
            let there = 2.0 * (slope[0] * t.x + slope[1] * t.y) + t.x * t.x + bend[1] * t.y * t.y + 2.0 * mixed * t.x * t.y;
            let least = least_square(slope, bend, mixed, [1.0, 1.0]);
            assert!(least <= there + 4e-14, "{least:e} is above {there:e}, by {:e}", least - there);
        }
    }
}
