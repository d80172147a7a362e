//! Exact transforms of images whose axes are not perpendicular.
//!
//! The squared distance then has mixed terms and no passes along axes add it up. A tree over the sites that can be nearest
//! to anything ([`boundary`]) is asked for every voxel, from the answer of the voxel before it ([`tree`]).

mod boundary;
mod tree;

use super::image::{Image, Reading};
use super::value::Site;
use super::{Measure, Target};
use crate::error::{Error, Result};
use crate::geom::{DVec3, Facet};
use crate::run::Run;
use tree::Tree;

/// Voxels that a thread takes at once, at least.
const TASK: usize = 1 << 12;

/// Bytes that a site takes in the tree, and while it is built.
const SITE: u64 = 72;

/// Bytes that a voxel takes while sites are looked for.
const VOXEL: u64 = 4;

/// What is asked of a transform with axes at any angles.
#[derive(Clone, Copy, Debug)]
pub struct Skewed<'a> {
    /// The voxels, row-major.
    pub image: Image<'a>,
    /// Number of voxels along each of two or three axes.
    pub shape: &'a [usize],
    /// The step from a voxel to the next along each axis; of two axes, in the plane z = 0.
    pub steps: &'a [DVec3],
    /// Which voxels distances go to.
    pub target: Target,
    /// Where the surface of a site lies.
    pub measure: Measure,
    /// Bytes that it may take beside its output.
    pub memory: u64,
}

impl Skewed<'_> {
    /// Writes the distance of every voxel to its nearest site, infinite where there is none.
    ///
    /// `sites` gets the flat index of that site, the lowest of equals, and [`Site::NONE`] where there is none. Distances
    /// are exact to rounding in double precision, and rounded to single.
    pub fn distance<S: Site>(&self, out: &mut [f32], sites: Option<&mut [S]>, run: &Run<'_>) -> Result<()> {
        self.check(out.len(), sites.as_ref().map(|sites| sites.len()))?;
        if out.is_empty() {
            return Ok(());
        }
        let reading = self.target.reading().unwrap_or(Reading::Foreground);
        self.afford("a search for boundaries", VOXEL, out.len())?;
        let found = boundary::boundary(self, reading, run)?;
        self.afford("a tree over the voxels at boundaries", SITE, found.len())?;
        let facets = match self.measure {
            Measure::Centers => Vec::new(),
            Measure::Between => self.faces(),
        };
        let tree = Tree::new(self, found, facets, run)?;
        let row = self.shape[self.shape.len() - 1];
        let task = row * TASK.div_ceil(row);
        let tasks: Vec<_> = match sites {
            Some(sites) => out.chunks_mut(task).zip(sites.chunks_mut(task).map(Some)).map(std::sync::Mutex::new).collect(),
            None => out.chunks_mut(task).map(|out| std::sync::Mutex::new((out, None))).collect(),
        };
        run.blocks("voxels", tasks.len(), |index| {
            let mut part = tasks[index].lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            let (out, sites) = &mut *part;
            self.part(&tree, reading, index * task, out, sites.as_deref_mut(), run)
        })?;
        Ok(())
    }

    /// The voxels from `start` on.
    fn part<S: Site>(
        &self,
        tree: &Tree<'_>,
        reading: Reading,
        start: usize,
        out: &mut [f32],
        mut sites: Option<&mut [S]>,
        run: &Run<'_>,
    ) -> Result<()> {
        let mut labels = vec![0; out.len()];
        self.image.labels(reading, start, &mut labels);
        let mut near = None;
        for (i, (distance, &label)) in out.iter_mut().zip(&labels).enumerate() {
            if i % 256 == 0 {
                run.cancel.check()?;
            }
            let own = match self.target {
                Target::Background => label == 0,
                Target::Foreground => label != 0,
                Target::OtherSide | Target::OtherLabel => false,
            };
            if own {
                *distance = 0.0;
                if let Some(sites) = &mut sites {
                    sites[i] = S::of(start + i);
                }
                continue;
            }
            near = tree.nearest(start + i, label, near);
            let length = near.map_or(f64::INFINITY, |found| found.square.sqrt()) as f32;
            *distance = if self.target == Target::OtherSide && label != 0 { -length } else { length };
            if let Some(sites) = &mut sites {
                sites[i] = near.map_or(S::NONE, |found| S::of(self.flat(found.site.place)));
            }
        }
        Ok(())
    }

    /// Turns distances from centre to centre into bounds of the distance to the surface that the image stands for.
    ///
    /// They hold for the surfaces that [`super::Transform::bounds`] names. A voxel reaches half its longest diagonal from its
    /// centre, and its neighbours three times as far, so they are wider than along perpendicular axes.
    pub fn bounds(&self, centres: &[f32], lower: &mut [f32], upper: &mut [f32], run: &Run<'_>) -> Result<()> {
        self.check(lower.len(), Some(upper.len()))?;
        self.check(centres.len(), None)?;
        let half = self.half_diagonal();
        let nearer = if self.target.reading().is_some() { 3.0 * half } else { half };
        let parts: Vec<_> = lower.chunks_mut(TASK).zip(upper.chunks_mut(TASK)).map(std::sync::Mutex::new).collect();
        run.blocks("bounds", parts.len(), |index| {
            let mut part = parts[index].lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            let (lower, upper) = &mut *part;
            for ((low, high), &centre) in lower.iter_mut().zip(upper.iter_mut()).zip(&centres[index * TASK..]) {
                let length = f64::from(centre.abs());
                // The distance was rounded to single precision, and so are the bounds, outward.
                let (least, most) = ((length * (1.0 - 1e-7) - nearer).max(0.0) as f32, (length * (1.0 + 1e-7) + half) as f32);
                let (least, most) = (least.next_down().max(0.0), most.next_up());
                (*low, *high) = if centre.is_sign_negative() { (-most, -least) } else { (least, most) };
            }
            Ok(())
        })?;
        Ok(())
    }

    /// Where a voxel lies, as indices along three axes.
    fn place(&self, flat: usize) -> [i32; 3] {
        let mut place = [0; 3];
        let mut rest = flat;
        for axis in (0..self.shape.len()).rev() {
            place[axis] = (rest % self.shape[axis]) as i32;
            rest /= self.shape[axis];
        }
        place
    }

    /// The flat index of a voxel.
    fn flat(&self, place: [i32; 3]) -> usize {
        self.shape.iter().zip(place).fold(0, |flat, (&length, index)| flat * length + index as usize)
    }

    /// A difference of indices as a vector.
    #[inline]
    fn vector(&self, steps: [i64; 3]) -> DVec3 {
        self.steps.iter().zip(steps).map(|(&step, count)| step * count as f64).sum()
    }

    /// The farthest that a voxel reaches from its centre.
    fn half_diagonal(&self) -> f64 {
        corners(self.shape.len()).map(|signs| self.vector(signs).length() / 2.0).fold(0.0, f64::max)
    }

    /// The faces of a voxel about the origin as triangles: a box has six; the voxel of an image of two axes is one.
    fn faces(&self) -> Vec<Facet> {
        let halves: Vec<DVec3> = self.steps.iter().map(|&step| step / 2.0).collect();
        let parallelogram = |centre: DVec3, u: DVec3, v: DVec3| {
            [Facet::new(centre - u - v, centre + u - v, centre + u + v), Facet::new(centre - u - v, centre + u + v, centre - u + v)]
        };
        match halves[..] {
            [u, v] => parallelogram(DVec3::ZERO, u, v).to_vec(),
            [u, v, w] => [(u, v, w), (v, w, u), (w, u, v)]
                .into_iter()
                .flat_map(|(out, u, v)| [parallelogram(out, u, v), parallelogram(-out, u, v)])
                .flatten()
                .collect(),
            _ => Vec::new(),
        }
    }

    fn afford(&self, what: &str, each: u64, count: usize) -> Result<()> {
        let needed = each.saturating_mul(count as u64);
        if needed > self.memory {
            return Err(Error::Memory { what: what.to_owned(), needed, allowed: self.memory });
        }
        Ok(())
    }

    fn check(&self, out: usize, sites: Option<usize>) -> Result<()> {
        if !(2..=3).contains(&self.shape.len()) || self.steps.len() != self.shape.len() {
            return Err(Error::invalid(format!(
                "an image of {} axes has no angles between them; give two or three, with a step for each",
                self.shape.len()
            )));
        }
        if let Some(longest) = self.shape.iter().find(|&&n| n > i32::MAX as usize / 2) {
            return Err(Error::invalid(format!(
                "an axis has {longest} voxels; transform parts of the image, of at most 2^30 along each axis"
            )));
        }
        let voxels = self.shape.iter().try_fold(1usize, |all, &n| all.checked_mul(n));
        if voxels != Some(self.image.len()) || voxels != Some(out) || sites.is_some_and(|sites| sites != out) {
            return Err(Error::invalid(format!(
                "an image of shape {:?} has not {} voxels for {out} distances",
                self.shape,
                self.image.len()
            )));
        }
        let volume = match self.steps {
            [u, v] => u.cross(*v).length(),
            [u, v, w] => u.cross(*v).dot(*w).abs(),
            _ => 0.0,
        };
        if !(volume > 0.0 && volume.is_finite()) {
            return Err(Error::invalid("the affine is singular or not finite, so voxels have no size; give one that can be inverted"));
        }
        if self.target == Target::OtherLabel && !self.image.has_labels() {
            return Err(Error::invalid("labels are whole numbers of at most 32 bits; number them first"));
        }
        Ok(())
    }
}

/// The corners of a box of so many axes, as signs.
fn corners(axes: usize) -> impl Iterator<Item = [i64; 3]> {
    (0..1usize << axes).map(move |bits| std::array::from_fn(|axis| if axis >= axes { 0 } else { 1 - 2 * (bits >> axis & 1) as i64 }))
}
