//! The surface at a distance of an adaptively sampled field, as a closed triangle mesh: dual contouring.
//!
//! After Ju, Losasso, Schaefer and Warren 2002: a vertex in each cell that the surface passes, where the planes at its
//! crossed edges meet, so that sharp edges stay sharp; a polygon around each crossed edge that no smaller cell divides, so
//! that cells of different size leave no cracks. A cell that several pieces of surface pass has a vertex for each.

mod crossing;
mod loops;
mod place;
mod polygon;
mod sharp;
mod skeleton;

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, PoisonError};

use crossing::{Crossing, crossings, divide};
use loops::{Pairs, Places, number_loops};
use place::Smooth;
use skeleton::{Copy, Leaf};

use super::reach;
use crate::distance::Source;
use crate::error::{Error, Result};
use crate::field::adaptive::AdaptiveField;
use crate::geom::{Aabb, DVec3};
use crate::mesh::TriangleMesh;
use crate::run::Run;

/// Crossings whose polygons a worker makes at a time.
const CHUNK: usize = 8192;

/// The surface where the field is at signed `distance`, closed where the domain ends.
///
/// Inside is every corner of the tree's cells that is below `distance`; corners on the border of the domain are not. What is
/// guaranteed, for any field: each side of a triangle belongs to just one other, which runs along it the other way, and the
/// triangles around a vertex are one fan, so the mesh is closed, oriented and manifold, with corners counter-clockwise
/// seen from outside; no corner of the tree is on its wrong side by more than a cell; each vertex lies in its cell. Not
/// guaranteed: where cells are not small beside the shape, triangles may cross each other, and may have no area.
///
/// A piece of surface that no edge of the tree's cells meets is not seen: thinner than a cell, in cells that were not
/// divided because they did not have to be.
///
/// Normals are the field's, which rounds edges off within its tolerance. Where `shape`, whose field it is, is given, it is
/// asked about each crossed edge some ten times, and sharp edges and corners are kept.
///
/// Takes some 400 bytes a vertex while it runs, most of it for the cells about the surface; refuses more than `memory` bytes, a `distance` that is not finite, one
/// that no corner is below, and one at which the surface of a solid inside the domain would leave it.
pub fn surface(field: &AdaptiveField, distance: f64, shape: Option<&dyn Source>, memory: u64, run: &Run<'_>) -> Result<TriangleMesh> {
    if !distance.is_finite() {
        return Err(Error::invalid(format!("the distance of the surface is {distance}; give a finite length")));
    }
    reach::check(field, distance)?;
    let mut copy = Copy::of(field, distance, run)?;
    divide(&mut copy);
    let mut crossings = crossings(&copy, distance, run)?;
    let cells = copy.skeleton.leaves.len() as u64;
    let (leaves, size) = used(copy, &mut crossings);
    if crossings.is_empty() {
        return Err(Error::invalid(format!(
            "no surface is at distance {distance}: no corner of a cell is below it; choose another distance"
        )));
    }
    let per_crossing = (size_of::<Crossing>() + 4 * size_of::<u32>() * 3 + 2 * size_of::<[u32; 3]>() + size_of::<DVec3>()) as u64;
    let needed = cells * (2 * size_of::<Leaf<'_>>() + 8) as u64 + crossings.len() as u64 * per_crossing;
    if needed > memory || crossings.len() >= 1 << 29 {
        return Err(Error::Memory { what: format!("a surface around {} crossed edges", crossings.len()), needed, allowed: memory });
    }
    run.cancel.check()?;
    let places = Places::of(&crossings, leaves.len());
    if let Some(shape) = shape {
        sharp::sharpen(&mut crossings, &leaves, size, shape, distance, run)?;
    }
    let pairs = Pairs::of(&crossings, &leaves, &places, distance, run)?;
    // Which vertex each place has: first within its chunk of leaves, then of all.
    let own: Vec<AtomicU32> = std::iter::repeat_with(|| AtomicU32::new(0)).take(4 * crossings.len()).collect();
    let counts = number_loops(&crossings, &places, &pairs, &own, run)?;
    let crowded = pairs.into_crowded();

    let mut vertices = vec![DVec3::ZERO; counts.iter().sum()];
    let (mut parts, mut rest, mut first) = (Vec::with_capacity(counts.len()), &mut vertices[..], 0);
    for count in counts {
        let (part, after) = rest.split_at_mut(count);
        parts.push((first, Mutex::new(part)));
        (rest, first) = (after, first + count);
    }
    run.blocks("place vertices", parts.len(), |chunk| {
        let (first, part) = &parts[chunk];
        let mut vertices = part.lock().unwrap_or_else(PoisonError::into_inner);
        let (mut tagged, mut points) = (Vec::new(), Vec::new());
        for number in places.chunk(chunk) {
            let around = places.around(number);
            tagged.clear();
            tagged.extend(around.iter().map(|&place| (own[place as usize].load(Ordering::Relaxed), place)));
            tagged.sort_unstable();
            let leaf = &leaves[number];
            let extent = leaf.extent();
            let smooth = if leaf.on_border || shape.is_some() { Smooth::Left } else { Smooth::Followed };
            for piece in tagged.chunk_by(|a, b| a.0 == b.0) {
                points.clear();
                let vertex = piece[0].0;
                for &(_, place) in piece {
                    own[place as usize].store(*first as u32 + vertex, Ordering::Relaxed);
                    let crossing = &crossings[place as usize / 4];
                    points.push((crossing.point, DVec3::from_array(crossing.normal.map(f64::from))));
                }
                vertices[vertex as usize] = place::vertex(&points, &leaf.cell, &extent, distance, smooth);
            }
        }
        Ok(())
    })?;
    drop((parts, places));
    let depths: Vec<u32> = leaves.iter().map(|leaf| leaf.cell.depth()).collect();
    drop(leaves);
    let middles = middles(&crossings, &crowded, &own, &mut vertices);
    polygons(&crossings, &depths, &own, &middles, vertices, run)
}

/// The leaves around crossings, which name them by their new numbers, and the size of the first leaf of all.
fn used<'a>(copy: Copy<'a>, crossings: &mut [Crossing]) -> (Vec<Leaf<'a>>, f64) {
    let mut leaves = copy.skeleton.leaves;
    let size = leaves.first().map_or(0.0, |leaf| leaf.extent().diagonal());
    let mut numbers = vec![0u32; leaves.len()];
    for leaf in crossings.iter().flat_map(|crossing| crossing.leaves) {
        numbers[leaf as usize] = 1;
    }
    let mut old = numbers.iter();
    leaves.retain(|_| old.next() == Some(&1));
    leaves.shrink_to_fit();
    let mut before = 0;
    for number in &mut numbers {
        before += *number;
        *number = before - *number;
    }
    for crossing in crossings {
        crossing.leaves = crossing.leaves.map(|leaf| numbers[leaf as usize]);
    }
    (leaves, size)
}

/// All parts, one after the other; each is let go once it is copied.
fn joined<T>(parts: Vec<Vec<T>>) -> Vec<T> {
    let mut all = Vec::with_capacity(parts.iter().map(Vec::len).sum());
    for part in parts {
        all.extend(part);
    }
    all
}

/// Vertices on faces where more than one pair joins the same two vertices, whose common side would have more than two
/// triangles: by face of a crossing.
fn middles(crossings: &[Crossing], crowded: &[Vec<(u32, u32)>], own: &[AtomicU32], vertices: &mut Vec<DVec3>) -> BTreeMap<u32, u32> {
    let mut middles = BTreeMap::new();
    for face in crowded {
        let mut joined = Vec::new();
        for &(number, other) in face {
            let (e, k) = (number as usize / 4, number as usize % 4);
            let [a, b] = [k, (k + 1) % 4].map(|k| vertex_of(&crossings[e], own, e, k));
            let ends = [a.min(b), a.max(b)];
            if joined.contains(&ends) {
                middles.insert(number, vertices.len() as u32);
                middles.insert(other, vertices.len() as u32);
                vertices.push(0.5 * (crossings[e].point + crossings[other as usize / 4].point));
            }
            joined.push(ends);
        }
    }
    middles
}

/// The vertex at a place of a crossing, where a leaf may fill the one before too.
fn vertex_of(crossing: &Crossing, own: &[AtomicU32], e: usize, k: usize) -> u32 {
    let before = (k + 3) % 4;
    let start = if crossing.leaves[before] == crossing.leaves[k] { before } else { k };
    own[4 * e + start].load(Ordering::Relaxed)
}

fn polygons(
    crossings: &[Crossing],
    depths: &[u32],
    own: &[AtomicU32],
    middles: &BTreeMap<u32, u32>,
    mut vertices: Vec<DVec3>,
    run: &Run<'_>,
) -> Result<TriangleMesh> {
    // Polygons with a vertex in a side are divided about the crossing itself.
    let mut centers = BTreeMap::new();
    for &face in middles.keys() {
        centers.entry(face / 4).or_insert_with(|| {
            vertices.push(crossings[face as usize / 4].point);
            vertices.len() as u32 - 1
        });
    }
    let parts = run.blocks("make the surface", crossings.len().div_ceil(CHUNK), |chunk| {
        let range = chunk * CHUNK..((chunk + 1) * CHUNK).min(crossings.len());
        let mut triangles: Vec<[u32; 3]> = Vec::with_capacity(2 * range.len());
        for e in range {
            let crossing = &crossings[e];
            let mut put = |[a, b, c]: [u32; 3]| triangles.push(if crossing.rising { [a, b, c] } else { [a, c, b] });
            if let Some(&center) = centers.get(&(e as u32)) {
                let mut rim = Vec::with_capacity(8);
                for k in crossing.places() {
                    rim.push(own[4 * e + k].load(Ordering::Relaxed));
                    rim.extend(middles.get(&((4 * e + crossing.last(k)) as u32)));
                }
                for i in 0..rim.len() {
                    put([center, rim[i], rim[(i + 1) % rim.len()]]);
                }
                continue;
            }
            let mut rim = [0; 4];
            let mut count = 0;
            for k in crossing.places() {
                rim[count] = own[4 * e + k].load(Ordering::Relaxed);
                count += 1;
            }
            if count < 4 {
                put([rim[0], rim[1], rim[2]]);
                continue;
            }
            for half in polygon::halves(crossing, depths, rim.map(|v| vertices[v as usize])) {
                put(half.map(|k| rim[k]));
            }
        }
        Ok(triangles)
    })?;
    let extent = Aabb::around(vertices.iter().copied());
    if !(extent.diagonal() > 0.0) {
        return Err(Error::invalid("the surface has shrunk to a point; choose another distance"));
    }
    TriangleMesh::new(vertices, joined(parts))
}
