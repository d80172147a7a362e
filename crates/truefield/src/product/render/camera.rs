//! Where the viewer stands, and how points become pixels.

use crate::error::{Error, Result};
use crate::geom::DVec3;

/// From where the scene is seen. The z axis points up, the front of a part is the side of low y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum View {
    /// From the right, the front and above, along the diagonal of a cube.
    Isometric,
    /// From low y.
    Front,
    /// From high y.
    Back,
    /// From low x.
    Left,
    /// From high x.
    Right,
    /// From high z.
    Top,
    /// From low z.
    Bottom,
    /// Looking along `direction`, with `up` upward in the picture.
    Along {
        /// From the viewer into the scene; any length but zero.
        direction: DVec3,
        /// Not parallel to `direction`; need not be perpendicular to it.
        up: DVec3,
    },
}

impl View {
    /// A view by its lower-case name: "isometric", "front", "back", "left", "right", "top" or "bottom".
    pub fn named(name: &str) -> Result<Self> {
        Ok(match name {
            "isometric" => Self::Isometric,
            "front" => Self::Front,
            "back" => Self::Back,
            "left" => Self::Left,
            "right" => Self::Right,
            "top" => Self::Top,
            "bottom" => Self::Bottom,
            _ => {
                return Err(Error::invalid(format!(
                    "there is no view called {name:?}; use isometric, front, back, left, right, top or bottom, or a direction"
                )));
            }
        })
    }

    /// Unit vectors right, up and forward.
    fn frame(self) -> Result<[DVec3; 3]> {
        let (direction, up) = match self {
            Self::Isometric => (DVec3::new(-1.0, 1.0, -1.0), DVec3::Z),
            Self::Front => (DVec3::Y, DVec3::Z),
            Self::Back => (DVec3::NEG_Y, DVec3::Z),
            Self::Left => (DVec3::X, DVec3::Z),
            Self::Right => (DVec3::NEG_X, DVec3::Z),
            Self::Top => (DVec3::NEG_Z, DVec3::Y),
            Self::Bottom => (DVec3::Z, DVec3::NEG_Y),
            Self::Along { direction, up } => (direction, up),
        };
        let (forward, upward) = (direction.try_normalize(), up.try_normalize());
        let right = forward.zip(upward).and_then(|(f, u)| Some(f.cross(u)).filter(|r| r.length() > 1e-6)?.try_normalize());
        match (forward, right) {
            (Some(forward), Some(right)) => Ok([right, right.cross(forward), forward]),
            _ => Err(Error::invalid(format!(
                "the view along {direction} with up {up} is no frame; give two finite vectors that are not parallel"
            ))),
        }
    }
}

/// How depth becomes size in the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Parallel rays: lengths can be compared all over the picture.
    Orthographic,
    /// Rays from one eye.
    Perspective {
        /// Full angle of the ball around the scene, in degrees, between 1 and 120.
        field_of_view: f64,
    },
}

/// A viewer whose picture holds a given set of points; independent of the picture's size in pixels.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    eye: DVec3,
    projection: Projection,
    /// Middle and half size of the fitted points, in model units or, in perspective, at unit depth.
    middle: [f64; 2],
    half: [f64; 2],
    margin: f64,
}

impl Camera {
    /// A camera whose picture just holds `points` (a box's corners, or all vertices for a tight fit).
    ///
    /// `margin` is the share of the picture's width and height that stays free on each side, 0 to 0.45.
    /// The eye lies outside the ball around the points, so nothing of theirs is behind it.
    pub fn fit(points: impl IntoIterator<Item = DVec3> + Clone, view: View, projection: Projection, margin: f64) -> Result<Self> {
        let [right, up, forward] = view.frame()?;
        let bounds = crate::geom::Aabb::around(points.clone());
        if !(bounds.size().is_finite() && bounds.size().min_element() >= 0.0) {
            return Err(Error::invalid("the camera needs at least one point to look at, and only finite ones"));
        }
        if !(0.0..=0.45).contains(&margin) {
            return Err(Error::invalid(format!("the margin must lie between 0 and 0.45 of the picture, not {margin}")));
        }
        let radius = if bounds.radius() > 0.0 { bounds.radius() } else { 1.0 };
        let stand = match projection {
            Projection::Orthographic => 2.0 * radius,
            Projection::Perspective { field_of_view } if (1.0..=120.0).contains(&field_of_view) => {
                1.02 * radius / (0.5 * field_of_view.to_radians()).sin()
            }
            Projection::Perspective { field_of_view } => {
                return Err(Error::invalid(format!("the field of view must lie between 1 and 120 degrees, not {field_of_view}")));
            }
        };
        let eye = bounds.center() - forward * stand;
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for point in points {
            let p = point - eye;
            let scale = if projection == Projection::Orthographic { 1.0 } else { 1.0 / p.dot(forward) };
            for (axis, value) in [p.dot(right) * scale, p.dot(up) * scale].into_iter().enumerate() {
                low[axis] = low[axis].min(value);
                high[axis] = high[axis].max(value);
            }
        }
        let unit = if projection == Projection::Orthographic { radius } else { radius / stand };
        let middle = [0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])];
        let half = [(0.5 * (high[0] - low[0])).max(1e-6 * unit), (0.5 * (high[1] - low[1])).max(1e-6 * unit)];
        Ok(Self { right, up, forward, eye, projection, middle, half, margin })
    }

    /// The point from which depth is measured, along [`Camera::forward`].
    pub fn eye(&self) -> DVec3 {
        self.eye
    }

    /// Unit vector into the scene.
    pub fn forward(&self) -> DVec3 {
        self.forward
    }

    /// Width and height of the fitted points, margins not counted: in model units, in perspective at unit depth.
    pub fn span(&self) -> [f64; 2] {
        self.half.map(|h| 2.0 * h)
    }

    /// The camera with a picture of `width` x `height` pixels.
    pub fn lens(&self, width: u32, height: u32) -> Lens {
        let room = 1.0 - 2.0 * self.margin;
        let pitch = (2.0 * self.half[0] / (f64::from(width) * room)).max(2.0 * self.half[1] / (f64::from(height) * room));
        Lens { camera: *self, pitch, width, height, near: 1e-6 * pitch.max(f64::MIN_POSITIVE) }
    }
}

/// A camera and a picture size: turns points into pixels.
///
/// Pixel coordinates run right and down from the picture's top left corner; pixel `(i, j)` spans
/// `i..i+1` by `j..j+1`. Camera coordinates run right, up and forward from the eye.
#[derive(Clone, Copy, Debug)]
pub struct Lens {
    camera: Camera,
    /// Edge of a pixel: in model units, or in perspective at unit depth.
    pub(super) pitch: f64,
    /// Picture width in pixels.
    pub(super) width: u32,
    /// Picture height in pixels.
    pub(super) height: u32,
    /// What is nearer than this is not drawn.
    pub(super) near: f64,
}

impl Lens {
    /// Whether rays are parallel.
    pub(super) fn parallel(&self) -> bool {
        self.camera.projection == Projection::Orthographic
    }

    /// Edge of a pixel in model units at a depth.
    pub(super) fn pixel_size(&self, depth: f64) -> f64 {
        if self.parallel() { self.pitch } else { self.pitch * depth }
    }

    /// Pixel coordinates and depth of a point; `None` behind the eye.
    pub fn pixel(&self, point: DVec3) -> Option<[f64; 3]> {
        let p = self.camera_point(point);
        (p.z > self.near).then(|| {
            let [x, y] = self.pixel_of(p);
            [x, y, p.z]
        })
    }

    /// Camera coordinates of a point.
    pub(super) fn camera_point(&self, point: DVec3) -> DVec3 {
        self.camera_vector(point - self.camera.eye)
    }

    /// Camera coordinates of a direction.
    pub(super) fn camera_vector(&self, v: DVec3) -> DVec3 {
        DVec3::new(v.dot(self.camera.right), v.dot(self.camera.up), v.dot(self.camera.forward))
    }

    /// The point that camera coordinates stand for.
    pub(super) fn model_point(&self, p: DVec3) -> DVec3 {
        self.camera.eye + self.model_vector(p)
    }

    /// The direction that camera coordinates stand for.
    pub(super) fn model_vector(&self, v: DVec3) -> DVec3 {
        self.camera.right * v.x + self.camera.up * v.y + self.camera.forward * v.z
    }

    /// Pixel coordinates of a point before the eye, given in camera coordinates.
    pub(super) fn pixel_of(&self, p: DVec3) -> [f64; 2] {
        let v = self.raster_point(p);
        if self.parallel() { [v.x, v.y] } else { [v.x / v.z, v.y / v.z] }
    }

    /// Camera coordinates with x and y in pixels: `(x, y, depth)`, in perspective times the depth `(x z, y z, z)`.
    pub(super) fn raster_point(&self, p: DVec3) -> DVec3 {
        let weight = if self.parallel() { 1.0 } else { p.z };
        DVec3::new(
            (p.x - self.camera.middle[0] * weight) / self.pitch + 0.5 * f64::from(self.width) * weight,
            (self.camera.middle[1] * weight - p.y) / self.pitch + 0.5 * f64::from(self.height) * weight,
            p.z,
        )
    }

    /// The ray of a pixel coordinate: origin and direction in camera coordinates; depth is the ray's parameter.
    pub(super) fn ray(&self, x: f64, y: f64) -> (DVec3, DVec3) {
        let u = (x - 0.5 * f64::from(self.width)) * self.pitch + self.camera.middle[0];
        let v = (0.5 * f64::from(self.height) - y) * self.pitch + self.camera.middle[1];
        if self.parallel() { (DVec3::new(u, v, 0.0), DVec3::Z) } else { (DVec3::ZERO, DVec3::new(u, v, 1.0)) }
    }

    /// Pixel rectangle `[x0, y0, x1, y1]` around a ball given in camera coordinates; `None` where it is all behind the eye.
    pub(super) fn ball_bounds(&self, center: DVec3, radius: f64) -> Option<[f64; 4]> {
        if center.z + radius <= self.near {
            return None;
        }
        if self.parallel() {
            let [x, y] = self.pixel_of(center);
            let r = radius / self.pitch;
            return Some([x - r, y - r, x + r, y + r]);
        }
        // The tangents from the eye, in the planes of x and z and of y and z.
        let span = |across: f64| {
            let away = across.hypot(center.z);
            let (middle, half) = (across.atan2(center.z), (radius / away).min(1.0).asin());
            let limit = std::f64::consts::FRAC_PI_2 - 1e-9;
            if away <= radius { [-1e9, 1e9] } else { [(middle - half).max(-limit).tan(), (middle + half).min(limit).tan()] }
        };
        let ([u0, u1], [v0, v1]) = (span(center.x), span(center.y));
        let (x, y) = (0.5 * f64::from(self.width), 0.5 * f64::from(self.height));
        let [mu, mv] = self.camera.middle;
        Some([x + (u0 - mu) / self.pitch, y + (mv - v1) / self.pitch, x + (u1 - mu) / self.pitch, y + (mv - v0) / self.pitch])
    }
}
