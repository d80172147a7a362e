//! The way out of a shape by tangent planes: where several parts have to be left at once, as in the corner between them.

use crate::geom::DVec3;

/// Planes kept: as many as can meet in a corner, and one more.
const PLANES: usize = 4;

/// Places looked at until the way is given up.
const ROUNDS: usize = 16;

/// So far back from the end of a way, as a part of it, planes are met again.
const BACK: f64 = 1e-2;

/// Halvings of a way that leads farther out than it has to.
const HALVES: u32 = 8;

/// A way has to become shorter by this part for another try.
const GAIN: f64 = 1e-2;

/// A half-space that the end of the way has to lie in: `slope . x >= height`, as seen from where the way starts.
#[derive(Clone, Copy)]
struct Plane {
    slope: DVec3,
    height: f64,
}

/// The shortest step found that leads to where `beyond`, positive outside, is at least `clear`: by going where all planes
/// met so far would be left, and adding that of the place where this was not enough. Where it was, planes are met anew
/// from next to the end of the way: those from farther away may have asked for too much.
///
/// It starts by looking at the place that `step` leads to. `beyond` answers how far out a step leads, `slope` the slope of
/// that there.
pub(super) fn shortest(
    clear: f64,
    mut step: DVec3,
    beyond: impl Fn(DVec3) -> Option<f64>,
    slope: impl Fn(DVec3) -> Option<DVec3>,
) -> Option<f64> {
    let met = |at: DVec3| {
        let (out, slope) = (beyond(at)?, slope(at).filter(|slope| slope.is_finite() && *slope != DVec3::ZERO)?);
        // A little beyond the surface, so that places next to it count as left.
        Some((out, Plane { slope, height: 1.5 * clear - out + slope.dot(at) }))
    };
    let (mut planes, mut held) = (Vec::with_capacity(PLANES + 1), Vec::new());
    let mut best = f64::INFINITY;
    for _ in 0..ROUNDS {
        let Some((out, plane)) = met(step) else { break };
        if out < clear {
            planes.push(plane);
        } else {
            // Back to where this way crossed.
            let (mut short, mut long) = (0.0, 1.0);
            for _ in 0..HALVES {
                let middle = 0.5 * (short + long);
                if beyond(step * middle).is_some_and(|out| out >= clear) { long = middle } else { short = middle }
            }
            step *= long;
            let (way, before) = (step.length(), best);
            best = best.min(way);
            if !(way < before * (1.0 - GAIN)) {
                break;
            }
            planes.clear();
            let back = held.iter().map(|plane: &Plane| step - plane.slope * (BACK * way / plane.slope.length()));
            planes.extend(back.filter_map(met).map(|(_, plane)| plane));
        }
        let Some(found) = nearest(&planes) else { break };
        (step, held) = found;
        if planes.len() > PLANES {
            planes.clone_from(&held);
        }
    }
    best.is_finite().then_some(best)
}

/// The shortest vector in all half-spaces, with those it is held by: the longest of the shortest ones of up to three.
fn nearest(planes: &[Plane]) -> Option<(DVec3, Vec<Plane>)> {
    let mut best: Option<(DVec3, Vec<Plane>)> = None;
    let mut offer = |x: Option<DVec3>, held: &[Plane]| {
        let Some(x) = x.filter(|x| x.is_finite()) else { return };
        let slip = 1e-9 * (x.length() + f64::MIN_POSITIVE);
        if planes.iter().all(|plane| plane.slope.dot(x) >= plane.height - slip)
            && best.as_ref().is_none_or(|(y, _)| x.length() < y.length())
        {
            best = Some((x, held.to_vec()));
        }
    };
    for (i, &a) in planes.iter().enumerate() {
        offer(Some(a.slope * (a.height / a.slope.length_squared())), &[a]);
        for (j, &b) in planes[..i].iter().enumerate() {
            offer(on_both(a, b), &[a, b]);
            for &c in &planes[..j] {
                offer(on_all(a, b, c), &[a, b, c]);
            }
        }
    }
    best
}

/// The shortest vector to the line in which two planes meet.
fn on_both(a: Plane, b: Plane) -> Option<DVec3> {
    let (aa, ab, bb) = (a.slope.length_squared(), a.slope.dot(b.slope), b.slope.length_squared());
    let det = aa * bb - ab * ab;
    let (u, w) = ((a.height * bb - b.height * ab) / det, (b.height * aa - a.height * ab) / det);
    (det > 1e-9 * aa * bb).then(|| a.slope * u + b.slope * w)
}

/// The point in which three planes meet.
fn on_all(a: Plane, b: Plane, c: Plane) -> Option<DVec3> {
    let [bc, ca, ab] = [b.slope.cross(c.slope), c.slope.cross(a.slope), a.slope.cross(b.slope)];
    let det = a.slope.dot(bc);
    let size = a.slope.length() * b.slope.length() * c.slope.length();
    (det.abs() > 1e-6 * size).then(|| (bc * a.height + ca * b.height + ab * c.height) / det)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_of_a_box_are_the_way_out() {
        // From outside into the octant x, y, z >= 0: the nearest point of it.
        for p in [DVec3::new(-1.0, 0.5, 2.0), DVec3::new(-1.0, -2.0, 3.0), DVec3::new(-1.0, -0.5, -0.25)] {
            let beyond = |step: DVec3| {
                let q = p + step;
                let axis = q.min_position();
                (q[axis], DVec3::AXES[axis])
            };
            let way = shortest(1e-9, DVec3::ZERO, |step| Some(beyond(step).0), |step| Some(beyond(step).1)).unwrap_or(f64::NAN);
            assert!((way - p.min(DVec3::ZERO).length()).abs() < 1e-8, "{way} from {p}");
        }
    }

    #[test]
    fn there_is_no_way_between_walls_that_face_each_other() {
        let walls = |step: DVec3| Some(-1.0 - step.x.abs());
        let slope = |step: DVec3| Some(DVec3::X * if step.x > 0.0 { -1.0 } else { 1.0 });
        assert_eq!(shortest(1e-9, DVec3::ZERO, walls, slope), None);
    }
}
