//! The laws hold for a ball that is right, and each is broken by a stand-in that is wrong in its way.

use truefield::laws::{
    Broken, BruteForce, Elements, Law, Random, check_closest, check_distance, check_extent, check_lipschitz, check_many, check_normal,
    check_range, check_threads, check_truth, places,
};
use truefield::{Aabb, Closest, DVec3, Distance, Error, Feature, Interval, Nearest, TriangleMesh};

/// What is wrong with a ball.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Wrong {
    Nothing,
    /// Too long by a thousandth.
    Distance,
    /// The other side of the ball's left half.
    Sign,
    /// Not a number at one place.
    NotANumber,
    /// Steeper than 1.
    Steep,
    /// Another last bit in `at_many`.
    Many,
    /// `over` forgets half of the radius.
    Range,
    /// `over` is right at the centre and the corners only.
    RangeAtCorners,
    /// An extent that cuts the ball.
    Extent,
    /// Answers up to twice the limit.
    WithinTooFar,
    /// No answer at the limit itself.
    WithinStrict,
    /// The limit is taken for a squared one.
    WithinSquared,
    /// The nearest point is the foot on another sphere.
    Point,
    /// Another distance than `at`.
    Other,
    /// A normal that is not a unit.
    Length,
    /// A normal that points inward.
    Inward,
    /// A normal a tenth of a radian off.
    Askew,
    /// The wrong element.
    Element,
    /// The wrong feature.
    Feature,
    /// The right distance and the highest index of a tie.
    Tie,
}

/// A unit ball at the origin; its only element is the sphere, and it has two of it.
struct Ball(Wrong);

impl Distance for Ball {
    fn extent(&self) -> Option<Aabb> {
        Some(Aabb::new(DVec3::NEG_ONE, if self.0 == Wrong::Extent { DVec3::new(1.0, 0.9, 1.0) } else { DVec3::ONE }))
    }

    fn at(&self, p: DVec3) -> Interval {
        let d = p.length() - 1.0;
        match self.0 {
            Wrong::Distance => Interval::exact(d * 1.001),
            Wrong::Sign if p.x < 0.0 => Interval::exact(-d),
            Wrong::NotANumber if p.x > 0.9 => Interval::exact(f64::NAN),
            Wrong::Steep => Interval::exact(1.5 * d),
            _ => Interval::exact(d),
        }
    }

    fn over(&self, cell: &Aabb) -> Interval {
        let middle = self.at(cell.center());
        match self.0 {
            Wrong::Range => middle.widen(0.5 * cell.radius()),
            Wrong::RangeAtCorners => (0..8).map(|i| self.at(cell.corner(i))).fold(middle, Interval::hull),
            _ => middle.widen(cell.radius() + 1e-15),
        }
    }

    fn at_many(&self, points: &[DVec3], out: &mut [Interval]) {
        for (i, (p, out)) in points.iter().zip(out).enumerate() {
            *out = self.at(*p);
            if self.0 == Wrong::Many && i % 13 == 12 {
                out.upper = out.upper.next_up();
            }
        }
    }
}

impl Closest for Ball {
    fn nearest(&self, p: DVec3, within: f64) -> Option<Nearest> {
        let away = p.try_normalize().unwrap_or(DVec3::X);
        let d = p.length() - 1.0;
        let found = match self.0 {
            Wrong::WithinTooFar => d.abs() <= 2.0 * within,
            Wrong::WithinStrict => d.abs() < within,
            Wrong::WithinSquared => d * d <= within,
            _ => d.abs() <= within,
        };
        let turned = |by: f64| away * by.cos() + away.any_orthonormal_vector() * by.sin();
        found.then(|| Nearest {
            point: away * if self.0 == Wrong::Point { 1.01 } else { 1.0 },
            distance: if self.0 == Wrong::Other { d.next_up() } else { d },
            element: match self.0 {
                Wrong::Tie => 1,
                Wrong::Element => 2,
                _ => 0,
            },
            feature: if self.0 == Wrong::Feature { Feature::Vertex(0) } else { Feature::Face },
            normal: match self.0 {
                Wrong::Length => away * 1.01,
                Wrong::Inward => -away,
                Wrong::Askew => turned(0.11),
                _ => away,
            },
        })
    }
}

/// Twice the unit sphere, and a larger one.
struct Spheres;

impl Elements for Spheres {
    fn count(&self) -> u32 {
        3
    }

    fn distance_squared(&self, element: u32, p: DVec3) -> f64 {
        (p.length() - if element < 2 { 1.0 } else { 7.0 }).powi(2)
    }

    fn feature_distance(&self, element: u32, feature: Feature, p: DVec3) -> f64 {
        if feature == Feature::Face { self.distance_squared(element, p).sqrt() } else { (p - DVec3::X).length() }
    }
}

fn points() -> Vec<DVec3> {
    let mut random = Random::new(11);
    (0..500).map(|_| random.within(&Aabb::new(DVec3::splat(-2.0), DVec3::splat(2.0)))).collect()
}

fn judge(p: DVec3) -> f64 {
    p.length() - 1.0
}

fn all(wrong: Wrong) -> Result<(), Broken> {
    let (ball, points) = (Ball(wrong), points());
    check_distance(&ball, judge, &points, 1e-14)?;
    check_closest(&ball, &Spheres, &points, 1e-14)?;
    let judged = check_normal(&ball, &points, 1e-4)?;
    assert!(judged > points.len() / 2, "only {judged} points were judged");
    Ok(())
}

#[test]
fn a_right_ball_passes() {
    assert_eq!(all(Wrong::Nothing), Ok(()));
}

#[test]
fn every_wrong_ball_is_caught_by_its_law() {
    for (wrong, law) in [
        (Wrong::Distance, Law::Truth),
        (Wrong::Sign, Law::Truth),
        (Wrong::NotANumber, Law::Truth),
        (Wrong::Steep, Law::Truth),
        (Wrong::Many, Law::Many),
        (Wrong::Range, Law::Range),
        (Wrong::RangeAtCorners, Law::Range),
        (Wrong::Extent, Law::Extent),
        (Wrong::WithinTooFar, Law::Within),
        (Wrong::WithinStrict, Law::Within),
        (Wrong::WithinSquared, Law::Within),
        (Wrong::Point, Law::Stated),
        (Wrong::Other, Law::Stated),
        (Wrong::Length, Law::Normal),
        (Wrong::Inward, Law::Normal),
        (Wrong::Askew, Law::Normal),
        (Wrong::Element, Law::Element),
        (Wrong::Feature, Law::Element),
        (Wrong::Tie, Law::Nearest),
    ] {
        let broken = all(wrong).expect_err("a wrong ball");
        assert_eq!(broken.law, law, "{wrong:?}: {broken}");
    }
}

#[test]
fn laws_catch_alone_what_other_laws_catch_first() {
    let points = points();
    assert!(check_lipschitz(&Ball(Wrong::Steep), &points, 1e-14).is_err(), "a steep distance");
    assert!(check_lipschitz(&Ball(Wrong::Sign), &points, 1e-14).is_err(), "a sign that jumps");
    assert!(check_lipschitz(&Ball(Wrong::NotANumber), &points, 1e-14).is_err(), "not a number");
    assert!(check_truth(&Ball(Wrong::Nothing), |p| judge(p) - 1.0, &points, 1e-14).is_err(), "another truth");
    assert!(check_many(&Ball(Wrong::Nothing), &points).is_ok() && check_many(&Ball(Wrong::Many), &points).is_err());
    assert!(check_range(&Ball(Wrong::Sign), judge, &points, 1e-14).is_err(), "a range around the wrong sign");
    assert!(check_extent(&Ball(Wrong::Nothing), |p| judge(p) + 0.2, &points, 1e-14).is_ok(), "a smaller ball");
    assert!(check_extent(&Ball(Wrong::Nothing), |p| judge(p) - 0.2, &points, 1e-14).is_err(), "a larger ball");
}

#[test]
fn a_closed_form_and_brute_force_agree() {
    let corners = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    let mesh = TriangleMesh::new(corners, vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]).expect("a tetrahedron");
    let brute = BruteForce::new(&mesh);
    assert_eq!(brute.nearest(DVec3::new(0.25, 0.25, -1.0)), (1.0, 0));
    assert_eq!(brute.nearest(DVec3::ZERO), (0.0, 0));
    assert!((brute.signed(DVec3::splat(0.1)) + 0.1).abs() < 1e-15);
    assert!((brute.winding(DVec3::splat(0.1)) - 1.0).abs() < 1e-12 && brute.winding(DVec3::ONE).abs() < 1e-12);
    assert_eq!(brute.feature_distance(0, Feature::Edge(0), DVec3::new(-3.0, 5.0, 0.0)), 5.0);
    assert_eq!(brute.feature_distance(0, Feature::Vertex(2), DVec3::new(1.0, 2.0, 0.0)), 2.0);
}

#[test]
fn places_are_where_they_are_said_to_be() {
    let mesh = TriangleMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z], vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
        .expect("a tetrahedron");
    let (brute, points) = (BruteForce::new(&mesh), places(&mesh, 1100, 1));
    let share = |low: f64, high: f64| points.iter().filter(|&&p| (low..=high).contains(&brute.unsigned(p))).count() * 11 / points.len();
    assert!(share(0.0, 0.0) >= 2, "on the surface to the bit");
    assert!(share(0.0, 1e-15) >= 4, "on the surface");
    assert!(share(1e-15, 0.1) >= 1, "near the surface");
    assert!(share(1.0, 2e3) >= 1, "far away");
    assert_eq!(points, places(&mesh, 1100, 1));
    assert_ne!(points, places(&mesh, 1100, 2));
}

#[test]
fn threads_that_matter_are_caught() {
    assert_eq!(check_threads("sums", |run| run.blocks("", 10, |i| Ok(i * i))), Ok(()));
    let broken = check_threads("thread counts", |run| Ok(run.threads)).expect_err("thread counts differ");
    assert_eq!(broken.law, Law::Threads);
    assert!(check_threads("a failure", |run| if run.threads == 7 { Err(Error::Cancelled) } else { Ok(0) }).is_err());
}
