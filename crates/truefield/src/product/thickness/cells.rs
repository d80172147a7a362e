//! Octree cells on an integer lattice, and what is known about the depth inside them.
//!
//! Depth bounds of second order in the cell's size carry everything here. Let `u` be the plain
//! distance to the surface, a cell have corners `x_k`, centre `c` and half diagonal `r`.
//!
//! * `u^2 - |x - c|^2` is a minimum of linear functions, hence concave, and lies above the
//!   trilinear interpolant of its corner values: `u(x)^2 >= trilinear(u_k^2)(x) - r^2`.
//! * The distance to one triangle is convex, hence below the trilinear interpolant of its corner
//!   values. So is every weighted mean of such distances, and `u` is below each of them. The best
//!   weights are those of a small matrix game (see [`super::game`]).

use crate::bvh::Candidate;
use crate::distance::Distance;
use crate::error::Result;
use crate::geom::{Aabb, DVec3};
use crate::run::{Run, Silent};
use crate::source::mesh::{Side, Surface};

use super::game;

/// Cells of level `LEVELS` have the lattice's unit as their edge.
pub(super) const LEVELS: u32 = 20;

/// Corners handed to a worker at a time: some hundred microseconds of work.
const BLOCK: usize = 256;

/// Cells whose children a worker looks at in one go.
const PARENTS: usize = 32;

/// A cell of the octree: `2^level` of them along the root's edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Cell {
    /// Morton code of the lowest corner on the finest lattice.
    pub code: u64,
    pub level: u32,
}

impl Cell {
    pub const ROOT: Self = Self { code: 0, level: 0 };

    /// Edge in units of the finest lattice.
    fn edge(self) -> u32 {
        1 << (LEVELS - self.level)
    }

    /// Number of finest cells inside: the codes `code .. code + span` are all in this cell.
    pub fn span(self) -> u64 {
        1 << (3 * (LEVELS - self.level))
    }

    pub fn children(self) -> impl Iterator<Item = Self> {
        let level = self.level + 1;
        let step = self.span() >> 3;
        (0..8).map(move |child| Self { code: self.code + child * step, level })
    }

    /// Code of the first finest cell of the same-sized neighbour across face 0..6 (-x, +x, -y, ...).
    pub fn neighbour(self, face: usize) -> Option<u64> {
        let mut index = decode(self.code);
        let edge = self.edge();
        let axis = face / 2;
        index[axis] = if face.is_multiple_of(2) { index[axis].checked_sub(edge)? } else { index[axis] + edge };
        (index[axis] < 1 << LEVELS).then(|| encode(index))
    }

    /// Codes of the 27 corners of the children, x running fastest.
    fn lattice_codes(self) -> [u64; 27] {
        let low = decode(self.code);
        let half = self.edge() / 2;
        let axis = |a: usize| [0, 1, 2].map(|i| spread(low[a] + half * i) << a);
        let [x, y, z] = [axis(0), axis(1), axis(2)];
        std::array::from_fn(|k| x[k % 3] | y[k / 3 % 3] | z[k / 9])
    }
}

/// Where in [`Cell::lattice_codes`] corner `corner` of child `child` is.
fn lattice_index(child: usize, corner: usize) -> usize {
    let axis = |a: usize| (child >> a & 1) + (corner >> a & 1);
    axis(0) + 3 * axis(1) + 9 * axis(2)
}

/// Spreads the lowest 21 bits to every third bit.
fn spread(value: u32) -> u64 {
    let mut x = u64::from(value) & 0x1f_ffff;
    x = (x | x << 32) & 0x1f_0000_0000_ffff;
    x = (x | x << 16) & 0x1f_0000_ff00_00ff;
    x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

fn gather(code: u64) -> u32 {
    let mut x = code & 0x1249_2492_4924_9249;
    x = (x | x >> 2) & 0x10c3_0c30_c30c_30c3;
    x = (x | x >> 4) & 0x100f_00f0_0f00_f00f;
    x = (x | x >> 8) & 0x1f_0000_ff00_00ff;
    x = (x | x >> 16) & 0x1f_0000_0000_ffff;
    ((x | x >> 32) & 0x1f_ffff) as u32
}

fn encode([x, y, z]: [u32; 3]) -> u64 {
    spread(x) | spread(y) << 1 | spread(z) << 2
}

fn decode(code: u64) -> [u32; 3] {
    [gather(code), gather(code >> 1), gather(code >> 2)]
}

/// A cell to split, with the depth that its children must exceed to be of interest.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ask {
    pub cell: Cell,
    pub exceed: f64,
}

/// What is known about a cell that may hold a point deeper than asked for.
pub(super) struct View<'a> {
    pub cell: Cell,
    pub bounds: Aabb,
    /// No point of the cell is shallower; negative infinity if the surface may cross the cell.
    pub lower: f64,
    /// No point of the cell is deeper.
    pub upper: f64,
    /// Depth that is certain at `place`, a point of the cell.
    pub best: f64,
    pub place: DVec3,
    /// Plain distances at the corners.
    pub distances: [f64; 8],
    /// For each triangle that is nearest to a corner, its distances to the corners.
    pub columns: &'a [[f64; 8]],
}

#[derive(Clone, Copy)]
struct Corner {
    side: Side,
    distance: f64,
    element: u32,
}

/// A solid laid over with the cells of an octree.
pub(super) struct Octree<'a> {
    surface: &'a Surface,
    origin: DVec3,
    unit: f64,
    /// Whether the side can change at the surface only.
    closed: bool,
    /// Rounding error of a distance, in model units.
    pub rounding: f64,
}

impl<'a> Octree<'a> {
    /// The root cell is a cube around the mesh, centred on it.
    pub fn new(surface: &'a Surface) -> Self {
        let extent = surface.mesh().extent();
        let side = extent.size().max_element() * (1.0 + 1e-9);
        let unit = side / f64::from(1 << LEVELS);
        Self {
            surface,
            origin: extent.center() - 0.5 * side,
            unit,
            closed: surface.side_changes_at_surface_only(),
            rounding: rounding(&extent),
        }
    }

    /// Length of a cell's diagonal.
    pub fn diagonal(&self, level: u32) -> f64 {
        self.unit * f64::from(1 << (LEVELS - level)) * 3f64.sqrt()
    }

    pub fn bounds(&self, cell: Cell) -> Aabb {
        let low = decode(cell.code);
        Aabb::new(self.point(low), self.point(low.map(|i| i + cell.edge())))
    }

    fn point(&self, index: [u32; 3]) -> DVec3 {
        self.origin + DVec3::from(index.map(f64::from)) * self.unit
    }

    /// Looks at the children of cells and keeps what `digest` makes of those that may reach deeper than asked for.
    ///
    /// Where a child is known to be deeper than `enough`, in one place or in all, the best upper
    /// bound is not looked for. The result holds eight entries for each cell asked: what was made
    /// of the child, `None` if it is not deep enough, and the upper bound of its depth.
    pub fn look<T: Send>(
        &self,
        asked: &[Ask],
        enough: f64,
        run: &Run<'_>,
        digest: impl Fn(&View<'_>) -> T + Sync,
    ) -> Result<Vec<(Option<T>, f64)>> {
        let quiet = Run { progress: &Silent, ..*run };
        let mut codes: Vec<u64> = asked.iter().flat_map(|ask| ask.cell.lattice_codes()).collect();
        codes.sort_unstable();
        codes.dedup();
        let blocks = codes.len().div_ceil(BLOCK);
        let corners: Vec<Corner> = quiet
            .blocks("corners", blocks, |block| {
                let codes = &codes[block * BLOCK..codes.len().min((block + 1) * BLOCK)];
                Ok(self.corners(codes))
            })?
            .concat();
        let blocks = asked.len().div_ceil(PARENTS);
        let views = quiet.blocks("cells", blocks, |block| {
            let asked = &asked[block * PARENTS..asked.len().min((block + 1) * PARENTS)];
            let mut columns = Vec::with_capacity(8);
            let mut seen = Vec::with_capacity(8 * asked.len());
            for ask in asked {
                let lattice = ask.cell.lattice_codes().map(|code| corners[codes.partition_point(|&c| c < code)]);
                for (child, cell) in ask.cell.children().enumerate() {
                    let eight = std::array::from_fn(|corner| lattice[lattice_index(child, corner)]);
                    seen.push(self.view(Ask { cell, ..*ask }, &eight, enough, &mut columns, &digest));
                }
            }
            Ok(seen)
        })?;
        Ok(views.into_iter().flatten().collect())
    }

    /// Distances and sides of corners in Morton order: each starts from what its predecessor tells.
    fn corners(&self, codes: &[u64]) -> Vec<Corner> {
        let (tree, scale) = (self.surface.tree(), self.surface.scale());
        let mut warm = 0;
        // A point whose side is certain, and its distance: the ball around it is on one side.
        let mut known: Option<(DVec3, f64, Side)> = None;
        let corner = |&code: &u64| {
            let p = self.point(decode(code));
            let q = p * scale;
            let start = Candidate { distance_squared: tree.facet(warm).distance_squared(q), triangle: warm };
            let found = tree.nearest(q, start);
            warm = found.triangle;
            let distance = found.distance_squared.sqrt() / scale;
            let side = match known {
                Some((at, clear, side)) if self.closed && at.distance(p) < clear - self.rounding => side,
                _ => self.surface.side(q, &tree.facet(warm).nearest(q), warm),
            };
            if side.is_certain() {
                known = Some((p, distance, side));
            }
            Corner { side, distance, element: found.triangle }
        };
        codes.iter().map(corner).collect()
    }

    /// The one side of a cell that the surface does not meet, if it has one.
    fn side(&self, bounds: &Aabb, radius: f64, corners: &[Corner; 8]) -> Option<Side> {
        if self.closed {
            return corners.iter().map(|c| c.side).find(|side| side.is_certain());
        }
        // In the holes of an open mesh the side changes away from the surface: ask about the ball around the cell.
        let (tree, scale) = (self.surface.tree(), self.surface.scale());
        let q = bounds.center() * scale;
        let found = tree.nearest(q, Candidate::within(f64::INFINITY));
        if found.distance_squared.sqrt() <= radius * scale {
            return None;
        }
        self.surface.side_of_ball(q, &tree.facet(found.triangle).nearest(q), found.triangle, radius * scale)
    }

    /// The view of one cell handed to `digest`, and the upper bound that was reached.
    fn view<T>(
        &self,
        ask: Ask,
        corners: &[Corner; 8],
        enough: f64,
        columns: &mut Vec<[f64; 8]>,
        digest: &impl Fn(&View<'_>) -> T,
    ) -> (Option<T>, f64) {
        let cell = ask.cell;
        let diagonal = self.diagonal(cell.level) * (1.0 + 1e-12);
        let radius = 0.5 * diagonal;
        let distances = corners.map(|c| c.distance);
        let smallest = distances.iter().copied().fold(f64::INFINITY, f64::min);
        // 1-Lipschitz, counting corners outside as negative.
        let outside = |c: &Corner| self.closed && c.side == Side::Outside;
        let reach = corners.iter().map(|c| if outside(c) { -c.distance } else { c.distance }).fold(f64::INFINITY, f64::min);
        let mut upper = reach + diagonal + self.rounding;
        if upper <= ask.exceed {
            return (None, upper);
        }
        let clearance = smallest * smallest - radius * radius;
        let clear = smallest > self.rounding && clearance > 0.0;
        let bounds = self.bounds(cell);
        let inside = match if clear { self.side(&bounds, radius, corners) } else { None } {
            Some(Side::Outside) => return (None, f64::NEG_INFINITY),
            side => side == Some(Side::Inside),
        };
        let lower = if inside { clearance.sqrt() - self.rounding } else { f64::NEG_INFINITY };
        let (mut best, mut place) = (f64::NEG_INFINITY, bounds.center());
        for (k, corner) in corners.iter().enumerate() {
            if corner.side == Side::Inside && corner.distance > best {
                (best, place) = (corner.distance, bounds.corner(k));
            }
        }
        columns.clear();
        if lower <= enough {
            let scale = self.surface.scale();
            let points: [DVec3; 8] = std::array::from_fn(|k| bounds.corner(k));
            for (k, corner) in corners.iter().enumerate() {
                if corners[..k].iter().any(|c| c.element == corner.element) {
                    continue;
                }
                let facet = self.surface.tree().facet(corner.element);
                columns.push(points.map(|p| facet.distance_squared(p * scale).sqrt() / scale));
            }
            for column in columns.iter() {
                upper = upper.min(column.iter().copied().fold(0.0, f64::max) + self.rounding);
            }
            if upper > ask.exceed && best <= enough && columns.len() > 1 {
                let (value, mixture) = game::solve(columns);
                upper = upper.min(value + self.rounding);
                if upper > ask.exceed {
                    let p = points.iter().zip(mixture).fold(DVec3::ZERO, |sum, (&p, weight)| sum + p * weight);
                    let p = p.clamp(bounds.min, bounds.max);
                    let depth = -self.surface.at(p).upper;
                    if depth > best {
                        (best, place) = (depth, p);
                    }
                }
            }
            if upper <= ask.exceed {
                return (None, upper);
            }
        }
        let view = View { cell, bounds, lower, upper, best: best - self.rounding, place, distances, columns };
        (Some(digest(&view)), upper)
    }
}

/// Rounding error of a distance to a mesh in this box: some ulp of its largest coordinate.
pub(super) fn rounding(extent: &Aabb) -> f64 {
    32.0 * f64::EPSILON * extent.min.abs().max(extent.max.abs()).max_element()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_round_trip_and_children_tile_their_parent() {
        for index in [[0, 0, 0], [1, 2, 3], [1 << 20, 1 << 20, 1 << 20], [123_456, 654_321, 999_999]] {
            assert_eq!(decode(encode(index)), index);
        }
        let parent = Cell::ROOT.children().nth(5).and_then(|c| c.children().nth(3)).expect("a grandchild");
        let children: Vec<_> = parent.children().collect();
        assert_eq!(children[0].code, parent.code);
        assert_eq!(children[7].code + children[7].span(), parent.code + parent.span());
        let first = children[0];
        assert_eq!(first.neighbour(1), Some(children[1].code));
        assert_eq!(first.neighbour(3), Some(children[2].code));
        assert_eq!(first.neighbour(5), Some(children[4].code));
        assert_eq!(Cell::ROOT.neighbour(0), None);
        assert_eq!(Cell::ROOT.neighbour(1), None);
    }
}
