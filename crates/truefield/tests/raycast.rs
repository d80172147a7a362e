//! Rays against adaptive fields: nothing is missed, nothing leaks, and hits are where the shape is.

mod shaped;

use shaped::{ball, cubic, cuboid, near, random_tree, torus, torus_value, tree};
use truefield::build::adaptive::Rules;
use truefield::field::adaptive::{AdaptiveField, Division};
use truefield::laws::{Random, check_threads};
use truefield::product::raycast::{Caster, Hit, Method};
use truefield::{Aabb, DVec3, Error, Run};

const METHODS: [Method; 2] = [Method::Linear, Method::Cubic];

fn caster(field: &AdaptiveField, distance: f64) -> Caster {
    Caster::new(field, distance, &Run::with_threads(2)).expect("a caster")
}

fn cast(caster: &Caster, rays: &[(DVec3, DVec3)], method: Method) -> Vec<Hit> {
    let (origins, directions): (Vec<_>, Vec<_>) = rays.iter().copied().unzip();
    let hits = caster.cast(&origins, &directions, method, &Run::with_threads(2)).expect("hits");
    (0..rays.len()).map(|ray| hits.get(ray)).collect()
}

/// Rays of all kinds through a box: from outside and inside, along axes, through lattice points of the tree and along its faces.
fn rays(random: &mut Random, extent: &Aabb, count: usize) -> Vec<(DVec3, DVec3)> {
    let lattice = |random: &mut Random| {
        let n = 1 << random.below(6);
        let at = |random: &mut Random| random.below(n + 1) as f64 / n as f64;
        extent.min + extent.size() * DVec3::new(at(random), at(random), at(random))
    };
    let mut out = Vec::new();
    for _ in 0..count {
        let origin = match random.below(4) {
            0 => lattice(random),
            1 => random.within(&extent.grow(2.0 * extent.diagonal())),
            2 => extent.center() + random.direction() * (extent.diagonal() * random.length(1.0, 1e6)),
            _ => random.within(extent),
        };
        let target = if random.below(3) == 0 { lattice(random) } else { random.within(extent) };
        let mut direction = match random.below(3) {
            0 => DVec3::from_array([0, 1, 2].map(|_| random.below(3) as f64 - 1.0)),
            _ => target - origin,
        };
        if random.below(4) == 0 {
            direction[random.below(3)] = 0.0;
        }
        if direction != DVec3::ZERO {
            out.push((origin, direction * random.length(1e-3, 1e3)));
        }
    }
    out
}

#[test]
fn no_ray_leaks_through_cracks_of_random_trees() {
    let mut random = Random::new(5);
    let (mut judged, mut hit) = (0, 0);
    for round in 0..60u64 {
        let division = if round % 4 == 3 { Division::Quadtree } else { Division::Octree };
        let depth = 1 + random.below(5) as u32;
        let bias = random.between(0.0, 0.9);
        let value = |at: [u32; 3]| {
            let key = u64::from(at[0]) | u64::from(at[1]) << 16 | u64::from(at[2]) << 32 | round << 48;
            (Random::new(key).between(-1.0, 1.0) + bias) as f32
        };
        let extent = Aabb::new(DVec3::new(0.25, -1.0, 2.0), DVec3::new(1.25, 0.0, 3.0));
        let field = random_tree(&mut random, extent, division, depth, value);
        let distance = if round % 2 == 0 { 0.0 } else { 0.05 };
        let caster = caster(&field, distance);
        let rays = rays(&mut random, &extent, 2000);
        for method in METHODS {
            let hits = cast(&caster, &rays, method);
            for (i, &(origin, direction)) in rays.iter().enumerate() {
                let direction = (direction / direction.abs().max_element()).normalize();
                let far = (origin - extent.center()).length();
                // The side at a point of the ray; none so near to a crossing that rounding decides.
                let side = |t: f64| match field.interpolate(origin + direction * t) {
                    Some(value) if (value - distance).abs() < 1e-7 * (1.0 + far) => None,
                    Some(value) => Some(value < distance),
                    None => Some(false),
                };
                // On a face between cells of different size it may be on either side.
                let Some(first) = side(0.0).filter(|_| thick(&field, origin, 1e-9)) else { continue };
                let t = hits[i].distance;
                let from = (far - extent.diagonal()).max(0.0);
                let end = t.min(from + 2.0 * extent.diagonal() + far.min(extent.diagonal()));
                // Linear crossings skip what begins and ends within one cell.
                let samples = if method == Method::Cubic { 40 } else { 0 };
                for _ in 0..samples {
                    let at = random.between(from.min(end), end);
                    // Cells are chosen by the bits of rounded places: along a face, either side may be meant.
                    if (at - t).abs() > 1e-6 * (1.0 + far)
                        && thick(&field, origin + direction * at, 1e-9 * (1.0 + far))
                        && let Some(found) = side(at)
                    {
                        assert_eq!(found, first, "tree {round}, ray {i} from {origin} along {direction}: {at} before {t}");
                        judged += 1;
                    }
                }
                if t.is_finite() {
                    hit += 1;
                    assert!((origin + direction * t - hits[i].point).length() < 1e-9 * (1.0 + far));
                    assert!((hits[i].normal.length() - 1.0).abs() < 1e-9);
                } else {
                    // Beyond the domain all is outside.
                    assert!(
                        !first,
                        "tree {round}, ray {i}: {method:?} leaves the solid without a hit, from {origin:?} along {direction:?}"
                    );
                }
            }
        }
    }
    assert!(judged > 100_000 && hit > 50_000, "{judged} {hit}");
}

/// Whether a point is no nearer than `away` to a face of the cell it is in.
fn thick(field: &AdaptiveField, p: DVec3, away: f64) -> bool {
    field.find(p).is_none_or(|cell| {
        let extent = cell.extent();
        (p - extent.min).min(extent.max - p).min_element() > away
    })
}

#[test]
fn rays_meet_balls_boxes_and_rings_where_they_are() {
    let mut random = Random::new(7);
    let center = DVec3::new(0.1, 0.2, -0.3);
    let (low, high) = (DVec3::new(-0.5, -0.61, -0.72), DVec3::new(0.513, 0.4, 0.31));
    let truth_ball = move |o: DVec3, d: DVec3| {
        let (b, c) = (d.dot(o - center), (o - center).length_squared() - 0.64);
        let root = b * b - c;
        (root >= 0.0).then(|| [-b - root.sqrt(), -b + root.sqrt()].into_iter().find(|&t| t > 0.0)).flatten()
    };
    let truth_box = move |o: DVec3, d: DVec3| {
        let (a, b) = ((low - o) / d, (high - o) / d);
        let (enter, leave) = (a.min(b).max_element(), a.max(b).min_element());
        (enter <= leave).then(|| [enter, leave].into_iter().find(|&t| t > 0.0)).flatten()
    };
    // By steps as long as the distance is.
    let truth_ring = |o: DVec3, d: DVec3| {
        let value = |t: f64| torus_value(o + d * t, 0.7, 0.2);
        let (mut t, inside) = (0.0, value(0.0) < 0.0);
        for _ in 0..4000 {
            let v = value(t);
            if (v < 0.0) != inside {
                return Some(t);
            }
            t += v.abs().max(1e-7);
            if t > 20.0 {
                break;
            }
        }
        None
    };
    type Truth<'a> = &'a (dyn Fn(DVec3, DVec3) -> Option<f64> + Sync);
    let shapes: [(&str, shaped::Shape, Truth<'_>); 3] =
        [("ball", ball(center, 0.8), &truth_ball), ("box", cuboid(low, high), &truth_box), ("ring", torus(0.7, 0.2), &truth_ring)];
    let tolerance = 0.01;
    for (name, shape, truth) in &shapes {
        for rules in [near(tolerance, 9), Rules::within(tolerance), cubic(&Rules::within(tolerance))] {
            let field = tree(shape, &rules);
            let caster = caster(&field, 0.0);
            let rays: Vec<(DVec3, DVec3)> = (0..6_000)
                .map(|_| (random.direction() * random.between(0.0, 3.0), random.direction()))
                .filter(|(o, _)| (shape.value)(*o).abs() > 2.0 * tolerance)
                .collect();
            for method in METHODS {
                let hits = cast(&caster, &rays, method);
                let mut wrong = 0;
                for (i, &(o, d)) in rays.iter().enumerate() {
                    match (hits[i].distance.is_finite(), truth(o, d)) {
                        (true, Some(t)) => {
                            // A hit lies near the surface however the ray grazes it; where it does not graze, near the true hit.
                            let off = (shape.value)(hits[i].point).abs();
                            assert!(off < 2.0 * tolerance, "{name} {method:?}: {off} off");
                            let gap = (hits[i].distance - t).abs();
                            wrong += usize::from(gap > 0.2);
                            let (p, e) = (o + d * t, 1e-5);
                            let across = ((shape.value)(p + d * e) - (shape.value)(p - d * e)) / (2.0 * e);
                            if across.abs() > 0.3 {
                                assert!(gap * across.abs() < 3.0 * tolerance, "{name} {method:?}: {gap} from the true hit");
                            }
                        }
                        (false, None) => {}
                        _ => wrong += 1,
                    }
                }
                assert!(wrong < rays.len() / 200, "{name} {method:?}: {wrong} grazing rays differ");
            }
        }
    }
}

#[test]
fn what_is_between_two_points_is_seen_from_both() {
    let field = tree(&torus(0.7, 0.2), &near(0.01, 6));
    let caster = caster(&field, 0.0);
    let mut random = Random::new(11);
    let run = Run::with_threads(2);
    let mut hidden = 0;
    for _ in 0..3000 {
        let (a, b) = (random.direction() * random.between(0.0, 2.0), random.direction() * random.between(0.0, 2.0));
        let length = (b - a).length();
        let hit = cast(&caster, &[(a, (b - a) * 3.0)], Method::Cubic)[0];
        let found = caster.occluded(&[a], &[(b - a) * 3.0], length, Method::Cubic, &run).expect("an answer")[0];
        assert_eq!(found, hit.distance <= length);
        if (hit.distance - length).abs() > 1e-6 {
            let back = caster.occluded(&[b], &[a - b], length, Method::Cubic, &run).expect("an answer")[0];
            assert_eq!(found, back, "from {a} to {b}");
        }
        hidden += usize::from(found);
    }
    assert!(hidden > 500);
}

#[test]
fn the_solid_ends_where_the_domain_does() {
    // All of the domain is inside.
    let shape = ball(DVec3::ZERO, 10.0);
    let domain = Aabb::new(DVec3::splat(-1.0), DVec3::splat(1.0));
    let caster = caster(&shaped::tree_in(&shape, Some(domain), &near(0.1, 3)), 0.0);
    for method in METHODS {
        let hits = cast(
            &caster,
            &[(DVec3::new(-3.0, 0.2, 0.3), DVec3::X), (DVec3::new(0.1, 0.2, 0.3), DVec3::X), (DVec3::Z * 4.0, DVec3::Z)],
            method,
        );
        assert_eq!((hits[0].distance, hits[0].normal), (2.0, DVec3::NEG_X));
        assert!((hits[1].distance - 0.9).abs() < 1e-12 && hits[1].normal == DVec3::X);
        assert!(hits[2].distance.is_infinite() && hits[2].point.is_nan() && hits[2].normal.is_nan());
    }
}

#[test]
fn shapes_of_all_sizes_are_met_alike() {
    let mut random = Random::new(13);
    for scale in [1e-9, 1e-3, 1e6, 1e12] {
        let center = DVec3::new(3.0, -2.0, 1.0) * scale;
        let field = tree(&ball(center, scale), &near(1e-4 * scale, 7));
        let caster = caster(&field, 0.0);
        for _ in 0..2000 {
            let origin = center + random.direction() * (scale * random.length(1.2, 1e5));
            let direction = (center + random.direction() * (0.9 * scale) - origin) * random.length(1e-200, 1e200);
            for method in METHODS {
                let hit = cast(&caster, &[(origin, direction)], method)[0];
                assert!(((hit.point - center).length() / scale - 1.0).abs() < 1e-3, "{scale} {origin} {direction}: {hit:?}");
                assert!(hit.normal.dot((hit.point - center) / scale) > 0.99);
            }
        }
    }
}

#[test]
fn rays_do_not_depend_on_threads() {
    let field = tree(&torus(0.7, 0.2), &near(0.005, 7));
    let rays = rays(&mut Random::new(17), &field.extent_box(), 20_000);
    let (origins, directions): (Vec<_>, Vec<_>) = rays.into_iter().unzip();
    check_threads("casting rays", |run| {
        let hits = Caster::new(&field, 0.01, run)?.cast(&origins, &directions, Method::Cubic, run)?;
        let bits = |p: DVec3| p.to_array().map(f64::to_bits);
        Ok((0..origins.len())
            .map(|ray| hits.get(ray))
            .map(|hit| (hit.distance.to_bits(), bits(hit.point), bits(hit.normal)))
            .collect::<Vec<_>>())
    })
    .unwrap_or_else(|broken| panic!("{broken}"));
}

#[test]
fn rays_that_cannot_be_are_refused() {
    let field = tree(&torus(0.7, 0.2), &near(0.1, 4));
    let run = Run::default();
    for distance in [f64::NAN, f64::INFINITY] {
        assert!(matches!(Caster::new(&field, distance, &run), Err(Error::Invalid(_))));
    }
    let caster = caster(&field, 0.0);
    let one = [DVec3::X];
    for bad in [DVec3::ZERO, DVec3::NAN, DVec3::new(0.0, f64::INFINITY, 0.0)] {
        let said = caster.cast(&[DVec3::X; 2], &[DVec3::X, bad], Method::Cubic, &run).expect_err("no direction").to_string();
        assert!(said.contains("ray 1"), "{said}");
    }
    assert!(caster.cast(&[DVec3::NAN], &one, Method::Linear, &run).is_err());
    assert!(caster.cast(&[], &one, Method::Linear, &run).is_err());
    assert!(caster.cast(&[], &[], Method::Linear, &run).expect("no hits").distances.is_empty());
    for length in [-1.0, f64::NAN] {
        assert!(caster.occluded(&one, &one, length, Method::Linear, &run).is_err());
    }
}

#[test]
fn rays_side_by_side_meet_what_each_meets_alone() {
    let mut random = Random::new(19);
    for (round, shape) in [torus(0.7, 0.2), cuboid(DVec3::new(-0.5, -0.61, -0.72), DVec3::new(0.513, 0.4, 0.31))].iter().enumerate() {
        let field = tree(shape, &near(0.003, 7));
        let caster = caster(&field, 0.01);
        for _ in 0..12 {
            let forward = if round == 0 { random.direction() } else { DVec3::new(0.0, -1.0, 0.0) };
            let [right, up] = [forward.any_orthonormal_vector(), forward.cross(forward.any_orthonormal_vector())];
            // Every second picture in perspective.
            let bend = if random.below(2) == 0 { 0.0 } else { 0.4 };
            let mut rays = Vec::new();
            for y in 0..64 {
                for x in 0..64 {
                    let across = right * (f64::from(x) / 32.0 - 1.0) + up * (f64::from(y) / 32.0 - 1.0);
                    rays.push((across * (1.0 - bend) - forward * 2.0, forward + across * bend));
                }
            }
            for method in METHODS {
                let hits = cast(&caster, &rays, method);
                for (&(origin, direction), hit) in rays.iter().zip(&hits) {
                    let alone = caster.first(origin, direction, f64::INFINITY, method);
                    assert_eq!(alone.map_or(f64::INFINITY.to_bits(), |alone| alone.distance.to_bits()), hit.distance.to_bits());
                    assert!(alone.is_none_or(|alone| alone == *hit));
                }
            }
        }
    }
}
