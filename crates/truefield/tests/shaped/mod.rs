//! Shapes whose distance is a formula, and trees of them; trees of any values.

// Each test file uses its own part of this.
#![allow(dead_code)]

use truefield::build::adaptive::{Reconstruction, Rule, Rules, adaptive, root};
use truefield::field::adaptive::{Accuracy, AdaptiveField, Division, Level, LevelKind, Levels, Record, Root};
use truefield::laws::Random;
use truefield::{Aabb, Continuity, DVec3, Distance, Interval, Result, Run, Source};

/// A signed distance as a closure, 1-Lipschitz.
pub struct Shape {
    pub extent: Aabb,
    pub value: Box<dyn Fn(DVec3) -> f64 + Send + Sync>,
}

impl Shape {
    pub fn new(low: [f64; 3], high: [f64; 3], value: impl Fn(DVec3) -> f64 + Send + Sync + 'static) -> Self {
        Self { extent: Aabb::new(DVec3::from_array(low), DVec3::from_array(high)), value: Box::new(value) }
    }
}

impl Distance for Shape {
    fn extent(&self) -> Option<Aabb> {
        Some(self.extent)
    }

    fn at(&self, p: DVec3) -> Interval {
        Interval::exact((self.value)(p))
    }
}

impl Source for Shape {
    fn values(&self, points: &[DVec3], out: &mut [f64]) -> Result<()> {
        for (p, out) in points.iter().zip(out) {
            *out = (self.value)(*p);
        }
        Ok(())
    }
}

pub fn ball_value(p: DVec3, center: DVec3, radius: f64) -> f64 {
    (p - center).length() - radius
}

pub fn box_value(p: DVec3, low: DVec3, high: DVec3) -> f64 {
    let q = (low - p).max(p - high);
    q.max(DVec3::ZERO).length() + q.max_element().min(0.0)
}

pub fn torus_value(p: DVec3, large: f64, small: f64) -> f64 {
    (p.x.hypot(p.y) - large).hypot(p.z) - small
}

pub fn ball(center: DVec3, radius: f64) -> Shape {
    Shape { extent: Aabb::new(center - radius, center + radius), value: Box::new(move |p| ball_value(p, center, radius)) }
}

pub fn cuboid(low: DVec3, high: DVec3) -> Shape {
    Shape { extent: Aabb::new(low, high), value: Box::new(move |p| box_value(p, low, high)) }
}

pub fn torus(large: f64, small: f64) -> Shape {
    let out = large + small;
    Shape::new([-out, -out, -small], [out, out, small], move |p| torus_value(p, large, small))
}

/// Rules that divide near the surface only.
pub fn near(tolerance: f64, max_depth: u32) -> Rules {
    Rules { growth: f64::INFINITY, max_depth, rule: Rule::Samples, ..Rules::within(tolerance) }
}

pub fn tree(shape: &Shape, rules: &Rules) -> AdaptiveField {
    tree_in(shape, None, rules)
}

pub fn tree_in(shape: &Shape, domain: Option<Aabb>, rules: &Rules) -> AdaptiveField {
    let root = root(shape, domain, Division::Octree).expect("a domain");
    adaptive(shape, root, rules, &Run::default()).expect("a field")
}

pub fn cubic(rules: &Rules) -> Rules {
    Rules { reconstruction: Reconstruction::Cubic, ..*rules }
}

/// A tree divided at random down to `depth`, whose values at the places of the finest cells are `value`.
pub fn random_tree(
    random: &mut Random,
    extent: Aabb,
    division: Division,
    depth: u32,
    mut value: impl FnMut([u32; 3]) -> f32,
) -> AdaptiveField {
    let root = Root { extent, division };
    let accuracy = Accuracy { tolerance: 1.0, growth: f64::INFINITY, max_depth: depth, rule: Rule::Verified };
    let mut levels = Levels::new(root, Continuity::Everywhere, accuracy);
    let mut cells = vec![[0u32; 3]];
    for at in 0..=depth {
        let (mut level, mut next) = (Level::default(), Vec::new());
        for index in cells {
            let corners = std::array::from_fn(|corner| {
                value(std::array::from_fn(|axis| {
                    if axis == 2 && division == Division::Quadtree {
                        0
                    } else {
                        (index[axis] + (corner as u32 >> axis & 1)) << (depth - at)
                    }
                }))
            });
            let divide = at < depth && (at == 0 || random.below(3) > 0);
            let record = Record { corners, lower: -1.0, upper: 1.0 };
            level.push(if divide { LevelKind::Branch } else { LevelKind::Linear }, record);
            if divide {
                let children = if division == Division::Octree { 8 } else { 4 };
                next.extend((0..children).map(|octant| std::array::from_fn(|axis| 2 * index[axis] + (octant >> axis & 1))));
            }
        }
        levels.levels.push(level);
        cells = next;
        if cells.is_empty() {
            break;
        }
    }
    AdaptiveField::from_levels(&levels, None, &Run::default()).expect("a field")
}
