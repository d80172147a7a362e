//! Both guarantees of a contour, against brute force: no sample off it, no part of it without a sample.

mod nasty;

use std::collections::HashMap;
use std::sync::Arc;

use nasty::{Kind, Nasty, corpus, judge, judged, shapes};
use truefield::laws::{BruteForce, Random, check_threads};
use truefield::product::contour::{Contour, Placement, contour};
use truefield::{Closest, DVec3, Error, Run, SignChoice, Surface, TriangleMesh};

const PLENTY: u64 = 1 << 32;

/// Samples judged for every contour; all of them where there are fewer.
const JUDGED: usize = 500;

struct Case<'a> {
    nasty: &'a Nasty,
    brute: BruteForce,
    surface: Surface,
    unsigned: bool,
}

impl<'a> Case<'a> {
    /// Solids with their sides, other meshes without.
    fn new(nasty: &'a Nasty) -> Self {
        let unsigned = nasty.kind == Kind::Open;
        let sign = if unsigned { SignChoice::Unsigned } else { SignChoice::Auto };
        let surface = Surface::new(Arc::new(nasty.mesh.clone()), sign, &Run::with_threads(2)).expect("a surface");
        Self { nasty, brute: BruteForce::new(&nasty.mesh), surface, unsigned }
    }

    fn truth(&self, p: DVec3) -> f64 {
        let distance = self.brute.unsigned(p);
        if !self.unsigned && judge::winding(&self.nasty.mesh, p).is_some_and(|w| w > 0) { -distance } else { distance }
    }

    /// Points of the contour itself, found without it: out from places of the surface, and by bisection.
    fn contour_points(&self, distance: f64, count: usize) -> Vec<DVec3> {
        let mesh = &self.nasty.mesh;
        let size = mesh.extent().diagonal();
        let mut random = Random::new(21);
        let mut out = Vec::new();
        for round in 0..count {
            let [a, b, c] = mesh.corners(random.below(mesh.triangles().len()) as u32);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            let (u, v) = (random.unit(), random.unit());
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let p = match round % 4 {
                0 => a + (b - a) * u + (c - a) * v + normal * if self.unsigned && round % 8 == 0 { -distance } else { distance },
                1 => a + (b - a) * u + random.direction() * distance,
                2 => a + random.direction() * distance,
                _ => match self.bisect(distance, [random.within(&mesh.extent().grow(distance.max(0.0) + 0.2 * size)), a * 0.5 + b * 0.5]) {
                    Some(p) => p,
                    None => continue,
                },
            };
            if (self.truth(p) - distance).abs() <= 1e-12 * size + self.ulps() {
                out.push(p);
            }
        }
        out
    }

    /// Rounding of coordinates, which far from the origin is more than that of distances.
    fn ulps(&self) -> f64 {
        let extent = self.nasty.mesh.extent();
        4.0 * f64::EPSILON * extent.min.abs().max(extent.max.abs()).length()
    }

    fn bisect(&self, distance: f64, [mut p, mut q]: [DVec3; 2]) -> Option<DVec3> {
        let above = |p: DVec3| self.truth(p) > distance;
        let first = above(p);
        if first == above(q) {
            return None;
        }
        for _ in 0..50 {
            let middle = p * 0.5 + q * 0.5;
            if above(middle) == first { p = middle } else { q = middle }
        }
        Some(p)
    }

    fn check(&self, distance: f64, tolerance: f64, placement: Placement) -> usize {
        let (name, mesh) = (self.nasty.name, &self.nasty.mesh);
        let what = format!("{name}, distance {distance:e}, tolerance {tolerance:e}, {placement:?}");
        let found = contour(&self.surface, distance, tolerance, placement, PLENTY, &Run::with_threads(2))
            .unwrap_or_else(|error| panic!("{what}: {error}"));
        let Contour { points, normals, triangles } = &found;
        assert_eq!((points.len(), points.len()), (normals.len(), triangles.len()), "{what}");
        let rounding = 1e-12 * (mesh.extent().diagonal() + distance.abs()) + 1e-9 * tolerance + self.ulps();
        let step = (points.len() / JUDGED).max(1);
        let chosen: Vec<usize> = (0..points.len()).step_by(step).collect();
        let truth = judged(&chosen.iter().map(|&i| points[i]).collect::<Vec<_>>(), |p| (self.truth(p), self.brute.nearest(p)));
        let mut exact = 0;
        for (&i, &(value, (squared, triangle))) in chosen.iter().zip(&truth) {
            assert!((value - distance).abs() <= 0.5 * tolerance + rounding, "{what}: sample {i} at {:?} is at {value:e}", points[i]);
            let own = mesh.facet(triangles[i]).distance_squared(points[i]).sqrt();
            assert!(
                own - squared.sqrt() <= rounding,
                "{what}: triangle {} of sample {i} is {own:e} away, triangle {triangle} {:e}",
                triangles[i],
                squared.sqrt()
            );
            assert!((normals[i].length() - 1.0).abs() <= 1e-9, "{what}: normal {:?}", normals[i]);
            exact += usize::from((value - distance).abs() <= 1e-9 * tolerance + rounding);
            if placement == Placement::Lattice {
                let nearest = self.surface.nearest(points[i], f64::INFINITY).expect("a nearest point");
                assert_eq!((triangles[i], normals[i]), (nearest.element, nearest.normal), "{what}: sample {i} at {:?}", points[i]);
            }
        }
        if placement == Placement::Projected && chosen.len() > 100 && distance > tolerance {
            assert!(exact * 2 > chosen.len(), "{what}: only {exact} of {} samples lie on the contour", chosen.len());
        }
        let cover = Cover::new(points, tolerance);
        let on_it = self.contour_points(distance, 500);
        let reach = if placement == Placement::Lattice { 0.5 * tolerance } else { tolerance } + rounding;
        for p in &on_it {
            let nearest = cover.nearest(*p);
            assert!(nearest <= reach, "{what}: no sample within {reach:e} of {p:?}, the nearest of {} is {nearest:e} away", points.len());
        }
        on_it.len()
    }
}

/// Samples in boxes as wide as the tolerance.
struct Cover<'a> {
    points: &'a [DVec3],
    edge: f64,
    boxes: HashMap<[i64; 3], Vec<u32>>,
}

impl<'a> Cover<'a> {
    fn new(points: &'a [DVec3], edge: f64) -> Self {
        let mut boxes: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
        for (i, p) in points.iter().enumerate() {
            boxes.entry(Self::key(*p, edge)).or_default().push(i as u32);
        }
        Self { points, edge, boxes }
    }

    fn key(p: DVec3, edge: f64) -> [i64; 3] {
        (p / edge).floor().to_array().map(|x| x as i64)
    }

    /// The distance to the nearest sample, infinite if it is farther than two boxes.
    fn nearest(&self, p: DVec3) -> f64 {
        let [i, j, k] = Self::key(p, self.edge);
        let mut best = f64::INFINITY;
        for (x, y, z) in (0..125).map(|n| (i + n / 25 - 2, j + n / 5 % 5 - 2, k + n % 5 - 2)) {
            for &sample in self.boxes.get(&[x, y, z]).into_iter().flatten() {
                best = best.min((self.points[sample as usize] - p).length());
            }
        }
        best
    }
}

#[test]
fn both_guarantees_hold_on_every_mesh() {
    for nasty in corpus() {
        let case = Case::new(&nasty);
        let size = nasty.mesh.extent().diagonal();
        let deepest = if case.unsigned { 0.2 } else { -0.08 };
        let mut judged = 0;
        for (round, (distance, tolerance)) in
            [(0.13, 0.031), (deepest, 0.019), (0.004, 0.02), (deepest / 7.0, 0.016)].into_iter().enumerate()
        {
            let placement = if round % 2 == 0 { Placement::Lattice } else { Placement::Projected };
            judged += case.check(distance * size, tolerance * size, placement);
        }
        assert!(judged > 150, "{}: only {judged} contour points were found to judge by", nasty.name);
    }
}

#[test]
fn the_surface_itself_is_a_contour() {
    for nasty in corpus().into_iter().step_by(3) {
        let case = Case::new(&nasty);
        let tolerance = 0.05 * nasty.mesh.extent().diagonal();
        for placement in [Placement::Lattice, Placement::Projected] {
            case.check(0.0, tolerance, placement);
        }
    }
}

#[test]
fn flat_contours_do_not_slip_between_the_planes_of_the_lattice() {
    let nasty = Nasty { name: "cube", mesh: shapes::welded(&shapes::cube()), kind: Kind::Solid };
    let case = Case::new(&nasty);
    let (mut random, mut judged) = (Random::new(22), 0);
    for round in 0..20 {
        let tolerance = random.between(0.02, 0.12);
        let distance = random.between(-0.45, 0.3);
        let placement = if round % 2 == 0 { Placement::Lattice } else { Placement::Projected };
        judged += case.check(distance, tolerance, placement);
    }
    assert!(judged > 1_000, "only {judged} contour points were found to judge by");
}

#[test]
fn large_meshes_have_whole_contours() {
    for (name, mesh) in [("a scan", shapes::welded(&shapes::scan(60, 40, 6))), ("a rod", shapes::welded(&shapes::rod(500, 1.0, 3.0)))] {
        let nasty = Nasty { name, mesh, kind: Kind::Solid };
        let case = Case::new(&nasty);
        for (distance, tolerance) in [(-0.3, 0.03), (0.1, 0.05)] {
            case.check(distance, tolerance, Placement::Projected);
        }
    }
}

#[test]
fn contours_do_not_depend_on_threads() {
    for nasty in corpus().into_iter().step_by(4) {
        let case = Case::new(&nasty);
        let size = nasty.mesh.extent().diagonal();
        let bits = |v: &[DVec3]| v.iter().map(|p| p.to_array().map(f64::to_bits)).collect::<Vec<_>>();
        for placement in [Placement::Lattice, Placement::Projected] {
            check_threads(nasty.name, |run| {
                let found = contour(&case.surface, 0.05 * size, 0.02 * size, placement, PLENTY, run)?;
                Ok((bits(&found.points), bits(&found.normals), found.triangles))
            })
            .unwrap_or_else(|broken| panic!("{broken}"));
        }
    }
}

#[test]
fn what_has_no_contour_is_said() {
    let mesh: TriangleMesh = shapes::welded(&shapes::cube());
    let surface = Surface::new(Arc::new(mesh), SignChoice::Auto, &Run::with_threads(2)).expect("a surface");
    let ask = |distance: f64, tolerance: f64, memory: u64| {
        contour(&surface, distance, tolerance, Placement::Lattice, memory, &Run::with_threads(2))
    };
    for tolerance in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-300, 1e-15] {
        assert!(matches!(ask(-0.1, tolerance, PLENTY), Err(Error::Invalid(_))), "tolerance {tolerance:e}");
    }
    for distance in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert!(matches!(ask(distance, 0.1, PLENTY), Err(Error::Invalid(_))), "distance {distance}");
    }
    assert!(matches!(ask(-0.1, 0.01, 1000), Err(Error::Memory { .. })));
    assert_eq!(ask(-0.6, 0.1, PLENTY).expect("an empty contour"), Contour::default());
    assert!(!ask(-0.5, 0.1, PLENTY).expect("the middle").points.is_empty());
}
