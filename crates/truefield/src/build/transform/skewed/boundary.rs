//! The sites that can be nearest to anything.
//!
//! Let u be nearest to v, and w the way from u to v. If w is not zero, some Voronoi-relevant vector r of the lattice has
//! |w - r| < |w|: u + r is nearer to v. So u + r has v's label or lies beyond the border; a site all of whose relevant
//! neighbours are sites like it is nearest to nothing. Relevant vectors are at most twice the covering radius long,
//! hence at most the diagonal of the box of the Gram-Schmidt vectors. For distances to the faces of voxels the neighbours
//! across faces, edges and corners decide in the same way.

use super::Skewed;
use crate::build::transform::Target;
use crate::build::transform::image::Reading;
use crate::error::Result;
use crate::geom::DVec3;
use crate::run::Run;

/// Voxels that a thread takes at once.
const TASK: usize = 1 << 16;

/// With more relevant neighbours than this it is cheaper to keep all sites.
const MOST: i64 = 4096;

/// A site that may be nearest.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    pub place: [i32; 3],
    pub label: u32,
}

/// All sites that may be nearest, in the order of the image.
pub(super) fn boundary(job: &Skewed<'_>, reading: Reading, run: &Run<'_>) -> Result<Vec<Candidate>> {
    let row = job.shape[job.shape.len() - 1];
    let rows = job.image.len() / row;
    let neighbours = neighbours(job);
    let mut labels = vec![0u32; job.image.len()];
    run.chunks("labels", &mut labels, TASK, |index, part| {
        job.image.check_numbers(index * TASK, part.len())?;
        job.image.labels(reading, index * TASK, part);
        Ok(())
    })?;
    let labels = &labels;
    let parts = run.blocks("boundary", rows, |index| {
        let mut found = Vec::new();
        for at in index * row..(index + 1) * row {
            let label = labels[at];
            let site = match job.target {
                Target::Background => label == 0,
                Target::Foreground => label != 0,
                Target::OtherSide | Target::OtherLabel => true,
            };
            if site && (neighbours.is_empty() || differs(job, labels, at, &neighbours)) {
                found.push(Candidate { place: job.place(at), label });
            }
        }
        Ok(found)
    })?;
    Ok(parts.concat())
}

/// Whether a neighbour has another label or lies beyond the border.
fn differs(job: &Skewed<'_>, labels: &[u32], at: usize, neighbours: &[[i64; 3]]) -> bool {
    let place = job.place(at);
    neighbours.iter().any(|steps| {
        let mut flat = 0;
        for axis in 0..job.shape.len() {
            let moved = i64::from(place[axis]) + steps[axis];
            if moved < 0 || moved >= job.shape[axis] as i64 {
                return true;
            }
            flat = flat * job.shape[axis] + moved as usize;
        }
        labels[flat] != labels[at]
    })
}

/// Every relevant vector, and every neighbour across a face, an edge or a corner; nothing if they are too many.
fn neighbours(job: &Skewed<'_>) -> Vec<[i64; 3]> {
    let axes = job.shape.len();
    // The volume of the lattice over that of the other two steps is how far apart its planes are.
    let third = if axes == 2 { job.steps[0].cross(job.steps[1]).normalize() } else { job.steps[2] };
    let [u, v, w] = [job.steps[0], job.steps[1], third];
    let volume = u.cross(v).dot(w).abs();
    let apart = [v.cross(w), w.cross(u), u.cross(v)].map(|normal| volume / normal.length());
    let across = v - u * (v.dot(u) / u.length_squared());
    let mut longest = u.length_squared() + across.length_squared();
    if axes == 3 {
        longest += apart[2] * apart[2];
    }
    let longest = longest.sqrt() * (1.0 + 1e-9);
    let reach: [i64; 3] = std::array::from_fn(|axis| if axis < axes { ((longest / apart[axis]).min(1e6) as i64).max(1) } else { 0 });
    if reach.iter().map(|reach| 2 * reach + 1).product::<i64>() > MOST {
        return Vec::new();
    }
    let mut found: Vec<(DVec3, [i64; 3])> = Vec::new();
    for x in -reach[0]..=reach[0] {
        for y in -reach[1]..=reach[1] {
            for z in -reach[2]..=reach[2] {
                let (steps, near) = ([x, y, z], x.abs().max(y.abs()).max(z.abs()) == 1);
                let vector = job.vector(steps);
                if steps != [0; 3] && (near || vector.length() <= longest) {
                    found.push((vector, steps));
                }
            }
        }
    }
    // The nearest are the likeliest to differ.
    found.sort_by(|a, b| a.0.length_squared().total_cmp(&b.0.length_squared()));
    found.into_iter().map(|(_, steps)| steps).collect()
}
