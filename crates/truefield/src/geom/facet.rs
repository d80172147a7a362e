//! Nearest point of a triangle: the one function behind every exact distance.

use super::{DVec3, Feature};

/// A triangle prepared for nearest-point queries.
///
/// The nearest point is the best of the foot on the plane, where that foot lies inside, and of the
/// feet on the three edges. Every candidate is a point of the triangle, so rounding can only make
/// the answer longer, by a few ulp of the lengths involved, also for slivers: the foot on the plane
/// is found along `ab` first and then across it, so that the coordinate which a sliver spoils moves
/// the foot across the sliver by an ulp of those lengths and not along it. Two barycentric
/// coordinates with an error each would move it along the sliver by 1 / (relative height) ulp.
#[derive(Clone, Copy, Debug)]
pub struct Facet {
    /// First corner.
    pub a: DVec3,
    /// Edge vectors from the first corner.
    pub ab: DVec3,
    /// See `ab`.
    pub ac: DVec3,
    /// `dot(w, v)` is the coordinate along `ac` of a `w` that has no part along `ab`; 0 where the triangle has no area.
    pub v: DVec3,
    /// 1 / squared length of edges ab, bc, ca; 0 where the edge has no length.
    pub inverse: DVec3,
    /// How far `ac` goes along `ab`: `ac - ab * slope` is across `ab`.
    pub slope: f64,
}

/// Nearest point of one facet.
#[derive(Clone, Copy, Debug)]
pub struct FacetPoint {
    /// The nearest point.
    pub point: DVec3,
    /// Its squared distance.
    pub distance_squared: f64,
    /// Where on the triangle it lies.
    pub feature: Feature,
}

/// Squared distance and where it is attained, in coordinates along `ab` and `ac`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Foot {
    pub distance_squared: f64,
    pub s: f64,
    pub t: f64,
}

impl Facet {
    /// Prepares the triangle `a b c`, degenerate ones included.
    pub fn new(a: DVec3, b: DVec3, c: DVec3) -> Self {
        let (ab, ac) = (b - a, c - a);
        let bc = ac - ab;
        let reciprocal = |x: f64| if x > 0.0 && (1.0 / x).is_finite() { 1.0 / x } else { 0.0 };
        let inverse = DVec3::new(reciprocal(ab.length_squared()), reciprocal(bc.length_squared()), reciprocal(ac.length_squared()));
        let slope = ac.dot(ab) * inverse.x;
        let across = ac - ab * slope;
        // No height leaves the edges alone: t = 0 never counts as inside.
        Self { a, ab, ac, v: across * reciprocal(across.length_squared()), inverse, slope }
    }

    /// Squared distance from `p`; the same bits as [`Facet::nearest`].
    #[inline(always)]
    pub fn distance_squared(&self, p: DVec3) -> f64 {
        self.foot(p).distance_squared
    }

    /// The four candidates, branch-free so that lanes of it vectorise.
    #[inline(always)]
    pub(crate) fn foot(&self, p: DVec3) -> Foot {
        let w = p - self.a;
        let bc = self.ac - self.ab;
        let wb = w - self.ab;
        // Edge ab.
        let along = w.dot(self.ab) * self.inverse.x;
        let s1 = along.clamp(0.0, 1.0);
        let d1 = (w - self.ab * s1).length_squared();
        // Edge bc.
        let t2 = (wb.dot(bc) * self.inverse.y).clamp(0.0, 1.0);
        let d2 = (wb - bc * t2).length_squared();
        // Edge ac.
        let t3 = (w.dot(self.ac) * self.inverse.z).clamp(0.0, 1.0);
        let d3 = (w - self.ac * t3).length_squared();
        // Face.
        let t4 = (w - self.ab * along).dot(self.v);
        let s4 = along - self.slope * t4;
        let d4 = (w - self.ab * s4 - self.ac * t4).length_squared();
        let inside = (s4 > 0.0) & (t4 > 0.0) & (s4 + t4 < 1.0);
        let mut foot = Foot { distance_squared: d1, s: s1, t: 0.0 };
        let nearer = d2 < foot.distance_squared;
        foot.distance_squared = if nearer { d2 } else { foot.distance_squared };
        foot.s = if nearer { 1.0 - t2 } else { foot.s };
        foot.t = if nearer { t2 } else { foot.t };
        let nearer = d3 < foot.distance_squared;
        foot.distance_squared = if nearer { d3 } else { foot.distance_squared };
        foot.s = if nearer { 0.0 } else { foot.s };
        foot.t = if nearer { t3 } else { foot.t };
        let nearer = inside & (d4 < foot.distance_squared);
        foot.distance_squared = if nearer { d4 } else { foot.distance_squared };
        foot.s = if nearer { s4 } else { foot.s };
        foot.t = if nearer { t4 } else { foot.t };
        foot
    }

    /// Nearest point, its squared distance and the feature it lies on.
    pub fn nearest(&self, p: DVec3) -> FacetPoint {
        self.at(self.foot(p))
    }

    /// The nearest point that [`Facet::foot`] found.
    #[inline]
    pub(crate) fn at(&self, foot: Foot) -> FacetPoint {
        let (s, t) = (foot.s, foot.t);
        // The three edges set exact zeros and ones, so the feature can be read off.
        let feature = if t == 0.0 {
            if s == 0.0 {
                Feature::Vertex(0)
            } else if s == 1.0 {
                Feature::Vertex(1)
            } else {
                Feature::Edge(0)
            }
        } else if s == 0.0 {
            if t == 1.0 { Feature::Vertex(2) } else { Feature::Edge(2) }
        } else if s == 1.0 - t {
            Feature::Edge(1)
        } else {
            Feature::Face
        };
        FacetPoint { point: self.a + self.ab * s + self.ac * t, distance_squared: foot.distance_squared, feature }
    }
}
