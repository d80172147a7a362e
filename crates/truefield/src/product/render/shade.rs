//! Colour and light. All arithmetic is in linear light; pictures are stored in sRGB.

use std::sync::LazyLock;

use super::scene::{Finish, Paint, Ramp, Rgb};
use crate::geom::DVec3;

/// Red, green and blue in linear light, 0 to 1.
pub(super) type Light = [f32; 3];

/// Values that are not known.
const UNKNOWN: Rgb = [168, 168, 168];

static DECODE: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|code| {
        let c = code as f64 / 255.0;
        (if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }) as f32
    })
});

/// Linear light of a screen colour.
pub(super) fn decode(colour: Rgb) -> Light {
    colour.map(|code| DECODE[code as usize])
}

/// Screen colour of linear light.
pub(super) fn encode(light: f32) -> u8 {
    let c = light.clamp(0.0, 1.0);
    let s = if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
    (255.0 * s + 0.5) as u8
}

pub(super) fn mix(a: Light, b: Light, t: f32) -> Light {
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) * t)
}

impl Ramp {
    fn light(&self, value: f64) -> Light {
        if value.is_nan() {
            return decode(UNKNOWN);
        }
        let last = self.colours.len() - 1;
        let at = ((value - self.low) / (self.high - self.low)).clamp(0.0, 1.0) * last as f64;
        let index = (at as usize).min(last.saturating_sub(1));
        mix(decode(self.colours[index]), decode(self.colours[(index + 1).min(last)]), (at - index as f64) as f32)
    }
}

impl Paint {
    /// Colour of an element that has no vertices.
    pub(super) fn element(&self, element: usize) -> Light {
        match self {
            Self::PerElement(colours) => decode(colours[element]),
            Self::ValuePerElement(values, ramp) => ramp.light(values[element]),
            Self::Uniform(colour) => decode(*colour),
            Self::PerVertex(_) | Self::ValuePerVertex(..) | Self::ValuePerCorner(..) | Self::Sampled(..) => decode(UNKNOWN),
        }
    }

    /// Colour of a triangle at barycentric coordinates, where the smoothed normal is `normal`, of any length.
    pub(super) fn inside(&self, triangle: usize, corners: [u32; 3], vertices: &[DVec3], at: [f64; 3], normal: DVec3) -> Light {
        let blend = |values: [f64; 3]| values[0] * at[0] + values[1] * at[1] + values[2] * at[2];
        match self {
            Self::PerVertex(colours) => {
                let [a, b, c] = corners.map(|v| decode(colours[v as usize]));
                std::array::from_fn(|i| blend([f64::from(a[i]), f64::from(b[i]), f64::from(c[i])]) as f32)
            }
            Self::ValuePerVertex(values, ramp) => ramp.light(blend(corners.map(|v| values[v as usize]))),
            Self::ValuePerCorner(values, ramp) => ramp.light(blend(values[triangle])),
            Self::Sampled(samples, ramp) => {
                let [a, b, c] = corners.map(|v| vertices[v as usize]);
                // Not the facet's own normal: that of a sliver may point anywhere.
                ramp.light(samples.at(a * at[0] + b * at[1] + c * at[2], normal.normalize_or_zero()))
            }
            _ => self.element(triangle),
        }
    }
}

/// A lamp: unit direction towards it in camera coordinates (right, up, forward), and its strength.
struct Lamp {
    toward: DVec3,
    strength: f64,
}

/// The key lamp is above the viewer's left shoulder, a weak fill lamp on the right; both move with the viewer.
static LAMPS: LazyLock<[Lamp; 2]> = LazyLock::new(|| {
    [(DVec3::new(-0.45, 0.70, -0.80), 0.86), (DVec3::new(0.85, 0.10, -0.50), 0.30)]
        .map(|(toward, strength)| Lamp { toward: toward.normalize(), strength })
});

/// Turns a normal towards the viewer.
pub(super) fn facing(normal: DVec3, to_viewer: DVec3) -> DVec3 {
    if normal.dot(to_viewer) < 0.0 { -normal } else { normal }
}

/// Light from a surface of colour `base`; `normal` and `to_viewer` are unit vectors in camera coordinates, the
/// normal on the viewer's side. Returns the surface's light and its highlight, which adds to it.
pub(super) fn lit(base: Light, normal: DVec3, to_viewer: DVec3, finish: Finish) -> (Light, f32) {
    let mut diffuse = 0.0;
    for lamp in LAMPS.iter() {
        diffuse += lamp.strength * normal.dot(lamp.toward).max(0.0);
    }
    // One highlight, of the key lamp: two would look like two windows.
    let half = (LAMPS[0].toward + to_viewer).normalize_or_zero();
    let highlight = normal.dot(half).max(0.0).powf(f64::from(finish.shininess));
    // The sky is brighter than the ground.
    let ambient = 0.9 + 0.1 * normal.y;
    let amount = finish.ambient * ambient as f32 + finish.diffuse * diffuse as f32;
    (base.map(|c| c * amount), finish.specular * highlight as f32)
}

/// Share of the light that a thin sheet stops when seen at an angle: the way through it grows as one over the cosine.
pub(super) fn sheet_opacity(face_on: f64, cosine: f64) -> f32 {
    (1.0 - (1.0 - face_on).powf(1.0 / cosine.abs().max(0.04))) as f32
}

/// An estimate of how a surface darkens where others are close, kept away from black.
pub(super) fn darken(light: Light, openness: f32) -> Light {
    light.map(|c| c * openness)
}
