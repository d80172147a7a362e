//! What a field says lies within its own bounds, and these enclose its source: whatever the method, edited, loaded, coarsened.

mod balls;
mod nasty;

use std::sync::Arc;

use balls::{Ball, Solid, Step};
use nasty::shapes;
use truefield::build::adaptive::{Leaves, Reconstruction, Rule, Rules, adaptive, adaptive_mesh, coalesce, root};
use truefield::field::adaptive::{AdaptiveField, Division, LevelKind};
use truefield::laws::Random;
use truefield::op::edit::{Operation, edit};
use truefield::op::level_of_detail::{Detail, level_of_detail};
use truefield::{
    Aabb, Continuity, DVec3, Distance, Interval, Known, Lattice, Result, Run, SampleBlock, SampledField, SignChoice, Source, Surface,
};

const POINTS: usize = 60_000;

/// Both, at many points: `truth` is what the bounds have to meet.
fn check(name: &str, field: &AdaptiveField, truth: &dyn Fn(DVec3) -> Interval) {
    let mut random = Random::new(9);
    let domain = field.extent_box();
    let mut points: Vec<DVec3> = (0..POINTS).map(|_| random.within(&domain)).collect();
    // Corners are where nothing but rounding parts what is said from what is so.
    field.walk(&mut |cell| {
        if cell.is_leaf() && points.len() < 2 * POINTS {
            points.extend((0..8).map(|corner| cell.extent().corner(corner)));
        }
        true
    });
    let run = Run::default();
    let (said, bounds) = (field.distances(&points, &run).expect("distances"), field.bounds(&points, &run).expect("bounds"));
    for ((&p, said), bounds) in points.iter().zip(said).zip(bounds) {
        assert!(bounds.contains(said), "{name}: {said:e} at {p} is not in {bounds:?}");
        let (truth, rounding) = (truth(p), 1e-12 * domain.diagonal());
        assert!(
            bounds.lower <= truth.upper + rounding && truth.lower <= bounds.upper + rounding,
            "{name}: {truth:?} at {p} is not in {bounds:?}"
        );
        let leaf = field.find(p).expect("a leaf");
        assert!(leaf.bounds(p).contains(leaf.value(p)), "{name}: {} at {p} is not in {:?}", leaf.value(p), leaf.bounds(p));
    }
}

/// The field itself, what comes back of it from flat arrays, and what is coarser.
fn check_all(name: &str, field: &AdaptiveField, truth: &dyn Fn(DVec3) -> Interval) {
    let run = Run::default();
    check(name, field, truth);
    let mut levels = field.to_levels();
    let same = AdaptiveField::from_levels(&levels, field.surface().cloned(), &run).expect("a field");
    assert!(same.to_levels() == levels, "{name}: what is read is what was written");
    // As written by others: errors that leave out what rounding of the corners does.
    for level in &mut levels.levels {
        for (record, _) in level.records.iter_mut().zip(&level.kinds).filter(|(_, kind)| **kind == LevelKind::Linear) {
            (record.lower, record.upper) = (record.lower.max(f32::MIN_POSITIVE), record.upper.max(f32::MIN_POSITIVE));
        }
    }
    let narrowed = AdaptiveField::from_levels(&levels, field.surface().cloned(), &run).expect("a field");
    let mut random = Random::new(3);
    for _ in 0..1000 {
        let p = random.within(&field.extent_box());
        let leaf = narrowed.find(p).expect("a leaf");
        assert!(leaf.bounds(p).contains(leaf.value(p)), "{name}: {} at {p} of a file", leaf.value(p));
    }
    for detail in [Detail::Tolerance(0.05), Detail::Depth(3)] {
        check(name, &level_of_detail(field, detail, &run).expect("a field"), truth);
    }
}

fn edited(reconstruction: Reconstruction, rule: Rule, center: DVec3) {
    let run = Run::default();
    let ball = |x: f64, y: f64, z: f64, radius: f64| Ball { center: center + DVec3::new(x, y, z), radius };
    let first = ball(0.0, 0.0, 0.0, 1.0);
    let rules = Rules { reconstruction, rule, max_depth: 6, ..Rules::within(0.01) };
    // No corner lies in the middle of a ball, where the judge is none.
    let domain = Aabb::new(center - DVec3::new(1.3, 1.2, 1.21), center + DVec3::new(1.41, 1.5, 1.3));
    let mut field = adaptive(&first, root(&first, Some(domain), Division::Octree).expect("a box"), &rules, &run).expect("a field");
    check_all("a ball", &field, &|p| first.at(p));
    let steps =
        [(Step::Carve, ball(0.8, 0.1, 0.0, 0.4)), (Step::Fill, ball(0.0, 0.9, 0.2, 0.5)), (Step::Intersect, ball(0.0, 0.0, 0.2, 1.1))];
    for (step, tool) in &steps {
        let operation = match step {
            Step::Carve => Operation::Carve,
            Step::Fill => Operation::Fill,
            Step::Intersect => Operation::Intersect,
        };
        field = edit(&field, tool, operation, 1 << 30, &run).expect("a field");
    }
    let solid = Solid::new(first, &steps);
    check_all("a ball that was edited", &field, &|p| {
        let distance = solid.distance(p);
        assert_eq!(solid.value(p) < 0.0, distance < 0.0);
        Interval::exact(distance)
    });
}

#[test]
fn fields_of_shapes_lie_within_their_own_bounds() {
    // Off the origin nothing is a number of single precision.
    for center in [DVec3::ZERO, DVec3::new(1.1, -0.3, 0.7)] {
        for reconstruction in [Reconstruction::Linear, Reconstruction::Cubic] {
            for rule in [Rule::Verified, Rule::Samples] {
                edited(reconstruction, rule, center);
            }
        }
    }
}

#[test]
fn fields_of_meshes_lie_within_their_own_bounds() {
    let run = Run::default();
    let off = shapes::moved(&shapes::torus(40, 20, 1.0, 0.4), |p| p * 0.7 + DVec3::new(0.3, 0.1, 7.0));
    for soup in [shapes::cube(), off] {
        let surface = Arc::new(Surface::new(Arc::new(shapes::welded(&soup)), SignChoice::Auto, &run).expect("a surface"));
        for leaves in [Leaves::Linear, Leaves::Exact, Leaves::Mixed] {
            let place = root(&*surface, None, Division::Octree).expect("a box");
            let rules = Rules { max_depth: 6, ..Rules::within(0.01) };
            let field = adaptive_mesh(&surface, place, leaves, &rules, &run).expect("a field");
            check_all("a mesh", &field, &|p| surface.at(p));
            let tool = Ball { center: surface.mesh().extent().max, radius: 0.4 };
            let carved = edit(&field, &tool, Operation::Carve, 1 << 30, &run).expect("a field");
            // Where it is the lesser of both in truth: inside, and next to the surface.
            check_all("a mesh that was carved", &carved, &|p| {
                let value = surface.at(p).lower.max(-tool.value(p));
                if value < 0.0 { Interval::exact(value) } else { Interval { lower: value, upper: f64::INFINITY } }
            });
        }
    }
}

#[test]
fn fields_of_samples_lie_within_their_own_bounds() {
    let ball = Ball::new(0.3, 0.2, 0.1, 1.0);
    let lattice = Lattice { origin: DVec3::splat(-1.3), spacing: DVec3::new(0.1, 0.11, 0.12), first: [0; 3], shape: [31, 30, 29] };
    let values: Vec<f32> = (0..lattice.len()).map(|n| ball.value(lattice.node(n)) as f32).collect();
    let known = Known::Rounded { band: f64::INFINITY, doubtful: Vec::new() };
    let samples = SampledField::new(lattice, values, known, Continuity::Everywhere).expect("samples");
    check_all("samples", &coalesce(&samples, &Rules::within(0.01), &Run::default()).expect("a field"), &|p| ball.at(p));
}

/// Says of itself what cannot be.
struct Muddled;

impl Distance for Muddled {
    fn extent(&self) -> Option<Aabb> {
        Ball::new(0.0, 0.0, 0.0, 1.0).extent()
    }

    fn at(&self, p: DVec3) -> Interval {
        Ball::new(0.0, 0.0, 0.0, 1.0).at(p)
    }
}

impl Source for Muddled {
    fn values(&self, points: &[DVec3], out: &mut [f64]) -> Result<()> {
        Ball::new(0.0, 0.0, 0.0, 1.0).values(points, out)
    }

    fn residual(&self, _: &SampleBlock<'_>, out: &mut [Interval]) -> Result<()> {
        out.fill(Interval { lower: 0.1, upper: -0.1 });
        Ok(())
    }
}

#[test]
fn claims_that_contradict_each_other_are_named() {
    let place = root(&Muddled, None, Division::Octree).expect("a box");
    let refused = adaptive(&Muddled, place, &Rules::within(0.5), &Run::default()).expect_err("refused").to_string();
    assert!(refused.contains("contradicts itself") && !refused.contains("file"), "{refused}");
}
