//! The medial axis of a sampled field: where the nearest point of the surface jumps.

use crate::error::{Error, Result};
use crate::field::SampledField;
use crate::geom::DVec3;
use crate::run::Run;

/// Which medial axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Where {
    /// The centres of the balls that fit into the solid.
    Inside,
    /// Those of the balls that fit around it.
    Outside,
}

/// Places of the medial axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MedialAxis {
    /// Midpoints of edges of the lattice whose ends have their nearest points apart.
    pub points: Vec<DVec3>,
    /// Distance to the surface there, not signed: the mean of both ends.
    pub radii: Vec<f64>,
    /// The angle in degrees at which the two nearest points are seen.
    pub angles: Vec<f64>,
}

/// The places between neighbouring samples whose nearest points are seen `angle` degrees or more apart.
///
/// A sample's nearest point lies against the gradient, as far as the distance says. Of the eight gradients by differences
/// to neighbours, one along each axis, the one whose length is nearest to one counts: a distance has that slope wherever
/// the medial axis does not run between the samples that are compared. Nearest points must also be two spacings apart:
/// within about two spacings of the surface samples cannot tell. The places are within about three spacings of the medial
/// axis, one and a half where the surface is flat: a measure, not a bound. Samples beyond the band have no nearest point.
pub fn medial_axis(field: &SampledField, side: Where, angle: f64, run: &Run<'_>) -> Result<MedialAxis> {
    if !(angle > 0.0 && angle <= 180.0) {
        return Err(Error::invalid(format!("the angle is {angle}; give degrees above 0, up to 180")));
    }
    let shape = field.lattice().shape.map(|n| n as usize);
    let feet = run.blocks("find nearest points", shape[0], |i| Ok(feet(field, side, i)))?;
    let layer = shape[1] * shape[2];
    let foot = |number: usize| feet[number / layer][number % layer];
    let strides = field.lattice().strides();
    let least = 2.0 * field.lattice().spacing.max_element();
    let limit = angle.to_radians().cos();
    let layers = run.blocks("find the medial axis", shape[0], |i| {
        let mut found = MedialAxis::default();
        for number in i * layer..(i + 1) * layer {
            let Some((radius, from)) = foot(number) else { continue };
            let index = [i, number / shape[2] % shape[1], number % shape[2]];
            for axis in 0..3 {
                if index[axis] + 1 == shape[axis] {
                    continue;
                }
                let next = number + strides[axis];
                let Some((other, to)) = foot(next) else { continue };
                let middle = (field.lattice().node(number) + field.lattice().node(next)) * 0.5;
                let (a, b) = (from - middle, to - middle);
                let cosine = a.dot(b) / (a.length() * b.length());
                if cosine <= limit && (from - to).length() > least {
                    found.points.push(middle);
                    found.radii.push(0.5 * (radius + other));
                    found.angles.push(cosine.clamp(-1.0, 1.0).acos().to_degrees());
                }
            }
        }
        Ok(found)
    })?;
    let mut all = MedialAxis::default();
    for layer in layers {
        all.points.extend(layer.points);
        all.radii.extend(layer.radii);
        all.angles.extend(layer.angles);
    }
    Ok(all)
}

/// The distance and nearest point of each sample of layer `i` that is on the side and within the band.
fn feet(field: &SampledField, side: Where, i: usize) -> Vec<Option<(f64, DVec3)>> {
    let lattice = field.lattice();
    let [_, ny, nz] = lattice.shape.map(|n| n as usize);
    let strides = lattice.strides();
    let sign = if side == Where::Inside { -1.0 } else { 1.0 };
    let value = |number: usize| sign * f64::from(field.values()[number]);
    let band = f64::from(field.band() as f32);
    let usable = |radius: f64| radius.is_finite() && radius < band;
    let foot = |number: usize| {
        let radius = value(number);
        if radius <= 0.0 || !usable(radius) {
            return None;
        }
        let index = [i, number / nz % ny, number % nz];
        // Differences to the samples before and after along each axis; the same where there is only one.
        let mut slopes = [[0.0; 2]; 3];
        for axis in 0..3 {
            let at = index[axis];
            let before = (at > 0).then(|| (radius - value(number - strides[axis])) / lattice.spacing[axis]);
            let after = (at + 1 < lattice.shape[axis] as usize).then(|| (value(number + strides[axis]) - radius) / lattice.spacing[axis]);
            slopes[axis] = [before.or(after).unwrap_or(0.0), after.or(before).unwrap_or(0.0)];
        }
        let corner = |octant: usize| DVec3::from_array(std::array::from_fn(|axis| slopes[axis][octant >> axis & 1]));
        let flaw = |octant: &usize| (corner(*octant).length_squared() - 1.0).abs();
        let octant = (0..8).min_by(|a, b| flaw(a).total_cmp(&flaw(b))).unwrap_or(0);
        let direction = corner(octant).try_normalize()?;
        Some((radius, lattice.node(number) - direction * radius))
    };
    (i * ny * nz..(i + 1) * ny * nz).map(foot).collect()
}
