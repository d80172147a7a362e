//! The surface at a distance of a sampled field, as a closed triangle mesh: marching cubes.
//!
//! After Lorensen and Cline 1987. As in flying edges (Schroeder, Maynard and Geveci 2015), rows of samples are first
//! reduced to where they cross the surface, and what each row will add is counted before it is made; here a row is one bit
//! a sample, so that 64 cells are passed over at a time.

mod bits;
mod cases;
mod cells;

use std::sync::{Mutex, PoisonError};

use bits::Bits;
use cells::{Crossed, add_triangles, add_vertices};

use crate::error::{Error, Result};
use crate::field::SampledField;
use crate::geom::{Aabb, DVec3};
use crate::mesh::TriangleMesh;
use crate::run::Run;

/// What becomes of a surface that reaches the border of the lattice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Border {
    /// It is closed half a spacing beyond the last samples, as if there were nothing but outside.
    Closed,
    /// It ends there, with a rim.
    Open,
}

/// A surface as flat arrays, for those who keep meshes in their own way.
#[derive(Clone, Debug)]
pub struct Triangulation<I> {
    /// Positions in model units.
    pub vertices: Vec<[f64; 3]>,
    /// Rows of `vertices`, counter-clockwise seen from outside.
    pub triangles: Vec<[I; 3]>,
    /// The box of all vertices.
    pub extent: Aabb,
}

/// The surface where the samples, interpolated along the lattice, are at signed `distance`.
///
/// Each vertex lies on an edge of the lattice between a sample below `distance` and one that is not, where the linear
/// interpolation between the two has that value. Each side of a triangle belongs to just one other, which runs along it
/// the other way, but for the rim of [`Border::Open`]: the mesh is closed and oriented, corners counter-clockwise seen
/// from outside, whatever the samples. Vertices coincide, and triangles have no area, only where a sample is at
/// `distance` itself, to rounding.
///
/// Where the two samples' own sides are certain, the true surface crosses the edge too, so each vertex is within a spacing
/// of it; thinner parts than a spacing may be missing.
///
/// Needs 24 bytes a vertex, 12 a triangle, two of which come with a vertex, and an eighth of a byte a sample; refuses more
/// than `memory` bytes, a `distance` that is not finite, and one that no sample is below or all are.
pub fn surface(field: &SampledField, distance: f64, border: Border, memory: u64, run: &Run<'_>) -> Result<TriangleMesh> {
    let Triangulation { vertices, triangles, .. } = triangulate(field, distance, border, memory, run)?;
    TriangleMesh::new(vertices.into_iter().map(DVec3::from_array).collect(), triangles)
}

/// The same, with indices of any kind.
pub fn triangulate<I: Copy + Default + From<u32> + Send>(
    field: &SampledField,
    distance: f64,
    border: Border,
    memory: u64,
    run: &Run<'_>,
) -> Result<Triangulation<I>> {
    if !distance.is_finite() {
        return Err(Error::invalid(format!("the distance of the surface is {distance}; give a finite length")));
    }
    let bits = Bits::below(field, distance, border, run)?;
    let layers = run.blocks("count the surface", bits.layers(), |i| Ok(Crossed::of(&bits, i)))?;
    let count = |of: fn(&Crossed) -> usize| layers.iter().map(of).sum::<usize>();
    let (vertex_count, triangle_count) = (count(|layer| layer.vertices), count(|layer| layer.triangles));
    if triangle_count == 0 {
        let (low, high) = field.values().iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), &v| (a.min(v), b.max(v)));
        return Err(Error::invalid(format!(
            "no surface is at distance {distance}: the samples run from {low} to {high}; choose another distance"
        )));
    }
    let needed = (size_of::<[f64; 3]>() * vertex_count + size_of::<[I; 3]>() * triangle_count) as u64;
    if needed > memory || vertex_count > u32::MAX as usize {
        return Err(Error::Memory { what: format!("a surface of {vertex_count} vertices"), needed, allowed: memory });
    }
    let mut before = 0;
    let firsts: Vec<u32> = layers
        .iter()
        .map(|layer| {
            before += layer.vertices as u32;
            before - layer.vertices as u32
        })
        .collect();
    let rows = bits.starts(&firsts, run)?;
    let mut vertices = vec![[0.0; 3]; vertex_count];
    let mut triangles = vec![[I::default(); 3]; triangle_count];
    let extents = {
        // Each layer fills its own part; the locks are taken once.
        let mut rest = (vertices.as_mut_slice(), triangles.as_mut_slice());
        let parts: Vec<_> = layers
            .iter()
            .map(|layer| {
                let (own_vertices, later_vertices) = std::mem::take(&mut rest.0).split_at_mut(layer.vertices);
                let (own_triangles, later_triangles) = std::mem::take(&mut rest.1).split_at_mut(layer.triangles);
                rest = (later_vertices, later_triangles);
                Mutex::new((own_vertices, own_triangles))
            })
            .collect();
        run.blocks("make the surface", layers.len(), |i| {
            let mut part = parts[i].lock().unwrap_or_else(PoisonError::into_inner);
            add_vertices(field, &bits, distance, i, part.0);
            add_triangles(&bits, &rows, &layers[i].cases, i, part.1);
            Ok(Aabb::around(part.0.iter().map(|&v| DVec3::from_array(v))))
        })?
    };
    let extent = extents.into_iter().fold(Aabb::EMPTY, Aabb::union);
    if !(extent.diagonal() > 0.0) {
        return Err(Error::invalid(format!(
            "the surface at distance {distance} has shrunk to a point beside its samples; choose another distance"
        )));
    }
    Ok(Triangulation { vertices, triangles, extent })
}
