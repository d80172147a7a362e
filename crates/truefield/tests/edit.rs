//! Editing: the same as building anew, within the tolerance; nothing far away changes; bounds hold after any number.

mod balls;

use balls::{Ball, Solid, Step};
use truefield::build::adaptive::{Reconstruction, Rules, adaptive, root};
use truefield::field::adaptive::{AdaptiveField, Division};
use truefield::laws::Random;
use truefield::op::edit::{Operation, edit};
use truefield::{Aabb, DVec3, Distance, Error, Interval, Result, Run, Source};

const PLENTY: u64 = 1 << 32;

fn field(source: &dyn Source, rules: &Rules) -> AdaptiveField {
    adaptive(source, root(source, None, Division::Octree).expect("a box"), rules, &Run::default()).expect("a field")
}

fn operation(step: Step) -> Operation {
    match step {
        Step::Carve => Operation::Carve,
        Step::Fill => Operation::Fill,
        Step::Intersect => Operation::Intersect,
    }
}

fn apply(field: &AdaptiveField, step: Step, ball: &Ball) -> AdaptiveField {
    edit(field, ball, operation(step), PLENTY, &Run::default()).expect("an edited field")
}

/// A ball of radius 1 and random steps with balls about its surface.
fn random_solid(random: &mut Random, count: usize) -> (Ball, Vec<(Step, Ball)>) {
    let first = Ball::new(0.0, 0.0, 0.0, 1.0);
    let steps = (0..count)
        .map(|_| {
            let center = random.within(&Aabb::new(DVec3::splat(-1.1), DVec3::splat(1.1)));
            let step = [Step::Carve, Step::Carve, Step::Fill, Step::Fill, Step::Intersect][(random.between(0.0, 5.0) as usize).min(4)];
            let radius = if step == Step::Intersect { random.between(1.2, 2.5) } else { random.length(0.05, 0.8) };
            (step, Ball { center, radius })
        })
        .collect();
    (first, steps)
}

/// Bounds at points, over leaves, inner cells and boxes contain the true distance.
fn holds(field: &AdaptiveField, solid: &Solid, count: usize, random: &mut Random) {
    let domain = field.extent_box();
    for n in 0..count {
        let p = random.within(&if n % 8 == 0 { domain.grow(domain.size().x) } else { domain });
        let (truth, found) = (solid.distance(p), field.at(p));
        let found = found.widen(1e-12);
        assert!(found.contains(truth), "{truth} at {p} is not in {found:?}, value {}", solid.value(p));
        if let Some(leaf) = field.find(p) {
            assert!(leaf.over().widen(1e-12).contains(truth), "{truth} at {p} is not in {:?} of its leaf", leaf.over());
            let mut cell = field.root();
            while !cell.is_leaf() {
                assert!(cell.over().widen(1e-12).contains(truth), "{truth} at {p} is not in {:?} of {:?}", cell.over(), cell.extent());
                assert!(cell.bounds(p).widen(1e-12).contains(truth), "{truth} at {p} is not in {:?} of an inner cell", cell.bounds(p));
                cell = (0..8).map(|octant| cell.child(octant)).find(|child| child.extent().contains(p)).expect("a child");
            }
        }
        let part = Aabb::new(p, p + DVec3::splat(random.length(1e-3, 0.5)));
        let q = random.within(&part);
        assert!(field.over(&part).widen(1e-12).contains(solid.distance(q)), "over {part:?} at {q}");
    }
}

#[test]
fn bounds_hold_the_distance_of_the_edited_solid() {
    let mut random = Random::new(5);
    for round in 0..12 {
        let (first, steps) = random_solid(&mut random, 1 + round % 6);
        let reconstruction = if round % 2 == 0 { Reconstruction::Linear } else { Reconstruction::Cubic };
        let rules = Rules { growth: [0.0, 0.05, 0.5][round % 3], reconstruction, ..Rules::within(0.02) };
        let mut edited = field(&first, &rules);
        for (n, (step, ball)) in steps.iter().enumerate() {
            edited = apply(&edited, *step, ball);
            holds(&edited, &Solid::new(first, &steps[..=n]), 2_000, &mut random);
        }
    }
}

#[test]
fn bounds_are_tight_where_the_surface_is() {
    let first = Ball::new(0.0, 0.0, 0.0, 1.0);
    let steps = [(Step::Carve, Ball::new(0.9, 0.0, 0.0, 0.3)), (Step::Fill, Ball::new(0.0, 0.9, 0.0, 0.3))];
    let mut edited = field(&first, &Rules::within(0.01));
    for (step, ball) in &steps {
        edited = apply(&edited, *step, ball);
    }
    let solid = Solid::new(first, &steps);
    let mut random = Random::new(8);
    let (mut near, mut wide) = (0, 0);
    while near < 20_000 {
        let p = random.within(&edited.extent_box());
        if solid.distance(p).abs() < 0.05 {
            near += 1;
            wide += usize::from(edited.at(p).width() > 0.06);
        }
    }
    // Beyond the rims the way to the rim is not known: only to points inside.
    assert!(wide * 8 < near, "{wide} of {near} are wide");
}

#[test]
fn editing_is_building_anew_within_the_tolerance() {
    let mut random = Random::new(6);
    for round in 0..6 {
        let (first, steps) = random_solid(&mut random, 5);
        let rules = Rules { growth: [0.0, 0.1][round % 2], ..Rules::within(0.02) };
        let mut edited = field(&first, &rules);
        for (step, ball) in &steps {
            edited = apply(&edited, *step, ball);
        }
        let solid = Solid::new(first, &steps);
        let mut judged = 0;
        for _ in 0..40_000 {
            let p = random.within(&edited.extent_box());
            let (said, value) = (edited.interpolate(p).expect("inside"), solid.value(p));
            // Far from the surface the reach of a tool ends.
            if value.abs() < 0.02 {
                judged += 1;
                assert!((said - value).abs() <= 2.0 * 0.02 + 0.1 * value.abs(), "{said} is not {value} at {p}");
            }
            assert!(value.abs() < 0.06 || (said < 0.0) == (value < 0.0), "wrong side: {said} for {value} at {p}");
        }
        assert!(judged > 100);
    }
}

/// Leaves and what they hold.
fn leaves(field: &AdaptiveField) -> std::collections::HashMap<[u64; 4], (Aabb, [u32; 8])> {
    let mut out = std::collections::HashMap::new();
    field.walk(&mut |cell| {
        if cell.is_leaf() {
            let [x, y, z] = cell.index().map(u64::from);
            out.insert([u64::from(cell.depth()), x, y, z], (cell.extent(), cell.corners().map(f32::to_bits)));
        }
        true
    });
    out
}

#[test]
fn far_cells_stay_bit_for_bit_and_share_their_memory() {
    let before = field(&Ball::new(0.0, 0.0, 0.0, 1.0), &Rules::within(0.002));
    let tool = Ball::new(0.7, 0.7, 0.2, 0.1);
    for operation in [Operation::Carve, Operation::Fill, Operation::Blend(0.05)] {
        let after = edit(&before, &tool, operation, PLENTY, &Run::default()).expect("an edited field");
        let reach = tool.extent().expect("a box").grow(0.05).grow(0.5 * 0.3 + 1e-9);
        let (old, new) = (leaves(&before), leaves(&after));
        let mut kept = 0;
        for (place, (extent, corners)) in &old {
            if !extent.overlaps(&reach) {
                kept += 1;
                assert_eq!(new.get(place).map(|(_, corners)| corners), Some(corners), "{extent:?}");
            }
        }
        assert!(kept > old.len() / 2 && old.len() > 10_000 && new != old);
        let (shared, pages) = after.shared_pages(&before);
        assert!(shared * 10 > pages * 9 && shared < pages, "only {shared} of {pages} pages are shared");
        // The old field is as it was.
        assert!(leaves(&before) == old);
    }
}

#[test]
fn the_same_lattice_point_has_the_same_value_in_every_leaf_after_edits() {
    let mut random = Random::new(11);
    let (first, steps) = random_solid(&mut random, 12);
    let mut edited = field(&first, &Rules::within(0.02));
    for (step, ball) in &steps {
        edited = apply(&edited, *step, ball);
    }
    let mut known = std::collections::HashMap::new();
    let mut shared = 0;
    edited.walk(&mut |cell| {
        if cell.is_leaf() {
            for corner in 0..8 {
                let place = cell.extent().corner(corner).to_array().map(f64::to_bits);
                let value = cell.corners()[corner];
                if let Some(before) = known.insert(place, value) {
                    assert_eq!(before.to_bits(), value.to_bits(), "{before} or {value} at {}", cell.extent().corner(corner));
                    shared += 1;
                }
            }
        }
        true
    });
    assert!(shared > 1000);
}

#[test]
fn a_hundred_strokes_hold_and_stay_small() {
    let mut random = Random::new(12);
    let (first, steps) = random_solid(&mut random, 100);
    let steps: Vec<(Step, Ball)> = steps
        .into_iter()
        .map(|(step, ball)| (if step == Step::Intersect { Step::Carve } else { step }, Ball { radius: 0.4 * ball.radius, ..ball }))
        .collect();
    let mut edited = field(&first, &Rules::within(0.02));
    for (step, ball) in &steps {
        edited = apply(&edited, *step, ball);
    }
    let solid = Solid::new(first, &steps);
    holds(&edited, &solid, 2_000, &mut random);
    let anew = field(&Edited(solid), &Rules::within(0.02));
    let (many, few) = (edited.statistics().cells, anew.statistics().cells);
    assert!(many < 4 * few, "{many} cells by editing, {few} by building");
}

/// A solid of balls as one source.
struct Edited(Solid);

impl Distance for Edited {
    fn extent(&self) -> Option<Aabb> {
        Some(Aabb::new(DVec3::splat(-1.0), DVec3::ONE))
    }

    fn at(&self, p: DVec3) -> Interval {
        Interval::exact(self.0.distance(p))
    }
}

impl Source for Edited {
    fn values(&self, points: &[DVec3], out: &mut [f64]) -> Result<()> {
        points.iter().zip(out).for_each(|(p, out)| *out = self.0.value(*p));
        Ok(())
    }

    fn slack(&self, _: &Aabb) -> Interval {
        Interval::ALL
    }
}

#[test]
fn strange_tools_do_what_they_must() {
    let first = Ball::new(0.0, 0.0, 0.0, 1.0);
    let before = field(&first, &Rules::within(0.01));
    let mut random = Random::new(13);
    for (step, ball) in [
        (Step::Carve, Ball::new(9.0, 0.0, 0.0, 1.0)),
        (Step::Fill, Ball::new(9.0, 0.0, 0.0, 1.0)),
        (Step::Carve, Ball::new(0.0, 0.0, 0.0, 50.0)),
        (Step::Fill, Ball::new(0.0, 0.0, 0.0, 50.0)),
        (Step::Intersect, Ball::new(0.0, 0.0, 0.0, 50.0)),
        (Step::Intersect, Ball::new(9.0, 0.0, 0.0, 1.0)),
        (Step::Carve, Ball::new(0.5, 0.2, 0.1, 1e-6)),
        (Step::Fill, Ball::new(1.1, 0.2, 0.1, 1e-9)),
        (Step::Carve, Ball::new(2.0, 0.0, 0.0, 1.0)),
        (Step::Fill, Ball::new(0.0, 0.0, 2.0, 1.0)),
        (Step::Carve, Ball::new(0.0, 0.0, 0.0, 0.999)),
    ] {
        let after = apply(&before, step, &ball);
        let solid = Solid::new(first, &[(step, ball)]);
        for _ in 0..3_000 {
            let p = random.within(&after.extent_box().grow(0.3));
            let (truth, found) = (solid.distance(p), after.at(p).widen(1e-12));
            // No solid at all has no distance; it must not be said to be near.
            let good = if truth.is_finite() { found.contains(truth) } else { found.upper > 1e6 || found.lower < -1e6 };
            assert!(good, "{step:?} {ball:?}: {truth} at {p} is not in {found:?}");
        }
    }
}

#[test]
fn a_tool_that_is_the_shape_takes_all_or_nothing() {
    let ball = Ball::new(0.0, 0.0, 0.0, 1.0);
    let before = field(&ball, &Rules::within(0.01));
    let (gone, same) = (apply(&before, Step::Carve, &ball), apply(&before, Step::Fill, &ball));
    let mut random = Random::new(15);
    for _ in 0..20_000 {
        let p = random.within(&gone.extent_box());
        assert!(gone.interpolate(p).expect("inside") > -0.02 && gone.at(p).upper >= 1e6);
        assert!(same.at(p).contains(ball.value(p)));
    }
}

#[test]
fn a_tool_that_does_nothing_changes_nothing() {
    let before = field(&Ball::new(0.0, 0.0, 0.0, 1.0), &Rules::within(0.01));
    let after = apply(&before, Step::Carve, &Ball::new(1.2, 1.2, 1.2, 0.02));
    assert!(after.to_levels() == before.to_levels());
}

#[test]
fn blends_are_smooth_and_hold() {
    let (a, b, radius) = (Ball::new(0.0, 0.0, 0.0, 1.0), Ball::new(0.9, 0.0, 0.0, 0.6), 0.2);
    let blended = |p: DVec3| {
        let (x, y) = (a.value(p), b.value(p));
        let h = (radius - (x - y).abs()).max(0.0);
        x.min(y) - h * h / (4.0 * radius)
    };
    let after = edit(&field(&a, &Rules::within(0.005)), &b, Operation::Blend(radius), PLENTY, &Run::default()).expect("a field");
    let mut random = Random::new(14);
    // The surface by marching along random rays from inside.
    let surface: Vec<DVec3> = (0..40_000)
        .map(|_| {
            let way = random.within(&Aabb::new(DVec3::splat(-1.0), DVec3::ONE)).normalize();
            let mut ends = [0.0, 3.0];
            for _ in 0..60 {
                let middle = 0.5 * (ends[0] + ends[1]);
                ends[usize::from(blended(way * middle) > 0.0)] = middle;
            }
            way * ends[0]
        })
        .collect();
    for _ in 0..500 {
        let p = random.within(&after.extent_box());
        let near = surface.iter().map(|s| (*s - p).length()).fold(f64::INFINITY, f64::min);
        let found = after.at(p);
        // Samples are no farther apart than 0.1: the truth lies that much lower at most.
        let truth =
            if blended(p) < 0.0 { Interval { lower: -near, upper: 0.1 - near } } else { Interval { lower: near - 0.1, upper: near } };
        assert!(found.lower <= truth.upper && truth.lower <= found.upper, "{found:?} and {truth:?} at {p}");
        let said = after.interpolate(p).expect("inside");
        assert!(blended(p).abs() > 0.3 || (said - blended(p)).abs() < 0.01 + 0.05 * said.abs(), "{said} is not {} at {p}", blended(p));
    }
}

#[test]
fn edits_are_the_same_bits_for_any_number_of_threads() {
    let before = field(&Ball::new(0.0, 0.0, 0.0, 1.0), &Rules::within(0.005));
    let tool = Ball::new(0.8, 0.3, 0.1, 0.3);
    let made = |threads| edit(&before, &tool, Operation::Carve, PLENTY, &Run::with_threads(threads)).expect("a field").to_levels();
    let one = made(1);
    assert!((2..6).all(|threads| made(threads) == one));
}

#[test]
fn what_cannot_be_edited_is_refused() {
    let before = field(&Ball::new(0.0, 0.0, 0.0, 1.0), &Rules::within(0.01));
    let tool = Ball::new(0.8, 0.3, 0.1, 0.3);
    let run = Run::default();
    assert!(matches!(edit(&before, &tool, Operation::Carve, 1000, &run), Err(Error::Memory { .. })));
    for radius in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(edit(&before, &tool, Operation::Blend(radius), PLENTY, &run).expect_err("refused").to_string().contains("radius"));
    }
    struct Broken;
    impl Distance for Broken {
        fn extent(&self) -> Option<Aabb> {
            None
        }
        fn at(&self, _: DVec3) -> Interval {
            Interval::ALL
        }
    }
    impl Source for Broken {
        fn values(&self, _: &[DVec3], out: &mut [f64]) -> Result<()> {
            out.fill(f64::NAN);
            Ok(())
        }
    }
    assert!(edit(&before, &Broken, Operation::Carve, PLENTY, &run).expect_err("refused").to_string().contains("NaN"));
}
