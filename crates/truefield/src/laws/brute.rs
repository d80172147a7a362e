//! The judge of triangle meshes: asks every triangle.

use super::closest::Elements;
use crate::geom::{DVec3, Facet, Feature};
use crate::mesh::TriangleMesh;

/// Every triangle of a mesh, one after the other. Slow and beyond doubt.
#[derive(Clone, Debug)]
pub struct BruteForce {
    facets: Vec<Facet>,
    corners: Vec<[DVec3; 3]>,
}

impl BruteForce {
    /// Takes all triangles.
    pub fn new(mesh: &TriangleMesh) -> Self {
        let all = 0..mesh.triangles().len() as u32;
        Self { facets: all.clone().map(|t| mesh.facet(t)).collect(), corners: all.map(|t| mesh.corners(t)).collect() }
    }

    /// The squared distance and the lowest index of a triangle that attains it.
    pub fn nearest(&self, p: DVec3) -> (f64, u32) {
        let mut best = (f64::INFINITY, u32::MAX);
        for (index, facet) in self.facets.iter().enumerate() {
            let squared = facet.distance_squared(p);
            if squared < best.0 {
                best = (squared, index as u32);
            }
        }
        best
    }

    /// The plain distance.
    pub fn unsigned(&self, p: DVec3) -> f64 {
        self.nearest(p).0.sqrt()
    }

    /// The generalised winding number (Jacobson et al. 2013, equation 6), summed over all triangles.
    pub fn winding(&self, p: DVec3) -> f64 {
        let solid_angle = |[a, b, c]: [DVec3; 3]| {
            let (a, b, c) = (a - p, b - p, c - p);
            let (x, y, z) = (a.length(), b.length(), c.length());
            2.0 * a.dot(b.cross(c)).atan2(x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y)
        };
        self.corners.iter().map(|&corners| solid_angle(corners)).sum::<f64>() / (4.0 * std::f64::consts::PI)
    }

    /// The distance, negative where the winding number exceeds a half.
    pub fn signed(&self, p: DVec3) -> f64 {
        let distance = self.unsigned(p);
        if self.winding(p) > 0.5 { -distance } else { distance }
    }
}

impl Elements for BruteForce {
    fn count(&self) -> u32 {
        self.facets.len() as u32
    }

    fn distance_squared(&self, element: u32, p: DVec3) -> f64 {
        self.facets[element as usize].distance_squared(p)
    }

    fn feature_distance(&self, element: u32, feature: Feature, p: DVec3) -> f64 {
        let corners = self.corners[element as usize];
        let corner = |index: u8| corners[usize::from(index % 3)];
        match feature {
            Feature::Face => self.distance_squared(element, p).sqrt(),
            Feature::Edge(edge) => Facet::new(corner(edge), corner(edge + 1), corner(edge)).distance_squared(p).sqrt(),
            Feature::Vertex(index) => (corner(index) - p).length(),
        }
    }
}
