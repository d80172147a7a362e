//! Places on the surface where the wall is measured, and the direction in which it is.

use crate::error::{Error, Result};
use crate::geom::{DVec3, Facet};
use crate::mesh::TriangleMesh;
use crate::mesh::topology::Topology;

/// Neighbouring triangles that turn by less than this may be facets of one curved wall; 40 degrees.
const CREASE: f64 = 0.766_044_443_118_978;

/// Normals this close are those of one plane.
const SAME: f64 = 1.0 - 1e-9;

/// Samples where no spacing is given.
const DEFAULT_SAMPLES: f64 = 20_000.0;

/// More would not fit into memory in comfort.
const MOST_SAMPLES: f64 = 20_000_000.0;

/// Vertices where more triangles meet are not smoothed.
const MOST_AROUND: usize = 4096;

/// The golden ratio's relative for two dimensions: the real root of x^3 = x + 1.
const PLASTIC: f64 = 1.324_717_957_244_746;

/// A place on the surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub point: DVec3,
    /// Unit normal of the wall by the triangle's orientation, smoothed across facets of a curved wall.
    pub normal: DVec3,
    pub triangle: u32,
    /// Surface area that the sample stands for.
    pub area: f64,
    /// How far the facets stray from the curved wall that they stand for; 0 on a flat one.
    pub slack: f64,
}

/// A mesh prepared for sampling.
pub(super) struct Sampler<'a> {
    mesh: &'a TriangleMesh,
    normals: Vec<DVec3>,
    areas: Vec<f64>,
    /// Welded corners, and the triangles around each welded vertex.
    corners: Vec<[u32; 3]>,
    first: Vec<u32>,
    around: Vec<u32>,
    /// Index of each triangle's first sample; one more entry at the end.
    starts: Vec<usize>,
    pub spacing: f64,
    pub area: f64,
    tolerance: f64,
}

impl<'a> Sampler<'a> {
    /// One sample per `spacing^2` of area on average, and at least one on every triangle of positive area.
    ///
    /// Facets are taken for those of a curved wall where they stray from it by no more than `tolerance`.
    pub fn new(mesh: &'a TriangleMesh, spacing: Option<f64>, tolerance: f64) -> Result<Self> {
        let count = mesh.triangles().len();
        let (mut normals, mut areas) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for t in 0..count as u32 {
            let [a, b, c] = mesh.corners(t);
            // The longest edge sets the scale, so that tiny and huge triangles keep their area.
            let longest = (b - a).length().max((c - b).length()).max((a - c).length());
            let cross = ((b - a) / longest).cross((c - a) / longest);
            let double = cross.length();
            let flat = double.is_nan() || double < 1e-15;
            normals.push(if flat { DVec3::ZERO } else { cross / double });
            areas.push(if flat { 0.0 } else { 0.5 * double * longest * longest });
        }
        let area: f64 = areas.iter().sum();
        let spacing = spacing.unwrap_or_else(|| (area / DEFAULT_SAMPLES).sqrt());
        if !(spacing > 0.0 && spacing.is_finite()) {
            return Err(Error::invalid(format!("spacing must be a positive length, not {spacing}")));
        }
        let expected = area / (spacing * spacing);
        if expected > MOST_SAMPLES {
            return Err(Error::invalid(format!(
                "spacing {spacing} would take {expected:.1e} samples; choose at least {:.2e}",
                (area / MOST_SAMPLES).sqrt()
            )));
        }
        let mut starts = Vec::with_capacity(count + 1);
        let (mut start, mut sum) = (0, 0.5);
        for &area in &areas {
            starts.push(start);
            let before = f64::floor(sum);
            sum += area / (spacing * spacing);
            if area > 0.0 {
                start += ((sum.floor() - before) as usize).max(1);
            }
        }
        starts.push(start);
        let corners = Topology::new(mesh).triangles;
        let mut first = vec![0u32; mesh.vertices().len() + 1];
        for &v in corners.iter().flatten() {
            first[v as usize + 1] += 1;
        }
        for i in 1..first.len() {
            first[i] += first[i - 1];
        }
        let mut next = first.clone();
        let mut around = vec![0; 3 * count];
        for (t, triangle) in corners.iter().enumerate() {
            for &v in triangle {
                around[next[v as usize] as usize] = t as u32;
                next[v as usize] += 1;
            }
        }
        Ok(Self { mesh, normals, areas, corners, first, around, starts, spacing, area, tolerance })
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.starts.last().copied().unwrap_or(0)
    }

    /// Samples `from .. to`; a sample does not depend on the range it is asked in.
    pub fn places(&self, from: usize, to: usize) -> Vec<Place> {
        let mut triangle = self.starts.partition_point(|&s| s <= from).saturating_sub(1);
        (from..to)
            .map(|index| {
                while self.starts[triangle + 1] <= index {
                    triangle += 1;
                }
                self.place(triangle, index - self.starts[triangle])
            })
            .collect()
    }

    /// Sample `index` of a triangle: the additive recurrence R2 (Roberts 2018) from the centroid on, folded into the triangle.
    fn place(&self, triangle: usize, index: usize) -> Place {
        let (mut s, mut t) = ((1.0 / 3.0 + index as f64 / PLASTIC).fract(), (1.0 / 3.0 + index as f64 / (PLASTIC * PLASTIC)).fract());
        if s + t > 1.0 {
            (s, t) = (1.0 - s, 1.0 - t);
        }
        let [a, b, c] = self.mesh.corners(triangle as u32);
        let count = self.starts[triangle + 1] - self.starts[triangle];
        let place = self.at(a + (b - a) * s + (c - a) * t, triangle as u32);
        Place { area: self.areas[triangle] / count as f64, ..place }
    }

    /// A given point of a triangle, as a sample that stands for no area.
    pub fn at(&self, point: DVec3, triangle: u32) -> Place {
        let (normal, slack) = self.smoothed(triangle as usize, point);
        Place { point, normal, triangle, area: 0.0, slack }
    }

    /// The normal of the curved wall that the facets stand for.
    ///
    /// Half a facet's width from an edge the normal is the facet's own; on the edge it is the mean
    /// of both, in between it turns evenly, as that of a circle does. A chord of width `w` between
    /// facets that turn by `phi` lies `w phi / 8` off its circle; the slack is twice that.
    fn smoothed(&self, triangle: usize, p: DVec3) -> (DVec3, f64) {
        let own = self.normals[triangle];
        let corners = self.mesh.corners(triangle as u32);
        let mut others: Vec<(DVec3, f64)> = Vec::new();
        let mut slack: f64 = 0.0;
        for v in self.corners[triangle] {
            let around = &self.around[self.first[v as usize] as usize..self.first[v as usize + 1] as usize];
            if around.len() > MOST_AROUND {
                continue;
            }
            for &other in around {
                let other = other as usize;
                let normal = self.normals[other];
                let turn = own.dot(normal);
                if !(CREASE..SAME).contains(&turn) {
                    continue;
                }
                // How far the facets reach in the direction in which the wall turns.
                let across = normal - own;
                let theirs = self.mesh.corners(other as u32);
                let width = span(&corners, across).min(span(&theirs, across)) / across.length();
                let stray = 0.125 * width * turn.acos();
                if stray > self.tolerance {
                    continue;
                }
                let [a, b, c] = theirs;
                let near = 1.0 - 2.0 * Facet::new(a, b, c).distance_squared(p).sqrt() / width;
                if near.is_nan() || near <= 0.0 {
                    continue;
                }
                slack = slack.max(2.0 * stray);
                // Triangles of one plane count once, by the nearest.
                let weight = near / (2.0 - near);
                match others.iter_mut().find(|(n, _)| n.dot(normal) >= SAME) {
                    Some((_, known)) => *known = known.max(weight),
                    None => others.push((normal, weight)),
                }
            }
        }
        let sum = others.iter().fold(own, |sum, (normal, weight)| sum + *normal * *weight);
        (sum.normalize_or(own), slack)
    }
}

/// Length of the triangle's shadow along `direction`, times its length.
fn span(corners: &[DVec3; 3], direction: DVec3) -> f64 {
    let [a, b, c] = corners.map(|v| v.dot(direction));
    a.max(b).max(c) - a.min(b).min(c)
}
