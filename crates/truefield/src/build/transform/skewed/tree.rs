//! A tree of boxes over sites, asked for the nearest one of another label.

use super::Skewed;
use super::boundary::Candidate;
use crate::error::Result;
use crate::geom::{Aabb, Facet};
use crate::run::Run;

/// Sites in a leaf, at most.
const LEAF: usize = 8;

/// How much farther than the best a box may seem to be, for all rounding.
const SLACK: f64 = 1e-9;

/// A box, and the sites in it.
struct Node {
    extent: Aabb,
    start: usize,
    end: usize,
    /// The second child; the first follows the node. 0 for a leaf.
    second: usize,
    /// The label of all sites in it, if they have one in common.
    label: Option<u32>,
}

/// The nearest site.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    pub square: f64,
    pub site: Candidate,
}

pub(super) struct Tree<'a> {
    job: &'a Skewed<'a>,
    sites: Vec<Candidate>,
    nodes: Vec<Node>,
    /// The faces of a voxel about its centre, where distances go to them.
    facets: Vec<Facet>,
    /// How far a site reaches from its centre.
    radius: f64,
}

impl<'a> Tree<'a> {
    pub fn new(job: &'a Skewed<'a>, sites: Vec<Candidate>, facets: Vec<Facet>, run: &Run<'_>) -> Result<Self> {
        let radius = if facets.is_empty() { 0.0 } else { job.half_diagonal() };
        let mut tree = Self { job, sites, nodes: Vec::new(), facets, radius };
        if !tree.sites.is_empty() {
            tree.grow(0, tree.sites.len(), run)?;
        }
        Ok(tree)
    }

    /// A node over some sites, and all below it.
    fn grow(&mut self, start: usize, end: usize, run: &Run<'_>) -> Result<()> {
        run.cancel.check()?;
        let job = self.job;
        let sites = &mut self.sites[start..end];
        let extent = Aabb::around(sites.iter().map(|site| job.vector(site.place.map(i64::from))));
        let label = Some(sites[0].label).filter(|&label| sites.iter().all(|site| site.label == label));
        let node = self.nodes.len();
        self.nodes.push(Node { extent, start, end, second: 0, label });
        if end - start <= LEAF {
            return Ok(());
        }
        let size = extent.size();
        let axis = (0..3).fold(0, |widest, axis| if size[axis] > size[widest] { axis } else { widest });
        let half = (end - start) / 2;
        sites.select_nth_unstable_by(half, |a, b| {
            let along = |site: &Candidate| job.vector(site.place.map(i64::from))[axis];
            along(a).total_cmp(&along(b)).then(a.place.cmp(&b.place))
        });
        self.grow(start, start + half, run)?;
        self.nodes[node].second = self.nodes.len();
        self.grow(start + half, end, run)
    }

    /// The nearest site to a voxel whose label is another one; of equals the lowest. `hint` is a guess.
    pub fn nearest(&self, voxel: usize, label: u32, hint: Option<Found>) -> Option<Found> {
        if self.nodes.is_empty() {
            return None;
        }
        let place = self.job.place(voxel);
        let at = self.job.vector(place.map(i64::from));
        // No site is as far as this.
        let mut best = Found { square: f64::INFINITY, site: Candidate { place: [i32::MAX; 3], label } };
        if let Some(hint) = hint.filter(|hint| hint.site.label != label) {
            self.consider(&mut best, place, hint.site);
        }
        let scale = at.length_squared();
        let mut waiting = [(0usize, 0.0f64); 64];
        let mut count = 1;
        waiting[0] = (0, self.nodes[0].extent.distance_squared(at));
        while count > 0 {
            count -= 1;
            let (index, square) = waiting[count];
            if self.beyond(square, best.square, scale) {
                continue;
            }
            let node = &self.nodes[index];
            if node.label == Some(label) {
                continue;
            }
            if node.second == 0 {
                for &site in &self.sites[node.start..node.end] {
                    if site.label != label {
                        self.consider(&mut best, place, site);
                    }
                }
                continue;
            }
            let children = [index + 1, node.second].map(|child| (child, self.nodes[child].extent.distance_squared(at)));
            let [near, far] = if children[0].1 <= children[1].1 { children } else { [children[1], children[0]] };
            waiting[count] = far;
            waiting[count + 1] = near;
            count += 2;
        }
        best.square.is_finite().then_some(best)
    }

    /// Whether nothing in a box can be as near as the best.
    #[inline]
    fn beyond(&self, square: f64, best: f64, scale: f64) -> bool {
        let limit = if self.radius == 0.0 { best } else { (best.sqrt() + self.radius).powi(2) };
        square > limit + SLACK * (limit + SLACK * scale)
    }

    /// Takes a site that is nearer than the best, or as near and lower.
    #[inline]
    fn consider(&self, best: &mut Found, place: [i32; 3], site: Candidate) {
        let way = self.job.vector(std::array::from_fn(|axis| i64::from(site.place[axis] - place[axis])));
        let square = if self.facets.is_empty() {
            way.length_squared()
        } else if self.beyond(way.length_squared(), best.square, 0.0) {
            return;
        } else {
            self.facets.iter().map(|facet| facet.distance_squared(-way)).fold(f64::INFINITY, f64::min)
        };
        if square < best.square || square == best.square && site.place < best.site.place {
            *best = Found { square, site };
        }
    }
}
