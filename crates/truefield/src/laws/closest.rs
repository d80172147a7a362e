//! The laws of [`Closest`].

use super::broken::{Broken, Law, hold};
use crate::distance::Closest;
use crate::geom::{DVec3, Feature, Nearest};

/// The elements of a source, for a judge that asks every one of them.
pub trait Elements {
    /// How many there are.
    fn count(&self) -> u32;

    /// The squared distance from `p` to one of them; its bits decide what is a tie.
    fn distance_squared(&self, element: u32, p: DVec3) -> f64;

    /// The plain distance from `p` to the given part of an element.
    fn feature_distance(&self, element: u32, feature: Feature, p: DVec3) -> f64;
}

/// All laws of [`Closest`] against a judge that asks every element.
///
/// `allowance` is the rounding that is forgiven, a length.
pub fn check_closest<S: Closest + ?Sized>(source: &S, elements: &impl Elements, points: &[DVec3], allowance: f64) -> Result<(), Broken> {
    for &p in points {
        let Some(nearest) = source.nearest(p, f64::INFINITY) else {
            return Err(Broken { law: Law::Within, at: p, found: "nothing within an infinite distance".into() });
        };
        check_stated(source, p, &nearest, allowance)?;
        check_element(elements, p, &nearest, allowance)?;
        check_nearest(elements, p, &nearest, allowance)?;
        check_within(source, p, &nearest)?;
    }
    Ok(())
}

fn check_stated<S: Closest + ?Sized>(source: &S, p: DVec3, nearest: &Nearest, allowance: f64) -> Result<(), Broken> {
    let apart = (nearest.point - p).length();
    let allowance = allowance + 4.0 * f64::EPSILON * (nearest.point.length() + p.length());
    let holds = (apart - nearest.distance.abs()).abs() <= allowance;
    hold(Law::Stated, p, holds, || format!("{nearest:?} is {apart:?} away"))?;
    let at = source.at(p);
    hold(Law::Stated, p, at.contains(nearest.distance), || format!("{nearest:?} but at says {at:?}"))
}

fn check_element(elements: &impl Elements, p: DVec3, nearest: &Nearest, allowance: f64) -> Result<(), Broken> {
    let Nearest { element, feature, point, .. } = *nearest;
    hold(Law::Element, p, element < elements.count(), || format!("element {element} of {}", elements.count()))?;
    let allowance = allowance + 4.0 * f64::EPSILON * point.length();
    let off = elements.feature_distance(element, feature, point);
    hold(Law::Element, p, off <= allowance, || format!("{nearest:?} is {off:?} off its element's {feature:?}"))
}

fn check_nearest(elements: &impl Elements, p: DVec3, nearest: &Nearest, allowance: f64) -> Result<(), Broken> {
    let squared = elements.distance_squared(nearest.element, p);
    let own = squared.sqrt();
    let stated = nearest.distance.abs();
    hold(Law::Nearest, p, (own - stated).abs() <= allowance, || format!("{nearest:?} but its element is {own:?} away"))?;
    for other in 0..elements.count() {
        let distance = elements.distance_squared(other, p);
        let nearer = distance.sqrt() < own - allowance || distance == squared && other < nearest.element;
        hold(Law::Nearest, p, !nearer, || format!("{nearest:?} but element {other} is {:?} away, not {own:?}", distance.sqrt()))?;
    }
    Ok(())
}

fn check_within<S: Closest + ?Sized>(source: &S, p: DVec3, nearest: &Nearest) -> Result<(), Broken> {
    let distance = nearest.distance.abs();
    let reach = [distance, distance.next_up(), distance * 1.000_001, distance * 2.0 + f64::MIN_POSITIVE];
    for within in reach {
        let found = source.nearest(p, within);
        hold(Law::Within, p, found == Some(*nearest), || format!("{found:?} within {within:?} instead of {nearest:?}"))?;
    }
    if distance > 0.0 {
        for within in [0.0, distance * 0.5, distance * 0.999_999, distance.next_down()] {
            let found = source.nearest(p, within);
            hold(Law::Within, p, found.is_none(), || format!("{found:?} within {within:?}, though it is farther"))?;
        }
    }
    Ok(())
}

/// The normal is a unit vector and, away from the medial axis and from the surface itself, the
/// gradient of the signed distance by central differences with steps of `step`.
///
/// Returns how many points were far enough from both to be judged.
pub fn check_normal<S: Closest + ?Sized>(source: &S, points: &[DVec3], step: f64) -> Result<usize, Broken> {
    let mut judged = 0;
    for &p in points {
        let Some(nearest) = source.nearest(p, f64::INFINITY) else { continue };
        let length = nearest.normal.length();
        hold(Law::Normal, p, (length - 1.0).abs() <= 1e-9, || format!("{nearest:?} has a normal of length {length:?}"))?;
        let value = |q: DVec3| source.nearest(q, f64::INFINITY).map_or(f64::NAN, |n| n.distance);
        let gradient = DVec3::from_array(DVec3::AXES.map(|axis| (value(p + axis * step) - value(p - axis * step)) / (2.0 * step)));
        // Where two sides compete, or the surface is crossed at a corner, differences mix two gradients.
        if nearest.distance.abs() < 100.0 * step || (gradient.length() - 1.0).abs() > 1e-3 {
            continue;
        }
        judged += 1;
        let holds = gradient.dot(nearest.normal) > 0.995;
        hold(Law::Normal, p, holds, || format!("{nearest:?} where differences give {gradient:?}"))?;
    }
    Ok(judged)
}
