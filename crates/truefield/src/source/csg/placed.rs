//! Shapes turned, scaled and moved.

use std::sync::Arc;

use glam::DMat3;

use crate::distance::{Distance, SampleBlock, Source};
use crate::error::{Error, Result};
use crate::geom::{Aabb, Affine, DVec3, Interval};

use super::measure::{direction, length, point};

/// A rigid motion with a uniform scale: `p -> turn (scale p) + shift`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    turn: DMat3,
    scale: f64,
    shift: DVec3,
}

impl Placement {
    /// Nothing moves.
    pub const IDENTITY: Self = Self { turn: DMat3::IDENTITY, scale: 1.0, shift: DVec3::ZERO };

    /// Moved by a vector.
    pub fn translate(by: DVec3) -> Result<Self> {
        Ok(Self { shift: point("the translation", by)?, ..Self::IDENTITY })
    }

    /// Turned about an axis through the origin, counter-clockwise seen from where it points to.
    pub fn rotate(axis: DVec3, degrees: f64) -> Result<Self> {
        if !degrees.is_finite() {
            return Err(Error::invalid(format!("the angle is {degrees}; give a finite number of degrees")));
        }
        let axis = direction("axis", axis)?;
        // Quarter turns about the axes are exact: sines and cosines of multiples of pi are not.
        let (sin, cos) = match degrees.rem_euclid(360.0) {
            0.0 => (0.0, 1.0),
            90.0 => (1.0, 0.0),
            180.0 => (0.0, -1.0),
            270.0 => (-1.0, 0.0),
            degrees => degrees.to_radians().sin_cos(),
        };
        let turned = |v: DVec3| v * cos + axis.cross(v) * sin + axis * (axis.dot(v) * (1.0 - cos));
        Ok(Self { turn: DMat3::from_cols(turned(DVec3::X), turned(DVec3::Y), turned(DVec3::Z)), ..Self::IDENTITY })
    }

    /// Scaled about the origin by a positive factor.
    pub fn scale(factor: f64) -> Result<Self> {
        if !(factor > 0.0 && factor.is_finite()) {
            return Err(Error::invalid(format!("the factor is {factor}; give a positive number: distances have to stay distances")));
        }
        Ok(Self { scale: factor, ..Self::IDENTITY })
    }

    /// The z axis turned to a direction, the shortest way, and the origin moved to a point.
    pub fn along(axis: DVec3, center: DVec3) -> Result<Self> {
        let (axis, shift) = (direction("axis", axis)?, point("center", center)?);
        let around = DVec3::Z.cross(axis);
        let turn = if around == DVec3::ZERO {
            if axis.z > 0.0 { DMat3::IDENTITY } else { DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0)) }
        } else {
            let side = around.normalize();
            // Both frames have `side` in common.
            let (from, to) = (side.cross(DVec3::Z), side.cross(axis));
            DMat3::from_cols(side, to, axis) * DMat3::from_cols(side, from, DVec3::Z).transpose()
        };
        Ok(Self { turn, scale: 1.0, shift })
    }

    /// A rigid motion given by a rotation, column by column, and a shift.
    pub fn rigid(columns: [DVec3; 3], shift: DVec3) -> Result<Self> {
        let turn = DMat3::from_cols_array_2d(&columns.map(|column| column.to_array()));
        let error = (turn.transpose() * turn - DMat3::IDENTITY).to_cols_array().into_iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        if !(error < 1e-9) || turn.determinant() < 0.0 {
            return Err(Error::invalid("a pose does not only turn and move; give rotations, without scale, shear or reflection"));
        }
        Ok(Self { turn, scale: 1.0, shift: point("the position of a pose", shift)? })
    }

    /// On the way from one placement to another of the same scale: moving straight, turning evenly.
    pub(super) fn toward(&self, other: &Self, turning: &Turning, share: f64) -> Self {
        Self { turn: self.turn * turning.part(share), scale: self.scale, shift: self.shift.lerp(other.shift, share) }
    }

    /// How fast a placement on the way moves, and turns about its own origin, by the share of the way.
    pub(super) fn velocity(&self, other: &Self, turning: &Turning) -> (DVec3, DVec3) {
        (other.shift - self.shift, self.turn * turning.axis * turning.angle)
    }

    /// How far it is to another placement: the way and the turn.
    pub(super) fn way_to(&self, other: &Self) -> (f64, Turning) {
        ((other.shift - self.shift).length(), Turning::new(self.turn.transpose() * other.turn))
    }

    /// Where a point of the world lies in the shape's own space.
    pub(super) fn inward(&self, p: DVec3) -> DVec3 {
        self.turn.transpose() * (p - self.shift) / self.scale
    }

    /// Where a direction of the shape's own space points to in the world.
    pub(super) fn turned(&self, direction: DVec3) -> DVec3 {
        self.turn * direction
    }

    /// Where a point of the shape's own space lies in the world.
    pub(super) fn outward(&self, p: DVec3) -> DVec3 {
        self.turn * (p * self.scale) + self.shift
    }

    /// The box around a box of the shape's own space.
    pub(super) fn extent_outward(&self, extent: &Aabb) -> Aabb {
        boxed(self.outward(extent.center()), self.turn, 0.5 * extent.size() * self.scale)
    }

    /// The box around all that a box of the shape's own space passes on the way to another placement.
    pub(super) fn swept(&self, other: &Self, turning: &Turning, extent: &Aabb) -> Aabb {
        let turned = |placement: &Self| Self { shift: DVec3::ZERO, ..*placement }.extent_outward(extent);
        // Corners go round the origin; an arc and its chord are no farther apart than this.
        let arm = extent.min.abs().max(extent.max.abs()).length() * self.scale;
        let bulge = arm * (1.0 - (0.5 * turning.angle).cos());
        let (around, path) = (turned(self).union(turned(other)).grow(bulge), Aabb::around([self.shift, other.shift]));
        Aabb::new(around.min + path.min, around.max + path.max)
    }

    /// The box, in the shape's own space, around a box of the world.
    pub(super) fn inward_box(&self, cell: &Aabb) -> Aabb {
        boxed(self.inward(cell.center()), self.turn.transpose(), 0.5 * cell.size() / self.scale)
    }
}

/// A turn about one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Turning {
    axis: DVec3,
    /// In radians, 0 to pi.
    pub angle: f64,
}

impl Turning {
    fn new(turn: DMat3) -> Self {
        let twist = DVec3::new(turn.y_axis.z - turn.z_axis.y, turn.z_axis.x - turn.x_axis.z, turn.x_axis.y - turn.y_axis.x);
        let angle = twist.length().atan2(turn.x_axis.x + turn.y_axis.y + turn.z_axis.z - 1.0);
        if angle < 1e-15 {
            return Self { axis: DVec3::X, angle: 0.0 };
        }
        // Near half a turn the twist vanishes, but the columns of turn + 1 lie along the axis.
        let axis = if angle < 3.0 {
            twist.normalize()
        } else {
            let columns = [turn.x_axis + DVec3::X, turn.y_axis + DVec3::Y, turn.z_axis + DVec3::Z];
            let longest = columns.into_iter().fold(DVec3::ZERO, |a, b| if b.length() > a.length() { b } else { a });
            longest.normalize() * if longest.dot(twist) < 0.0 { -1.0 } else { 1.0 }
        };
        Self { axis, angle }
    }

    fn part(&self, share: f64) -> DMat3 {
        if self.angle == 0.0 { DMat3::IDENTITY } else { DMat3::from_axis_angle(self.axis, self.angle * share) }
    }
}

/// The box around a box that was turned.
fn boxed(center: DVec3, turn: DMat3, half: DVec3) -> Aabb {
    let reach = turn.x_axis.abs() * half.x + turn.y_axis.abs() * half.y + turn.z_axis.abs() * half.z;
    // Rounded outward.
    let reach = reach * (1.0 + 4.0 * f64::EPSILON) + center.abs() * (4.0 * f64::EPSILON);
    Aabb::new(center - reach, center + reach)
}

/// Points that are moved together.
const GROUP: usize = 64;

/// A shape somewhere else.
#[derive(Clone)]
pub struct Placed {
    shape: Arc<dyn Source>,
    placement: Placement,
}

impl Placed {
    /// The shape, moved.
    pub fn new(shape: Arc<dyn Source>, placement: Placement) -> Result<Self> {
        if let Some(extent) = shape.extent() {
            let size = extent.diagonal() * placement.scale;
            length("the size of the scaled shape", size)?;
        }
        Ok(Self { shape, placement })
    }

    fn inward(&self, points: &[DVec3]) -> Vec<DVec3> {
        points.iter().map(|&p| self.placement.inward(p)).collect()
    }

    fn scaled(&self, interval: Interval) -> Interval {
        Interval { lower: interval.lower * self.placement.scale, upper: interval.upper * self.placement.scale }
    }
}

impl Distance for Placed {
    fn extent(&self) -> Option<Aabb> {
        self.shape.extent().map(|extent| self.placement.extent_outward(&extent))
    }

    fn enclosure(&self) -> Option<Aabb> {
        self.shape.enclosure().map(|enclosure| self.placement.extent_outward(&enclosure))
    }

    fn below(&self, cell: &Aabb) -> Affine {
        let turned = self.placement.inward_box(cell);
        let Affine { value, slope } = self.shape.below(&turned);
        let value = value + slope.dot(self.placement.inward(cell.center()) - turned.center());
        Affine { value: value * self.placement.scale - self.noise(), slope: self.placement.turned(slope) }
    }

    fn at(&self, p: DVec3) -> Interval {
        self.scaled(self.shape.at(self.placement.inward(p)))
    }

    fn over(&self, cell: &Aabb) -> Interval {
        let turned = self.scaled(self.shape.over(&self.placement.inward_box(cell)));
        // A turned box is larger; the ball around the middle may say more.
        let around = self.at(cell.center()).widen(cell.radius() * (1.0 + 1e-15));
        turned.intersection(around).widen(self.noise())
    }
}

impl Source for Placed {
    fn values(&self, points: &[DVec3], out: &mut [f64]) -> Result<()> {
        let mut inward = [DVec3::ZERO; GROUP];
        for (points, out) in points.chunks(GROUP).zip(out.chunks_mut(GROUP)) {
            let inward = &mut inward[..points.len()];
            for (inward, &p) in inward.iter_mut().zip(points) {
                *inward = self.placement.inward(p);
            }
            self.shape.values(inward, out)?;
            out.iter_mut().for_each(|out| *out *= self.placement.scale);
        }
        Ok(())
    }

    fn gradients(&self, points: &[DVec3], out: &mut [DVec3]) -> Result<()> {
        self.shape.gradients(&self.inward(points), out)?;
        for out in out {
            *out = self.placement.turned(*out);
        }
        Ok(())
    }

    fn tilt(&self, p: DVec3) -> f64 {
        self.shape.tilt(self.placement.inward(p))
    }

    fn slack(&self, cell: &Aabb) -> Interval {
        self.scaled(self.shape.slack(&self.placement.inward_box(cell)))
    }

    fn bend(&self, cell: &Aabb) -> Interval {
        let bend = self.shape.bend(&self.placement.inward_box(cell));
        Interval { lower: bend.lower / self.placement.scale, upper: bend.upper / self.placement.scale }
    }

    fn residual(&self, block: &SampleBlock<'_>, out: &mut [Interval]) -> Result<()> {
        let scale = self.placement.scale;
        let points = self.inward(block.points);
        let [values, said] = [block.values, block.said].map(|numbers| numbers.iter().map(|number| number / scale).collect::<Vec<f64>>());
        let cell = self.placement.inward_box(&block.cell);
        let square = block.square / (scale * scale) * (1.0 + 1e-12);
        self.shape.residual(&SampleBlock { cell, points: &points, values: &values, said: &said, boxes: block.boxes, square }, out)?;
        for out in out {
            *out = self.scaled(*out).widen(2.0 * self.noise());
        }
        Ok(())
    }

    fn sided(&self) -> bool {
        self.shape.sided()
    }

    /// That of the shape, and rounding on the way.
    fn noise(&self) -> f64 {
        let reach = self.extent().map_or(self.placement.shift.abs().max_element(), |e| e.min.abs().max(e.max.abs()).max_element());
        self.shape.noise() * self.placement.scale + 8.0 * f64::EPSILON * reach
    }

    fn noise_over(&self, cell: &Aabb) -> f64 {
        let within = self.shape.noise_over(&self.placement.inward_box(cell)) * self.placement.scale;
        self.noise().min(within + 8.0 * f64::EPSILON * cell.min.abs().max(cell.max.abs()).max_element())
    }
}
