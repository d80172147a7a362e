//! Adaptive fields: bounds that hold, trees that are the same for any number of threads.

use std::sync::Arc;

use truefield::build::adaptive::{Reconstruction, Rule, Rules, adaptive, root};
use truefield::field::adaptive::{AdaptiveField, Division};
use truefield::laws::Random;
use truefield::source::csg::{Cuboid, Sphere, Union, difference, intersection};
use truefield::{Aabb, DVec3, Distance, Interval, Result, Run, Source};

/// A ball, of which the bend is known, or nothing.
struct Ball {
    center: DVec3,
    radius: f64,
    bends: bool,
}

impl Distance for Ball {
    fn extent(&self) -> Option<Aabb> {
        Some(Aabb::new(self.center - self.radius, self.center + self.radius))
    }

    fn at(&self, p: DVec3) -> Interval {
        Interval::exact((p - self.center).length() - self.radius)
    }
}

impl Source for Ball {
    fn values(&self, points: &[DVec3], out: &mut [f64]) -> Result<()> {
        for (p, out) in points.iter().zip(out) {
            *out = (*p - self.center).length() - self.radius;
        }
        Ok(())
    }

    fn bend(&self, cell: &Aabb) -> Interval {
        let least = cell.distance_squared(self.center).sqrt();
        if self.bends { Interval { lower: 0.0, upper: 1.0 / least } } else { Interval::ALL }
    }
}

/// Two balls as one: a ridge between them.
struct Pair(Ball, Ball);

impl Distance for Pair {
    fn extent(&self) -> Option<Aabb> {
        Some(self.0.extent()?.union(self.1.extent()?))
    }

    fn at(&self, p: DVec3) -> Interval {
        let [a, b] = [&self.0, &self.1].map(|ball| ball.at(p).lower);
        Interval::exact(a.min(b))
    }
}

impl Source for Pair {
    fn values(&self, points: &[DVec3], out: &mut [f64]) -> Result<()> {
        for (p, out) in points.iter().zip(out) {
            *out = self.at(*p).lower;
        }
        Ok(())
    }

    fn bend(&self, cell: &Aabb) -> Interval {
        Interval { lower: f64::NEG_INFINITY, upper: self.0.bend(cell).upper.max(self.1.bend(cell).upper) }
    }
}

fn ball(bends: bool) -> Ball {
    Ball { center: DVec3::new(0.1, -0.2, 0.3), radius: 1.0, bends }
}

fn pair() -> Pair {
    Pair(ball(true), Ball { center: DVec3::new(2.5, 0.0, 0.1), radius: 0.7, bends: true })
}

fn build(source: &dyn Source, rules: &Rules, threads: usize) -> AdaptiveField {
    let run = Run::with_threads(threads);
    adaptive(source, root(source, None, Division::Octree).expect("a box"), rules, &run).expect("a field")
}

fn all_rules() -> Vec<Rules> {
    let mut out = Vec::new();
    for rule in [Rule::Verified, Rule::Samples] {
        for reconstruction in [Reconstruction::Linear, Reconstruction::Cubic] {
            for growth in [0.0, 0.1, f64::INFINITY] {
                out.push(Rules { rule, reconstruction, growth, max_depth: 7, ..Rules::within(0.02) });
            }
        }
    }
    out
}

/// The bounds of leaves, of inner cells, of boxes and outside the domain contain the truth.
fn holds(field: &AdaptiveField, source: &dyn Source, rules: &Rules) {
    let mut random = Random::new(7);
    let domain = field.extent_box();
    for n in 0..20_000 {
        let p = random.within(&if n % 8 == 0 { domain.grow(domain.size().x) } else { domain });
        let (truth, found) = (source.at(p).lower, field.at(p));
        assert!(found.contains(truth), "{rules:?}: {truth} at {p} is not in {found:?}");
        if let Some(leaf) = field.find(p) {
            assert!(leaf.extent().contains(p) && leaf.over().contains(truth));
            let said = field.interpolate(p).expect("inside");
            if rules.rule == Rule::Verified && leaf.depth() < rules.max_depth {
                assert!((said - truth).abs() <= rules.allowed_at(truth), "{rules:?}: {said} is not {truth}");
            }
            let mut cell = field.root();
            while !cell.is_leaf() {
                let local = cell.local(p);
                assert!(cell.error().plus(Interval::exact(cell.record().value(local))).widen(1e-14).contains(truth));
                let octant = (0..8).find(|&octant| cell.child(octant).extent().contains(p)).expect("a child holds it");
                assert!(cell.child(octant).largest_error() <= cell.largest_error(), "errors grow from coarse to fine");
                cell = cell.child(octant);
            }
        }
        let part = Aabb::new(p, p + DVec3::splat(random.length(1e-3, 1.0)));
        let range = field.over(&part);
        for _ in 0..2 {
            let q = random.within(&part);
            assert!(range.contains(source.at(q).lower), "{rules:?}: {range:?} over {part:?}");
        }
    }
}

trait Allowed {
    fn allowed_at(&self, truth: f64) -> f64;
}

impl Allowed for Rules {
    fn allowed_at(&self, truth: f64) -> f64 {
        // A cell is judged by its nearest point, which is no farther than this one.
        if self.growth.is_infinite() { f64::INFINITY } else { self.tolerance + self.growth * truth.abs() + 1e-12 }
    }
}

#[test]
fn bounds_contain_the_truth_for_every_rule_and_reconstruction() {
    let (smooth, unknown, ridge) = (ball(true), ball(false), pair());
    let sources: [&dyn Source; 3] = [&smooth, &unknown, &ridge];
    for source in sources {
        for rules in all_rules() {
            holds(&build(source, &rules, 2), source, &rules);
        }
    }
}

#[test]
fn a_quadtree_is_a_tree_of_columns() {
    struct Disc;
    impl Distance for Disc {
        fn extent(&self) -> Option<Aabb> {
            Some(Aabb::new(DVec3::new(-1.0, -1.0, 0.0), DVec3::new(1.0, 1.0, 5.0)))
        }
        fn at(&self, p: DVec3) -> Interval {
            Interval::exact(p.truncate().length() - 1.0)
        }
    }
    impl Source for Disc {
        fn values(&self, points: &[DVec3], out: &mut [f64]) -> Result<()> {
            points.iter().zip(out).for_each(|(p, out)| *out = self.at(*p).lower);
            Ok(())
        }
    }
    for reconstruction in [Reconstruction::Linear, Reconstruction::Cubic] {
        let rules = Rules { reconstruction, max_depth: 8, ..Rules::within(0.01) };
        let place = root(&Disc, None, Division::Quadtree).expect("a box");
        let field = adaptive(&Disc, place, &rules, &Run::default()).expect("a field");
        assert!(field.statistics().depth > 4 && field.statistics().cells % 4 == 1);
        let mut random = Random::new(3);
        for _ in 0..100_000 {
            let p = random.within(&field.extent_box());
            assert!(field.at(p).contains(Disc.at(p).lower));
            let leaf = field.find(p).expect("inside");
            assert!(leaf.extent().contains(p) && leaf.extent().size().z == field.extent_box().size().z);
        }
    }
}

#[test]
fn a_tree_is_the_same_for_any_number_of_threads_and_from_its_levels() {
    let rules = Rules { growth: 0.2, ..Rules::within(0.005) };
    let one = build(&pair(), &rules, 1).to_levels();
    assert!(one.levels.len() > 6, "deep enough to have pages: {}", one.levels.len());
    for threads in [2, 3, 7] {
        assert!(build(&pair(), &rules, threads).to_levels() == one);
    }
    let again = AdaptiveField::from_levels(&one, None, &Run::default()).expect("a field").to_levels();
    assert!(again == one);
}

#[test]
fn the_same_lattice_point_has_the_same_value_in_every_leaf() {
    let field = build(&pair(), &Rules::within(0.005), 2);
    let mut known = std::collections::HashMap::new();
    let mut shared = 0;
    field.walk(&mut |cell| {
        if cell.is_leaf() {
            for corner in 0..8 {
                let place = cell.extent().corner(corner).to_array().map(f64::to_bits);
                let value = cell.corners()[corner].to_bits();
                if let Some(before) = known.insert(place, value) {
                    assert_eq!(before, value);
                    shared += 1;
                }
            }
        }
        true
    });
    assert!(shared > 1000);
}

#[test]
fn what_cannot_be_built_is_refused() {
    let message = |rules: Rules| {
        let place = root(&ball(false), None, Division::Octree).expect("a box");
        adaptive(&ball(false), place, &rules, &Run::default()).expect_err("refused").to_string()
    };
    assert!(message(Rules::within(0.0)).contains("positive"));
    assert!(message(Rules::within(f64::NAN)).contains("positive"));
    assert!(message(Rules { growth: -1.0, ..Rules::within(0.1) }).contains("growth"));
    assert!(message(Rules { max_depth: 99, ..Rules::within(0.1) }).contains("max_depth"));
    let tight = message(Rules { memory: 1 << 24, ..Rules::within(1e-4) });
    assert!(tight.contains("MiB") && tight.contains("larger tolerance"), "{tight}");
    struct Endless;
    impl Distance for Endless {
        fn extent(&self) -> Option<Aabb> {
            None
        }
        fn at(&self, _: DVec3) -> Interval {
            Interval::ALL
        }
    }
    impl Source for Endless {
        fn values(&self, _: &[DVec3], out: &mut [f64]) -> Result<()> {
            out.fill(f64::NAN);
            Ok(())
        }
    }
    assert!(root(&Endless, None, Division::Octree).expect_err("no end").to_string().contains("domain"));
    let place = root(&Endless, Some(Aabb::new(DVec3::ZERO, DVec3::ONE)), Division::Octree).expect("a box");
    assert!(adaptive(&Endless, place, &Rules::within(0.1), &Run::default()).expect_err("no numbers").to_string().contains("NaN"));
}

/// Seams are proven by what lies on both sides of them: proofs cost little more cells than samples do.
#[test]
fn seams_take_few_cells() {
    let balls: Vec<Arc<dyn Source>> = [DVec3::new(-0.5, 0.0, 0.0), DVec3::new(0.5, 0.2, 0.1)]
        .map(|center| Arc::new(Sphere::new(center, 1.0).expect("a ball")) as Arc<dyn Source>)
        .to_vec();
    let cuboid: Arc<dyn Source> = Arc::new(Cuboid::new(DVec3::ZERO, DVec3::new(2.0, 2.0, 0.5)).expect("a box"));
    let carved = difference(&cuboid, &balls[..1]).expect("a difference");
    let (union, lens) = (Union::new(balls.clone()).expect("a union"), intersection(&balls).expect("a lens"));
    let shapes: [(&dyn Source, f64); 4] = [(&union, 1.5), (&lens, 2.0), (&*cuboid, 4.0), (&carved, 3.0)];
    for (shape, most) in shapes {
        let leaves = |rule: Rule| build(shape, &Rules { rule, ..Rules::within(0.01) }, 2).statistics().leaves as f64;
        let ratio = leaves(Rule::Verified) / leaves(Rule::Samples);
        assert!(ratio <= most, "{ratio} times the cells");
    }
}
