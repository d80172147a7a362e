//! Rays against exact trees: the first place where the side of the mesh changes, whatever the mesh is like.

mod nasty;

use std::sync::Arc;

use nasty::corpus;
use truefield::build::adaptive::{Leaves, Rules, adaptive_mesh, root};
use truefield::field::Continuity;
use truefield::field::adaptive::Division;
use truefield::laws::{Random, places};
use truefield::product::raycast::{Caster, Method};
use truefield::{DVec3, Run, SignChoice, Surface};

const RAYS: usize = 6000;

/// Places of a ray that are judged.
const JUDGED: usize = 24;

#[test]
fn no_side_changes_before_a_hit() {
    // Linear leaves between exact ones may be off by the tolerance.
    for (leaves, off) in [(Leaves::Exact, 0.0), (Leaves::Mixed, 2e-3)] {
        check(leaves, off);
    }
}

/// Judges trees of the corpus that may be off by a part of its size.
fn check(leaves: Leaves, off_by: f64) {
    let run = Run::with_threads(2);
    let (mut judged, mut hit, mut meshes) = (0, 0, 0);
    for nasty in corpus() {
        let surface = Surface::new(Arc::new(nasty.mesh), SignChoice::Auto, &run).expect("a surface");
        let surface = Arc::new(surface);
        let (name, extent) = (&nasty.name, surface.mesh().extent());
        // Trees hold single precision.
        if !(1e-30..1e30).contains(&extent.diagonal()) {
            continue;
        }
        let place = root(&*surface, None, Division::Octree).expect("a box");
        let rules = Rules { max_depth: 7, ..Rules::within(1e-3 * extent.diagonal()) };
        let field = adaptive_mesh(&surface, place, leaves, &rules, &run).expect("a tree");
        if field.continuity() != Continuity::Everywhere {
            continue;
        }
        meshes += 1;
        let caster = Caster::new(&field, 0.0, &run).expect("a caster");
        let (mut random, on) = (Random::new(19), places(surface.mesh(), RAYS, 7));
        let size = extent.diagonal();
        let (mut origins, mut directions) = (Vec::new(), Vec::new());
        for &target in &on {
            let origin = match random.below(3) {
                0 => random.within(&field.extent_box()),
                1 => extent.center() + random.direction() * (size * random.length(1.0, 1e3)),
                _ => on[random.below(on.len())] + random.direction() * (size * random.length(1e-3, 2.0)),
            };
            let direction = match random.below(3) {
                // Along axes, and so along many a face.
                0 => DVec3::from_array([0, 1, 2].map(|_| random.below(3) as f64 - 1.0)),
                1 => on[random.below(on.len())] - target,
                _ => target - origin,
            };
            if (direction / size).length() > 1e-12 {
                origins.push(origin);
                directions.push((direction / direction.abs().max_element()).normalize());
            }
        }
        let hits = caster.cast(&origins, &directions, Method::Cubic, &run).expect("hits");
        let mut points = Vec::new();
        for (i, (&origin, &direction)) in origins.iter().zip(&directions).enumerate() {
            let far = (origin - extent.center()).length();
            let end = hits.get(i).distance.min(far + 2.0 * size);
            let from = (far - size).max(0.0).min(end);
            points.push(origin);
            points.extend((1..JUDGED).map(|_| origin + direction * random.between(from, end)));
        }
        let bounds = surface.bounds(&points, &run).expect("answers");
        for (i, (points, bounds)) in points.chunks(JUDGED).zip(bounds.chunks(JUDGED)).enumerate() {
            let (origin, hit_at) = (points[0], hits.get(i));
            let reach = size + (origin - extent.center()).length() + origin.abs().max_element() + extent.center().abs().max_element();
            // So near to the surface rounding decides, or interpolation.
            let close = 1e-9 * reach + off_by * size;
            let side = |at: usize| (bounds[at].lower.abs() > close && bounds[at].width() == 0.0).then_some(bounds[at].lower < 0.0);
            let Some(first) = side(0) else { continue };
            for at in 1..JUDGED {
                let before = (points[at] - origin).length() < hit_at.distance - close;
                if let (true, Some(found)) = (before, side(at)) {
                    assert_eq!(
                        found, first,
                        "{name}, ray {i} from {origin:?} along {:?}: {:?} before {hit_at:?}",
                        directions[i], points[at]
                    );
                    judged += 1;
                }
            }
            if hit_at.distance.is_finite() {
                hit += 1;
                let off = surface.distances(&[hit_at.point], &run).expect("a distance")[0].abs();
                assert!(off <= close, "{name}, ray {i} from {origin:?} along {:?}: {off} off at {hit_at:?}", directions[i]);
                assert!((hit_at.normal.length() - 1.0).abs() < 1e-9);
            } else {
                assert!(!first, "{name}, ray {i} leaves the solid without a hit, from {origin:?} along {:?}", directions[i]);
            }
        }
    }
    assert!(judged > 100_000 && hit > 10_000 && meshes > 10, "{judged} {hit} {meshes}");
}
