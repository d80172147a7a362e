//! What is not in a shape, and what is in several at once.

use std::sync::Arc;

use crate::distance::{Distance, SampleBlock, Source};
use crate::error::{Error, Result};
use crate::geom::{Aabb, Affine, DVec3, Interval};
use crate::source::tangent;

use super::union::Union;

/// The other side of a shape.
#[derive(Clone)]
pub struct Complement {
    shape: Arc<dyn Source>,
    extent: Option<Aabb>,
}

impl Complement {
    /// What is not in the shape; it has no end, unless it is known otherwise.
    pub fn new(shape: Arc<dyn Source>) -> Self {
        Self { shape, extent: None }
    }

    /// What is not in the shape, all of it in a box.
    pub(super) fn within(shape: Arc<dyn Source>, extent: Option<Aabb>) -> Self {
        Self { shape, extent }
    }
}

/// What lies in all the shapes: the greatest of their values.
pub fn intersection(shapes: &[Arc<dyn Source>]) -> Result<Complement> {
    let whole = Aabb::new(DVec3::NEG_INFINITY, DVec3::INFINITY);
    let common = shapes
        .iter()
        .filter_map(|shape| shape.extent())
        .fold(whole, |common, extent| Aabb { min: common.min.max(extent.min), max: common.max.min(extent.max) });
    if common.min.cmpgt(common.max).any() {
        return Err(Error::invalid("the shapes have no point in common: their boxes lie apart; move them until they overlap"));
    }
    let outsides = shapes.iter().map(|shape| Arc::new(Complement::new(Arc::clone(shape))) as Arc<dyn Source>).collect();
    let bounded = shapes.iter().any(|shape| shape.extent().is_some());
    let extent = bounded.then_some(common);
    Ok(Complement::within(Arc::new(Union::new(outsides)?.look_within(extent)), extent))
}

/// What is in a shape and in none of the others.
pub fn difference(shape: &Arc<dyn Source>, others: &[Arc<dyn Source>]) -> Result<Complement> {
    let mut parts: Vec<Arc<dyn Source>> = vec![Arc::new(Complement::new(Arc::clone(shape)))];
    parts.extend(others.iter().map(Arc::clone));
    let extent = shape.extent();
    Ok(Complement::within(Arc::new(Union::new(parts)?.look_within(extent)), extent))
}

impl Distance for Complement {
    fn extent(&self) -> Option<Aabb> {
        self.extent
    }

    fn below(&self, cell: &Aabb) -> Affine {
        tangent::below(self, cell)
    }

    fn at(&self, p: DVec3) -> Interval {
        self.shape.at(p).negated()
    }

    fn over(&self, cell: &Aabb) -> Interval {
        self.shape.over(cell).negated()
    }

    fn at_many(&self, points: &[DVec3], out: &mut [Interval]) {
        self.shape.at_many(points, out);
        for out in out {
            *out = out.negated();
        }
    }
}

impl Source for Complement {
    fn values(&self, points: &[DVec3], out: &mut [f64]) -> Result<()> {
        self.shape.values(points, out)?;
        for out in out {
            *out = -*out;
        }
        Ok(())
    }

    fn gradients(&self, points: &[DVec3], out: &mut [DVec3]) -> Result<()> {
        self.shape.gradients(points, out)?;
        for out in out {
            *out = -*out;
        }
        Ok(())
    }

    fn tilt(&self, p: DVec3) -> f64 {
        self.shape.tilt(p)
    }

    fn slack(&self, cell: &Aabb) -> Interval {
        self.shape.slack(cell).negated()
    }

    fn bend(&self, cell: &Aabb) -> Interval {
        self.shape.bend(cell).negated()
    }

    fn residual(&self, block: &SampleBlock<'_>, out: &mut [Interval]) -> Result<()> {
        let [values, said] = [block.values, block.said].map(|numbers| numbers.iter().map(|number| -number).collect::<Vec<f64>>());
        self.shape.residual(&block.with(&values, &said), out)?;
        for out in out {
            *out = out.negated();
        }
        Ok(())
    }

    fn is_flat(&self) -> bool {
        self.shape.is_flat()
    }

    fn sided(&self) -> bool {
        self.shape.sided()
    }

    fn noise(&self) -> f64 {
        self.shape.noise()
    }

    fn noise_over(&self, cell: &Aabb) -> f64 {
        self.shape.noise_over(cell)
    }
}
