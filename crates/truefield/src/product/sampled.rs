//! Contours of sampled fields: points where the interpolation is at a distance, to any tolerance.
//!
//! The rule of [`super::contour`] in each cell of samples. There trilinear interpolation changes by no more than its
//! steepest edges together, so cells are halved while the contour may pass, down to parts so small that none is missed.

use std::sync::atomic::{AtomicU64, Ordering};

use super::contour::Placement;
use crate::distance::Distance;
use crate::error::{Error, Result};
use crate::field::SampledField;
use crate::geom::{DVec3, Interval};
use crate::run::Run;

/// Parts of a cell along an edge are counted up to this.
const MOST: f64 = 1e6;

/// Newton's steps onto the contour.
const STEPS: usize = 4;

/// Samples of a contour of a sampled field.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SampledContour {
    /// Positions, model units.
    pub points: Vec<DVec3>,
    /// Unit gradients of the interpolation, zero where it has none.
    pub normals: Vec<DVec3>,
    /// What is known of the true distance at each point.
    pub bounds: Vec<Interval>,
}

/// Bytes that a point takes.
const BYTES: u64 = (2 * size_of::<DVec3>() + size_of::<Interval>()) as u64;

/// Samples the places where the interpolation is at signed `distance`, to within `tolerance`.
///
/// With [`Placement::Lattice`], the interpolation at each point is within half the tolerance of `distance`, and each place
/// where it is `distance` is within half the tolerance of a point. With [`Placement::Projected`] points are moved along
/// the gradient onto the contour, where they stay in their cell; coverage is then the whole tolerance. Cells with an infinite
/// sample are left out. Takes memory in proportion to the contour, and refuses more than `memory` bytes.
pub fn contour(
    field: &SampledField,
    distance: f64,
    tolerance: f64,
    placement: Placement,
    memory: u64,
    run: &Run<'_>,
) -> Result<SampledContour> {
    if !distance.is_finite() {
        return Err(Error::invalid(format!("the contour's distance must be a finite length, not {distance}")));
    }
    if !(tolerance > 0.0 && tolerance.is_finite()) {
        return Err(Error::invalid(format!("the tolerance must be a positive length, not {tolerance:?}")));
    }
    let lattice = field.lattice();
    let cells = lattice.shape.map(|n| n as usize - 1);
    if cells.contains(&0) {
        let [x, y, z] = lattice.shape;
        return Err(Error::invalid(format!("{x} x {y} x {z} samples have no cells between them; give at least two along each axis")));
    }
    let count = AtomicU64::new(0);
    let layers = run.blocks("trace the contour", cells[0], |i| {
        let mut out = SampledContour::default();
        let mut kept = 0;
        for j in 0..cells[1] {
            run.cancel.check()?;
            for k in 0..cells[2] {
                let Some(cell) = Cell::crossed(field, [i, j, k], distance) else { continue };
                cell.trace(tolerance, placement, &mut |local| {
                    let normal = cell.gradient(local).normalize_or_zero();
                    out.points.push(cell.place(local));
                    out.normals.push(normal);
                })
                .map_err(|parts| {
                    Error::invalid(format!(
                        "a tolerance of {tolerance:?} would part a cell {parts:.1e} times along an edge; use a larger one"
                    ))
                })?;
                let found = (out.points.len() - kept) as u64;
                kept = out.points.len();
                let needed = (count.fetch_add(found, Ordering::Relaxed) + found) * BYTES;
                if needed > memory {
                    return Err(Error::Memory { what: format!("a contour at tolerance {tolerance:?}"), needed, allowed: memory });
                }
            }
        }
        out.bounds = out.points.iter().map(|&p| field.at(p)).collect();
        Ok(out)
    })?;
    let mut all = SampledContour::default();
    for layer in layers {
        all.points.extend(layer.points);
        all.normals.extend(layer.normals);
        all.bounds.extend(layer.bounds);
    }
    Ok(all)
}

/// One cell of samples, less the distance that is looked for.
struct Cell {
    /// Corner c has bit 0 set at high x, bit 1 at high y, bit 2 at high z.
    corners: [f64; 8],
    low: DVec3,
    spacing: DVec3,
}

impl Cell {
    /// The cell at an index if the interpolation is `distance` somewhere in it.
    fn crossed(field: &SampledField, index: [usize; 3], distance: f64) -> Option<Self> {
        let lattice = field.lattice();
        let strides = lattice.strides();
        let base: usize = (0..3).map(|axis| index[axis] * strides[axis]).sum();
        let value = |corner: usize| {
            let number = base + (0..3).map(|axis| (corner >> axis & 1) * strides[axis]).sum::<usize>();
            f64::from(field.values()[number]) - distance
        };
        let corners: [f64; 8] = std::array::from_fn(value);
        let (least, most) = corners.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &v| (a.min(v), b.max(v)));
        let crossed = least <= 0.0 && most >= 0.0 && least.is_finite() && most.is_finite();
        crossed.then(|| Self { corners, low: lattice.node(base), spacing: lattice.spacing })
    }

    /// Interpolation at a place whose coordinates run from 0 to 1.
    fn value(&self, at: DVec3) -> f64 {
        let c = &self.corners;
        let along = |low: f64, high: f64, part: f64| low + (high - low) * part;
        let row = |a: usize| along(c[a], c[a + 1], at.x);
        along(along(row(0), row(2), at.y), along(row(4), row(6), at.y), at.z)
    }

    /// Its gradient, per model unit.
    fn gradient(&self, at: DVec3) -> DVec3 {
        let slope = |axis: usize| {
            let (mut low, mut high) = (at, at);
            (low[axis], high[axis]) = (0.0, 1.0);
            (self.value(high) - self.value(low)) / self.spacing[axis]
        };
        DVec3::new(slope(0), slope(1), slope(2))
    }

    /// No less than the length of the gradient anywhere in the cell.
    fn steepest(&self) -> f64 {
        let slope = |axis: usize| {
            let edges = (0..8).filter(|corner| corner >> axis & 1 == 0);
            edges.map(|low| (self.corners[low | 1 << axis] - self.corners[low]).abs()).fold(0.0, f64::max) / self.spacing[axis]
        };
        DVec3::new(slope(0), slope(1), slope(2)).length()
    }

    fn place(&self, local: DVec3) -> DVec3 {
        self.low + local * self.spacing
    }

    /// Hands on the places near the contour; if the tolerance is too small for that, the number of parts it would take.
    fn trace(&self, tolerance: f64, placement: Placement, keep: &mut impl FnMut(DVec3)) -> std::result::Result<(), f64> {
        let steepest = self.steepest() * (1.0 + 1e-9);
        // A part's half diagonal is then at most half the tolerance, and so is the change of value along it.
        let parts = (self.spacing * (3.0_f64.sqrt() * steepest.max(1.0) / tolerance) * (1.0 + 1e-9)).ceil().max(DVec3::ONE);
        if !(parts.max_element() <= MOST) {
            return Err(parts.max_element());
        }
        let counts = [parts.x as u32, parts.y as u32, parts.z as u32];
        let mut boxes = vec![([0u32; 3], counts)];
        while let Some((low, high)) = boxes.pop() {
            let corner = |index: [u32; 3]| DVec3::new(f64::from(index[0]), f64::from(index[1]), f64::from(index[2])) / parts;
            let (from, to) = (corner(low), corner(high));
            let middle = (from + to) * 0.5;
            let value = self.value(middle);
            let size = [0, 1, 2].map(|axis| high[axis] - low[axis]);
            if size == [1; 3] {
                if value.abs() <= 0.5 * tolerance {
                    keep(if placement == Placement::Projected { self.projected(middle, tolerance) } else { middle });
                }
                continue;
            }
            if value.abs() > 0.5 * ((to - from) * self.spacing).length() * steepest {
                continue;
            }
            // The later half first, so that the parts come in order.
            let axis = (0..3).max_by_key(|&axis| (size[axis], 2 - axis)).unwrap_or(0);
            let cut = low[axis] + size[axis] / 2;
            let (mut later, mut earlier) = (low, high);
            (later[axis], earlier[axis]) = (cut, cut);
            boxes.push((later, high));
            boxes.push((low, earlier));
        }
        Ok(())
    }

    /// The place moved along the gradient onto the contour, if that is within half the tolerance and in the cell.
    fn projected(&self, from: DVec3, tolerance: f64) -> DVec3 {
        let mut at = from;
        for _ in 0..STEPS {
            let gradient = self.gradient(at);
            let squared = gradient.length_squared();
            if squared == 0.0 {
                return from;
            }
            at -= gradient * (self.value(at) / squared) / self.spacing;
        }
        let inside = at.cmpge(DVec3::ZERO).all() && at.cmple(DVec3::ONE).all();
        let near = ((at - from) * self.spacing).length() <= 0.5 * tolerance;
        if inside && near && self.value(at).abs() <= 1e-6 * tolerance { at } else { from }
    }
}
