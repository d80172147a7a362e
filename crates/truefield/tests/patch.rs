//! Bezier patches: the closest point against known shapes and dense samples, and the side against the triangles' own.

mod residual;

use std::sync::Arc;

use residual::residuals;
use truefield::laws::{Random, check_lipschitz, check_threads};
use truefield::source::csg::{Sphere, Union};
use truefield::source::patch::{Bezier, Patches, Sides};
use truefield::{Aabb, DVec3, Distance, Run, Source};

fn patches(set: &[Bezier], sides: Sides) -> Patches {
    Patches::new(set, sides, &Run::with_threads(2)).expect("patches")
}

fn value(shape: &dyn Source, p: DVec3) -> f64 {
    let mut out = [0.0];
    shape.values(&[p], &mut out).expect("a value");
    out[0]
}

/// A flat patch between two corners of a parallelogram, its control points evenly spread.
fn flat(corner: DVec3, u: DVec3, v: DVec3) -> Bezier {
    Bezier(std::array::from_fn(|i| std::array::from_fn(|j| corner + u * (i as f64 / 3.0) + v * (j as f64 / 3.0))))
}

/// The six faces of a box, outward.
fn cube(half: f64) -> Vec<Bezier> {
    let edge = 2.0 * half;
    let low = DVec3::splat(-half);
    let [x, y, z] = DVec3::AXES.map(|axis| axis * edge);
    vec![flat(low, y, x), flat(low + z, x, y), flat(low, x, z), flat(low + y, z, x), flat(low, z, y), flat(low + x, y, z)]
}

/// A surface of revolution around z of cubic profiles (r, z), four patches for each, oriented away from the axis where the
/// profile rises.
fn revolved(profiles: &[[(f64, f64); 4]]) -> Vec<Bezier> {
    let k = 4.0 / 3.0 * (2.0_f64.sqrt() - 1.0);
    let circle = [(1.0, 0.0), (1.0, k), (k, 1.0), (0.0, 1.0)];
    let mut set = Vec::new();
    for quarter in 0..4 {
        let turn = |(x, y): (f64, f64)| match quarter {
            0 => (x, y),
            1 => (-y, x),
            2 => (-x, -y),
            _ => (y, -x),
        };
        for profile in profiles {
            set.push(Bezier(std::array::from_fn(|i| {
                let (x, y) = turn(circle[i]);
                profile.map(|(r, z)| DVec3::new(r * x, r * y, z))
            })));
        }
    }
    set
}

/// Nearly a ball of radius 1.
fn ball() -> Vec<Bezier> {
    let k = 4.0 / 3.0 * (2.0_f64.sqrt() - 1.0);
    revolved(&[[(0.0, -1.0), (k, -1.0), (1.0, -k), (1.0, 0.0)], [(1.0, 0.0), (1.0, k), (k, 1.0), (0.0, 1.0)]])
}

fn wavy(random: &mut Random) -> Bezier {
    Bezier(std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            DVec3::new(i as f64 / 3.0, j as f64 / 3.0, 0.0)
                + DVec3::new(random.between(-0.2, 0.2), random.between(-0.2, 0.2), random.between(-0.5, 0.5))
        })
    }))
}

#[test]
fn a_cube_of_patches_has_the_distance_of_a_cube() {
    let shape = patches(&cube(0.7), Sides::Closed);
    let mut random = Random::new(1);
    for _ in 0..2000 {
        let p = DVec3::new(random.between(-1.5, 1.5), random.between(-1.5, 1.5), random.between(-1.5, 1.5));
        let q = p.abs() - 0.7;
        let truth = q.max(DVec3::ZERO).length() + q.max_element().min(0.0);
        let at = shape.at(p);
        assert!(at.widen(1e-15).contains(truth) && at.width() < 1e-10, "{at:?} at {p} is not {truth}");
        assert!((value(&shape, p) - truth).abs() < 1e-10);
    }
    // The middle, and places very near to faces, edges and corners.
    for p in [
        DVec3::ZERO,
        DVec3::new(0.7 + 1e-7, 0.2, 0.1),
        DVec3::new(0.7 - 1e-7, 0.2, 0.1),
        DVec3::splat(0.7 + 1e-8),
        DVec3::splat(0.7 - 1e-8),
    ] {
        let q = p.abs() - 0.7;
        let truth = q.max(DVec3::ZERO).length() + q.max_element().min(0.0);
        assert!((value(&shape, p) - truth).abs() < 1e-10 && shape.at(p).width() < 1e-9, "{p}: {:?}, not {truth}", shape.at(p));
    }
}

#[test]
fn a_ball_of_patches_is_nearly_round() {
    // Four cubics are off a circle by less than 2.8e-4 of its radius, outward; so is the revolved surface.
    let shape = patches(&ball(), Sides::Closed);
    let mut random = Random::new(2);
    for _ in 0..3000 {
        let p = random.direction() * random.length(0.1, 3.0);
        let (at, truth) = (shape.at(p), p.length() - 1.0);
        assert!(at.lower <= truth + 1e-9 && at.upper >= truth - 6e-4, "{at:?} at {p}, {truth}");
        assert!(at.width() < 1e-9, "{at:?} at {p} is wide");
    }
    // The middle is as far from all of it, which no search takes apart; the interval holds.
    let middle = shape.at(DVec3::ZERO);
    assert!(middle.contains(-1.0) && middle.width() < 1e-2, "{middle:?}");
    // Poles, where an edge of each patch is one point.
    for z in [1.5, 1.0 + 1e-6, 1.0 - 1e-6, 0.5, -0.999, -1.1] {
        let at = shape.at(DVec3::new(0.0, 0.0, z));
        assert!(at.widen(1e-9).contains(f64::abs(z) - 1.0), "{at:?} at z = {z}");
    }
    let places: Vec<DVec3> = (0..500).map(|_| random.direction() * random.length(1e-2, 2.0)).collect();
    check_lipschitz(&shape, &places, 1e-12).unwrap_or_else(|broken| panic!("{broken}"));
}

#[test]
fn random_patches_are_as_far_as_their_nearest_sample() {
    let mut random = Random::new(3);
    for _ in 0..12 {
        let set: Vec<Bezier> = (0..3).map(|_| wavy(&mut random)).collect();
        let shape = patches(&set, Sides::Unsigned);
        let steps = 200;
        let samples: Vec<DVec3> = set
            .iter()
            .flat_map(|patch| {
                (0..=steps).flat_map(move |i| {
                    (0..=steps).map(move |j| patch.point(f64::from(i) / f64::from(steps), f64::from(j) / f64::from(steps)))
                })
            })
            .collect();
        let extent = shape.extent().expect("an extent");
        assert!(samples.iter().all(|p| extent.contains(*p)));
        for _ in 0..40 {
            let p = random.within(&Aabb::new(DVec3::splat(-1.0), DVec3::splat(2.0)));
            let nearest = samples.iter().map(|q| (*q - p).length_squared()).fold(f64::INFINITY, f64::min).sqrt();
            let at = shape.at(p);
            assert!(at.width() < 1e-9, "{at:?} is wide");
            assert!(at.lower <= nearest + 1e-12, "{at:?}, but a sample is {nearest} away");
            assert!(at.upper >= nearest - 0.02, "{at:?}, but the nearest sample is {nearest} away");
            let foot = shape.foot(p);
            assert!(((foot - p).length() - at.upper).abs() < 1e-10);
        }
        // Points of the patches are on them.
        for sample in samples.iter().step_by(997) {
            assert!(value(&shape, *sample) < 1e-10, "{sample}");
        }
    }
}

#[test]
fn slack_and_bend_hold() {
    let shape = patches(&ball(), Sides::Closed);
    let mut random = Random::new(4);
    let mut simple = 0;
    for _ in 0..300 {
        let middle = random.direction() * random.length(0.2, 2.0);
        let half = random.length(1e-2, 0.1);
        let cell = Aabb::new(middle - half, middle + half);
        let (bend, slack) = (shape.bend(&cell), shape.slack(&cell));
        for _ in 0..4 {
            let p = random.within(&cell);
            let (at, value) = (shape.at(p), value(&shape, p));
            assert!(slack.contains(at.lower - value) && slack.contains(at.upper - value), "{at:?} and {value} at {p}, {slack:?}");
        }
        simple += usize::from(slack.width() < 1e-8);
        let direction = random.direction();
        let step = 0.3 * half;
        let [a, b, c] = [middle - direction * step, middle, middle + direction * step].map(|p| value(&shape, p));
        let second = (a - 2.0 * b + c) / (step * step);
        assert!(bend.widen(4.0 * shape.noise() / (step * step)).contains(second), "{second} at {middle}, {bend:?}");
    }
    assert!(simple > 100, "only {simple} of 300 cells are simple");
}

#[test]
fn what_is_said_between_samples_holds() {
    let mut random = Random::new(8);
    for set in [ball(), cube(0.7)] {
        let shape = patches(&set, Sides::Closed);
        for n in 0..200 {
            let p = random.direction() * random.length(0.2, 2.0);
            residuals("patches", &shape, p, [0.05, 0.4][n % 2], 2.0 * shape.noise(), &mut random);
        }
    }
}

#[test]
fn what_does_not_close_up_is_refused() {
    let run = Run::with_threads(1);
    let refused = |set: &[Bezier], sides: Sides| Patches::new(set, sides, &run).expect_err("a refusal").to_string();
    assert!(refused(&[], Sides::Unsigned).contains("no patches"));
    let mut broken = cube(1.0);
    broken[2].0[1][1].x = f64::NAN;
    assert!(refused(&broken, Sides::Unsigned).contains("patch 2"));
    assert!(refused(&cube(1.0)[..5], Sides::Closed).contains("unsigned"), "open");
    // Unsigned, an open set answers plain distances.
    let open = patches(&cube(1.0)[..5], Sides::Unsigned);
    assert!(!open.is_closed() && (value(&open, DVec3::ZERO) - 1.0).abs() < 1e-10);
}

#[test]
fn answers_do_not_depend_on_threads() {
    let mut random = Random::new(6);
    let places: Vec<DVec3> = (0..50).map(|_| random.direction() * 1.2).collect();
    check_threads("patches", |run| {
        let shape = Patches::new(&ball(), Sides::Closed, run)?;
        Ok(places.iter().map(|&p| (shape.at(p).lower.to_bits(), shape.at(p).upper.to_bits())).collect::<Vec<_>>())
    })
    .unwrap_or_else(|broken| panic!("{broken}"));
}

/// Points of a patch on a lattice, and for a point the least distance to them after walking downhill from the nearest.
struct Judge {
    set: Vec<Bezier>,
    samples: Vec<(usize, f64, f64, DVec3)>,
}

impl Judge {
    fn new(set: &[Bezier]) -> Self {
        let steps = 48;
        let lattice = move |k: usize| (0..=steps).flat_map(move |i| (0..=steps).map(move |j| (k, f64::from(i), f64::from(j))));
        let all = (0..set.len()).flat_map(lattice).map(|(k, i, j)| (k, i / f64::from(steps), j / f64::from(steps)));
        Self { set: set.to_vec(), samples: all.map(|(k, u, v)| (k, u, v, set[k].point(u, v))).collect() }
    }

    fn distance(&self, p: DVec3) -> f64 {
        let mut order: Vec<usize> = (0..self.samples.len()).collect();
        let far = |n: &usize| (self.samples[*n].3 - p).length_squared();
        order.select_nth_unstable_by(3, |a, b| far(a).total_cmp(&far(b)));
        order[..4].iter().map(|&n| self.downhill(self.samples[n], p)).fold(f64::INFINITY, f64::min)
    }

    /// By ever smaller steps along u and v, of which nothing can go wrong.
    fn downhill(&self, (k, mut u, mut v, at): (usize, f64, f64, DVec3), p: DVec3) -> f64 {
        let (mut best, mut step) = ((at - p).length(), 0.03);
        while step > 1e-11 {
            let mut moved = false;
            for (du, dv) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0), (1.0, 1.0), (-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0)] {
                let (s, t) = ((u + step * du).clamp(0.0, 1.0), (v + step * dv).clamp(0.0, 1.0));
                let far = (self.set[k].point(s, t) - p).length();
                if far < best {
                    (best, u, v, moved) = (far, s, t, true);
                }
            }
            if !moved {
                step *= 0.5;
            }
        }
        best
    }
}

/// Patches on which something degenerates, each around the unit box.
fn nasty(random: &mut Random) -> Vec<(&'static str, Vec<Bezier>)> {
    let mut collapsed = wavy(random);
    collapsed.0[3] = [collapsed.0[3][0]; 4];
    let mut wedge = wavy(random);
    let tip = wedge.0[0][0];
    wedge.0[0] = [tip; 4];
    wedge.0.iter_mut().for_each(|row| row[3] = tip);
    let mut folded = wavy(random);
    folded.0.swap(1, 2);
    folded.0[0].swap(0, 3);
    let mut sharp = wavy(random);
    sharp.0[1] = sharp.0[0];
    let plane = flat(DVec3::new(0.0, 0.1, 0.2), DVec3::new(1.0, 0.2, 0.0), DVec3::new(0.1, 1.0, 0.3));
    let line = flat(DVec3::splat(0.2), DVec3::new(0.6, 0.3, 0.1), DVec3::new(0.6, 0.3, 0.1));
    let twice = wavy(random);
    vec![
        ("an edge that is a point", vec![collapsed]),
        ("two edges that are a point", vec![wedge]),
        ("folded over itself", vec![folded]),
        ("an edge without slope", vec![sharp]),
        ("flat", vec![plane]),
        ("a line", vec![line]),
        ("a point", vec![Bezier([[DVec3::new(0.3, 0.4, 0.5); 4]; 4])]),
        ("twice the same", vec![twice, twice]),
        ("a ball, with poles", ball()),
        ("many", (0..20).map(|_| wavy(random)).collect()),
    ]
}

#[test]
fn nothing_degenerate_is_nearer_than_said() {
    let mut random = Random::new(11);
    for (name, set) in nasty(&mut random) {
        for (scale, offset) in [(1.0, DVec3::ZERO), (1e-6, DVec3::ZERO), (1e6, DVec3::ZERO), (1.0, DVec3::new(3e4, -2e4, 1e4))] {
            let place = |p: DVec3| p * scale + offset;
            let set: Vec<Bezier> = set.iter().map(|patch| Bezier(patch.0.map(|row| row.map(place)))).collect();
            let (shape, judge) = (patches(&set, Sides::Unsigned), Judge::new(&set));
            let size = scale + offset.length();
            let (mut wide, count) = (0, 40);
            for n in 0..count {
                let on = set[random.below(set.len())].point(random.unit(), random.unit());
                let p = match n % 5 {
                    0 => place(random.within(&Aabb::new(DVec3::splat(-1.5), DVec3::splat(2.5)))),
                    1 => on + random.direction() * (scale * random.length(1e-9, 0.1)),
                    2 => on,
                    3 => on + random.direction() * (scale * random.length(3.0, 1e3)),
                    // On an axis of symmetry.
                    _ => place(DVec3::new(0.0, 0.0, random.between(-2.0, 2.0))),
                };
                let (at, truth) = (shape.at(p), judge.distance(p));
                let rounding = 1e-14 * (size + p.abs().max_element());
                assert!(at.lower <= truth + rounding, "{name} times {scale}: {at:?} at {p}, but a point is {truth} away");
                assert!(at.lower <= value(&shape, p) && value(&shape, p) <= at.upper, "{name}: {at:?} at {p}");
                let foot = (shape.foot(p) - p).length();
                assert!(foot <= at.upper + rounding && foot >= at.lower - rounding, "{name}: {foot}, not {at:?} at {p}");
                // Only where much of the surface is as near does the search not end.
                wide += usize::from(at.width() > 1e-10 * (4.0 * size + p.abs().max_element()));
            }
            assert!(wide <= count / 5, "{name} times {scale}: {wide} of {count} are wide");
        }
    }
}

#[test]
fn sides_hold_next_to_the_surface_and_slopes_lead_away_from_it() {
    let mut random = Random::new(12);
    let mut certain = 0;
    for set in [ball(), cube(0.7)] {
        let shape = patches(&set, Sides::Closed);
        for _ in 0..600 {
            let patch = set[random.below(set.len())];
            let (u, v) = (random.between(0.02, 0.98), random.between(0.02, 0.98));
            let at = |u: f64, v: f64| patch.point(u, v);
            let normal = (at(u + 1e-6, v) - at(u - 1e-6, v)).cross(at(u, v + 1e-6) - at(u, v - 1e-6)).normalize();
            let height = random.length(1e-8, 0.01) * [1.0, -1.0][random.below(2)];
            let p = at(u, v) + normal * height;
            let bounds = shape.at(p);
            assert!(bounds.widen(1e-11).contains(height), "{bounds:?} at {p}, {height} above");
            if bounds.lower * bounds.upper > 0.0 {
                certain += 1;
                let mut slope = [DVec3::ZERO];
                shape.gradients(&[p], &mut slope).expect("a slope");
                assert!((slope[0] - normal).length() < 1e-3, "{} at {p}, not {normal}", slope[0]);
            }
        }
    }
    assert!(certain > 1100, "{certain}");
}

/// Unions ask some parts about many points at once.
#[test]
fn a_point_s_value_does_not_depend_on_its_neighbours() {
    let parts: Vec<Arc<dyn Source>> = vec![
        Arc::new(patches(&ball(), Sides::Closed)),
        Arc::new(Sphere::new(DVec3::new(1.2, 0.3, 0.1), 0.7).expect("a ball")),
        Arc::new(Sphere::new(DVec3::new(-4.0, 0.3, 0.1), 0.7).expect("a ball")),
    ];
    let shape = Union::new(parts).expect("a union");
    let mut random = Random::new(13);
    let places: Vec<DVec3> = (0..200).map(|_| random.direction() * random.length(0.1, 3.0)).collect();
    let mut together = vec![0.0; places.len()];
    shape.values(&places, &mut together).expect("values");
    for (&p, together) in places.iter().zip(together) {
        assert_eq!(value(&shape, p).to_bits(), together.to_bits(), "{p}");
    }
}

#[test]
fn sizes_whose_powers_are_no_numbers_are_refused() {
    for (scale, fits) in [(1e-200, false), (1e-53, false), (1e-38, true), (1e38, true), (1e60, false), (1e200, false)] {
        let set: Vec<Bezier> = ball().iter().map(|patch| Bezier(patch.0.map(|row| row.map(|p| p * scale)))).collect();
        for sides in [Sides::Closed, Sides::Unsigned] {
            match Patches::new(&set, sides, &Run::with_threads(1)) {
                Ok(shape) => {
                    let at = shape.at(DVec3::new(0.4, 0.5, 2.6) * scale);
                    let near = (at.lower / scale, at.upper / scale);
                    assert!(fits && near.0 > 1.5 && near.1 < 1.8, "{scale}: {near:?}");
                }
                Err(refusal) => assert!(!fits && refusal.to_string().contains("unit"), "{scale}: {refusal}"),
            }
        }
    }
}

/// The patch through 4 x 4 points of a surface.
fn through(at: impl Fn(f64, f64) -> DVec3) -> Bezier {
    let cubic =
        |[a, b, c, d]: [DVec3; 4]| [a, (a * -5.0 + b * 18.0 - c * 9.0 + d * 2.0) / 6.0, (a * 2.0 - b * 9.0 + c * 18.0 - d * 5.0) / 6.0, d];
    let rows: [[DVec3; 4]; 4] = std::array::from_fn(|i| cubic(std::array::from_fn(|j| at(i as f64 / 3.0, j as f64 / 3.0))));
    let columns: [[DVec3; 4]; 4] = std::array::from_fn(|j| cubic(std::array::from_fn(|i| rows[i][j])));
    Bezier(std::array::from_fn(|i| std::array::from_fn(|j| columns[j][i])))
}

/// From the axis of a paraboloid a ring is as near, and from the middle of a cap of a ball all of it.
#[test]
fn values_are_as_near_as_they_say_where_much_is_as_near() {
    let bowl = patches(&[through(|u, v| DVec3::new(u - 0.5, v - 0.5, 0.5 * ((u - 0.5).powi(2) + (v - 0.5).powi(2))))], Sides::Unsigned);
    for z in [0.2, 0.99, 1.0, 1.0 + 1e-6, 1.001, 1.01, 1.05, 1.1] {
        let p = DVec3::new(0.0, 0.0, z);
        let truth = if z > 1.0 { (2.0 * z - 1.0_f64).sqrt() } else { z };
        let (at, value, slack) = (bowl.at(p), value(&bowl, p), bowl.slack(&Aabb::new(p, p).grow(1e-3)));
        assert!(at.contains(truth) && at.width() < 1e-9, "{truth} at {p} is not in {at:?}");
        assert!(slack.contains(truth - value) && slack.width() < 1e-9, "{value} at {p} is not {truth} within {slack:?}");
    }
    let turned = |u: f64, v: f64, part: f64| DVec3::new(u.sin(), v.sin() * u.cos(), v.cos() * u.cos()) * part;
    for size in [0.3, 0.03] {
        let cap = patches(&[through(|u, v| turned((u - 0.5) * size, (v - 0.5) * size, 1.0))], Sides::Unsigned);
        for way in [0.0, 1e-9, 1e-6, 1e-3] {
            let p = turned(0.1 * size, 0.2 * size, way);
            let (at, mut value) = (cap.at(p), [0.0]);
            // A patch is no ball: it may be as near as its own error, and a value is near or none.
            assert!(at.contains(1.0 - way) || (at.lower - 1.0 + way).abs() < size.powi(4), "{at:?} at {p}");
            match cap.values(&[p], &mut value) {
                Ok(()) => assert!(value[0] >= at.lower && value[0] <= at.upper, "{value:?} at {p} is not in {at:?}"),
                Err(refusal) => assert!(refusal.to_string().contains("only known") && at.width() > cap.noise(), "{refusal}"),
            }
        }
    }
}
