//! Triangle meshes as plain data.

mod positions;
pub(crate) mod topology;

pub use positions::Distinct;
pub(crate) use positions::Positions;

use crate::error::{Error, Result};
use crate::geom::{Aabb, DVec3, Facet};

/// Vertices and triangles, checked once: at least one triangle, finite vertices, indices in range.
#[derive(Clone, Debug)]
pub struct TriangleMesh {
    vertices: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    extent: Aabb,
}

impl TriangleMesh {
    /// Checks and takes the arrays. Vertices that no triangle uses do not count for the extent.
    pub fn new(vertices: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Result<Self> {
        if triangles.is_empty() {
            return Err(Error::invalid("the mesh has no triangles; give it at least one"));
        }
        if triangles.len() >= (1 << 31) {
            return Err(Error::invalid("the mesh has more than 2^31 triangles; split it"));
        }
        if let Some(index) = vertices.iter().position(|v| !v.is_finite()) {
            return Err(Error::invalid(format!("vertex {index} is {}; all vertices must be finite numbers", vertices[index])));
        }
        let count = vertices.len();
        if let Some(index) = triangles.iter().position(|t| t.iter().any(|&v| v as usize >= count)) {
            return Err(Error::invalid(format!(
                "triangle {index} refers to vertices {:?} but the mesh has only {count} vertices (0 to {})",
                triangles[index],
                count.saturating_sub(1)
            )));
        }
        let extent = Aabb::around(triangles.iter().flatten().map(|&v| vertices[v as usize]));
        if !(extent.diagonal() > 0.0 && extent.diagonal().is_finite()) {
            return Err(Error::invalid(format!("the mesh spans a box of size {}; it must have a positive, finite extent", extent.size())));
        }
        if !triangles.iter().any(|t| corners(&vertices, *t).is_some_and(|[a, b, c]| (b - a).cross(c - a) != DVec3::ZERO)) {
            return Err(Error::invalid("all triangles of the mesh have zero area; it has no surface"));
        }
        Ok(Self { vertices, triangles, extent })
    }

    /// Vertex positions in model units.
    pub fn vertices(&self) -> &[DVec3] {
        &self.vertices
    }

    /// Vertex indices, counter-clockwise seen from outside.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The box of all triangles.
    pub fn extent(&self) -> Aabb {
        self.extent
    }

    /// The three corners of a triangle.
    pub fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].map(|v| self.vertices[v as usize])
    }

    /// A triangle prepared for nearest-point queries.
    pub fn facet(&self, triangle: u32) -> Facet {
        let [a, b, c] = self.corners(triangle);
        Facet::new(a, b, c)
    }
}

fn corners(vertices: &[DVec3], triangle: [u32; 3]) -> Option<[DVec3; 3]> {
    let [a, b, c] = triangle.map(|v| vertices.get(v as usize).copied());
    Some([a?, b?, c?])
}
