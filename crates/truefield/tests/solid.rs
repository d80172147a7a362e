//! Fields as shapes: tools of edits, and sources of other fields.

mod balls;
mod residual;

use std::sync::Arc;

use balls::{Ball, Solid as Balls, Step};
use residual::{aligned, residuals};
use truefield::build::adaptive::{Reconstruction, Rule, Rules, adaptive, root};
use truefield::field::adaptive::{AdaptiveField, Division, Solid};
use truefield::laws::Random;
use truefield::op::edit::{Operation, edit};
use truefield::source::csg::{Complement, Cuboid, Placed, Placement, Sphere, difference};
use truefield::source::polygon::{Fill, Polygon};
use truefield::{Aabb, DVec3, Distance, Run, Source};

fn build(source: &dyn Source, rules: &Rules) -> AdaptiveField {
    adaptive(source, root(source, None, Division::Octree).expect("a box"), rules, &Run::default()).expect("a field")
}

fn solid(source: &dyn Source, rules: &Rules) -> Solid {
    Solid::new(Arc::new(build(source, rules))).expect("a solid")
}

fn rules() -> [Rules; 4] {
    let rules = |rule, reconstruction, growth| Rules { rule, reconstruction, growth, max_depth: 5, ..Rules::within(0.03) };
    [
        rules(Rule::Verified, Reconstruction::Linear, 0.0),
        rules(Rule::Verified, Reconstruction::Cubic, 0.1),
        rules(Rule::Samples, Reconstruction::Linear, 0.1),
        rules(Rule::Samples, Reconstruction::Linear, f64::INFINITY),
    ]
}

fn shapes() -> Vec<Arc<dyn Source>> {
    let ball: Arc<dyn Source> = Arc::new(Sphere::new(DVec3::new(0.1, 0.2, -0.1), 0.8).expect("a ball"));
    let cuboid: Arc<dyn Source> = Arc::new(Cuboid::new(DVec3::new(0.5, 0.0, 0.0), DVec3::new(1.0, 1.5, 0.7)).expect("a box"));
    vec![Arc::new(difference(&cuboid, &[Arc::clone(&ball)]).expect("a difference")), ball, cuboid]
}

#[test]
fn values_slack_and_residuals_hold() {
    let mut random = Random::new(3);
    for shape in shapes() {
        for rules in rules() {
            let solid = solid(&*shape, &rules);
            let domain = solid.extent().expect("an end").grow(1.0);
            let size = domain.diagonal();
            for _ in 0..400 {
                let (p, q) = (random.within(&domain), random.within(&domain));
                let mut values = [0.0; 2];
                solid.values(&[p, q], &mut values).expect("values");
                let (truth, slack) = (shape.at(p), solid.slack(&Aabb::around([p, q])));
                let open = truth.lower - values[0] > slack.upper + 1e-9 || truth.upper - values[0] < slack.lower - 1e-9;
                assert!(!open, "{truth:?} at {p} is not within {slack:?} of {}", values[0]);
                let way = p.distance(q) + 2.0 * solid.noise() + 1e-9;
                assert!((values[0] - values[1]).abs() <= way, "{values:?} at {p} and {q}");
            }
            for n in 0..150 {
                let mut p = random.within(&domain);
                if n % 2 == 0 {
                    // At borders of leaves, where what is said bends and jumps.
                    p = solid.field().find(p).map_or(p, |leaf| leaf.extent().corner(n / 2 % 8));
                }
                residuals("a field", &solid, p, size * [1.0, 0.05][n % 2], 1e-12 * size, &mut random);
            }
            // Blocks that end where leaves do.
            for _ in 0..150 {
                let Some(leaf) = solid.field().find(random.within(&solid.field().extent_box())) else { continue };
                let cell = leaf.extent();
                let half = Aabb::new(cell.min, cell.center());
                aligned(&solid, &[cell, half, Aabb::new(cell.center(), cell.max)][random.below(3)], 1e-12 * size, &mut random);
            }
            let turned = Placed::new(Arc::new(solid), Placement::rotate(DVec3::new(1.0, 2.0, 3.0), 40.0).expect("a turn")).expect("placed");
            for _ in 0..50 {
                residuals("a turned field", &turned, random.within(&domain), size, 1e-12 * size, &mut random);
            }
        }
    }
}

/// Balls cut by balls that are fields themselves: bounds hold the true distance, and values are those of both.
#[test]
fn fields_are_tools() {
    let mut random = Random::new(11);
    let first = Ball::new(0.0, 0.0, 0.0, 1.0);
    for rules in rules() {
        let rules = Rules { max_depth: 6, ..rules };
        let before = build(&first, &rules);
        for (step, operation) in [(Step::Carve, Operation::Carve), (Step::Fill, Operation::Fill), (Step::Intersect, Operation::Intersect)] {
            let ball = Ball { center: random.direction() * 0.9, radius: 0.5 };
            let tool = solid(&ball, &rules);
            let after = edit(&before, &tool, operation, 1 << 32, &Run::default()).expect("an edited field");
            let truth = Balls::new(first, &[(step, ball)]);
            let domain = after.extent_box();
            for _ in 0..3000 {
                let p = random.within(&domain);
                let (found, exact) = (after.at(p).widen(1e-12), truth.distance(p));
                assert!(found.contains(exact), "{rules:?}, {operation:?}: {exact} at {p} is not in {found:?}");
                let allowed =
                    4.0 * rules.tolerance + 3.0 * if rules.growth.is_finite() { rules.growth * exact.abs() } else { f64::INFINITY };
                let said = after.interpolate(p).expect("inside");
                // Beyond the domain of its field a tool's value is less than its distance.
                let known = tool.field().extent_box().contains(p);
                if rules.rule == Rule::Verified && known && after.find(p).is_some_and(|leaf| leaf.depth() < rules.max_depth) {
                    let off = (said - truth.value(p)).abs();
                    assert!(off <= allowed, "{rules:?}, {operation:?}: {said} at {p} is {off} off");
                }
            }
        }
    }
}

/// A field of a field: bounds hold what the first was made of.
#[test]
fn fields_are_sampled_anew() {
    let mut random = Random::new(5);
    for shape in shapes() {
        let once = solid(&*shape, &Rules { max_depth: 6, ..Rules::within(0.02) });
        let moved =
            Placed::new(Arc::new(once.clone()), Placement::translate(DVec3::new(0.013, 0.02, -0.04)).expect("a way")).expect("placed");
        let again = build(&moved, &Rules { max_depth: 6, ..Rules::within(0.03) });
        let domain = again.extent_box();
        for _ in 0..5000 {
            let p = random.within(&domain);
            let (truth, found) = (shape.at(p - DVec3::new(0.013, 0.02, -0.04)), again.at(p));
            assert!(found.lower <= truth.upper + 1e-9 && truth.lower <= found.upper + 1e-9, "{truth:?} at {p} is not in {found:?}");
        }
    }
}

#[test]
fn fields_without_a_whole_solid_are_refused() {
    let ball: Arc<dyn Source> = Arc::new(Sphere::new(DVec3::ZERO, 1.0).expect("a ball"));
    let half = Aabb::new(DVec3::ZERO, DVec3::splat(2.0));
    let rules = Rules::within(0.05);
    let part = |source: &dyn Source, domain: Aabb| {
        let root = root(source, Some(domain), Division::Octree).expect("a box");
        Solid::new(Arc::new(adaptive(source, root, &rules, &Run::default()).expect("a field")))
            .map(|_| ())
            .expect_err("refused")
            .to_string()
    };
    assert!(part(&*ball, half).contains("beyond"), "{}", part(&*ball, half));
    let away = Aabb::new(DVec3::splat(2.0), DVec3::splat(3.0));
    assert!(part(&*ball, away).contains("no solid") || part(&*ball, away).contains("beyond"));
    let square = Polygon::new(&[vec![[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]]], Fill::EvenOdd).expect("a polygon");
    let place = root(&square, None, Division::Quadtree).expect("a box");
    let columns = adaptive(&square, place, &rules, &Run::default()).expect("a field");
    let refused = Solid::new(Arc::new(columns)).map(|_| ()).expect_err("refused").to_string();
    assert!(refused.contains("columns"), "{refused}");
    assert!(part(&Complement::new(ball), Aabb::new(DVec3::splat(-2.0), DVec3::splat(2.0))).contains("beyond"));
}
