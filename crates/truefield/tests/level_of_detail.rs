//! Coarser trees: honest, and never better than finer ones; trees from samples.

mod balls;

use balls::{Ball, Solid, Step};
use truefield::build::adaptive::{Reconstruction, Rules, adaptive, coalesce, root};
use truefield::field::adaptive::{AdaptiveField, Division};
use truefield::laws::Random;
use truefield::op::edit::{Operation, edit};
use truefield::op::level_of_detail::{Detail, level_of_detail};
use truefield::{Continuity, DVec3, Distance, Known, Lattice, Run, SampledField};

fn edited(reconstruction: Reconstruction) -> (AdaptiveField, Solid) {
    let first = Ball::new(0.0, 0.0, 0.0, 1.0);
    let steps = [
        (Step::Carve, Ball::new(0.8, 0.1, 0.0, 0.4)),
        (Step::Fill, Ball::new(0.0, 0.9, 0.2, 0.5)),
        (Step::Intersect, Ball::new(0.0, 0.0, 0.2, 1.1)),
    ];
    let run = Run::default();
    let rules = Rules { reconstruction, ..Rules::within(0.02) };
    let mut field = adaptive(&first, root(&first, None, Division::Octree).expect("a box"), &rules, &run).expect("a field");
    for (step, ball) in &steps {
        let operation = match step {
            Step::Carve => Operation::Carve,
            Step::Fill => Operation::Fill,
            Step::Intersect => Operation::Intersect,
        };
        field = edit(&field, ball, operation, 1 << 30, &run).expect("a field");
    }
    (field, Solid::new(first, &steps))
}

#[test]
fn coarser_fields_are_honest_and_monotone() {
    let run = Run::default();
    for reconstruction in [Reconstruction::Linear, Reconstruction::Cubic] {
        let (fine, solid) = edited(reconstruction);
        let depth = fine.statistics().depth;
        let tolerances = [0.02, 0.025, 0.03, 0.1, 0.5, 10.0].map(Detail::Tolerance);
        let depths = (0..=depth).rev().map(Detail::Depth);
        for details in [tolerances.to_vec(), depths.collect()] {
            let mut before = fine.clone();
            for detail in details {
                let coarse = level_of_detail(&fine, detail, &run).expect("a field");
                assert!(coarse.statistics().cells <= before.statistics().cells);
                let mut random = Random::new(1);
                for _ in 0..3_000 {
                    let p = random.within(&fine.extent_box().grow(0.2));
                    assert!(
                        coarse.at(p).widen(1e-12).contains(solid.distance(p)),
                        "{detail:?}: {} at {p} is not in {:?}",
                        solid.distance(p),
                        coarse.at(p)
                    );
                    let (Some(cell), Some(finer), Some(leaf)) = (coarse.find(p), before.find(p), fine.find(p)) else { continue };
                    assert!(cell.depth() <= finer.depth() && cell.largest_error() >= finer.largest_error());
                    if let Detail::Tolerance(tolerance) = detail {
                        let (said, value) = (cell.value(p), leaf.value(p));
                        let off = (said - value).abs();
                        assert!(off <= 2.0 * (tolerance + 0.05 * value.abs()), "{off} at {p} for {detail:?}");
                    }
                }
                before = coarse;
            }
        }
        let one = level_of_detail(&fine, Detail::Depth(0), &run).expect("a field");
        assert_eq!(one.statistics().cells, 1);
        let same = level_of_detail(&fine, Detail::Depth(24), &run).expect("a field");
        assert!(same.to_levels().levels == fine.to_levels().levels);
        for bad in [0.0, -1.0, f64::NAN] {
            assert!(level_of_detail(&fine, Detail::Tolerance(bad), &run).is_err());
        }
    }
}

#[test]
fn fields_cut_by_depth_are_their_first_levels() {
    let run = Run::default();
    for reconstruction in [Reconstruction::Linear, Reconstruction::Cubic] {
        let (fine, _) = edited(reconstruction);
        for depth in 0..=fine.statistics().depth {
            let mut levels = fine.to_levels();
            levels.cut(depth);
            let cut = level_of_detail(&fine, Detail::Depth(depth), &run).expect("a field").to_levels();
            assert!(cut.levels == levels.levels && cut.edits == levels.edits && cut.coverage == levels.coverage);
            assert_eq!(cut.accuracy.max_depth, fine.accuracy().max_depth.min(depth));
        }
    }
}

#[test]
fn samples_merge_within_the_tolerance_and_hold() {
    let solid = Solid::new(Ball::new(0.3, 0.2, 0.1, 1.0), &[(Step::Carve, Ball::new(1.0, 0.3, 0.2, 0.5))]);
    let run = Run::default();
    let mut random = Random::new(3);
    for (shape, spacing) in [([33, 33, 33], DVec3::splat(0.09)), ([20, 31, 2], DVec3::new(0.15, 0.1, 2.0)), ([2, 2, 2], DVec3::splat(3.0))]
    {
        let lattice = Lattice { origin: DVec3::splat(-1.2), spacing, first: [0; 3], shape };
        let values: Vec<f32> = (0..lattice.len()).map(|n| solid.distance(lattice.node(n)) as f32).collect();
        let known = Known::Rounded { band: f64::INFINITY, doubtful: Vec::new() };
        let samples = SampledField::new(lattice, values, known, Continuity::Everywhere).expect("samples");
        let mut cells = u64::MAX;
        for (tolerance, growth) in [(1e-6, 0.0), (0.01, 0.0), (0.01, 0.1), (0.2, 0.1), (100.0, 0.0)] {
            let rules = Rules { growth, ..Rules::within(tolerance) };
            let field = coalesce(&samples, &rules, &run).expect("a field");
            assert!(field.statistics().cells <= cells);
            cells = field.statistics().cells;
            assert!(coalesce(&samples, &rules, &Run::with_threads(1)).expect("a field").to_levels() == field.to_levels());
            for _ in 0..10_000 {
                let p = random.within(&field.extent_box().grow(0.2));
                assert_eq!(solid.value(p) < 0.0, solid.distance(p) < 0.0);
                assert!(field.at(p).contains(solid.distance(p)), "{} at {p} is not in {:?}", solid.distance(p), field.at(p));
                if let (Some(said), Some(value)) = (field.interpolate(p), samples.interpolate(p)) {
                    assert!((said - value).abs() <= tolerance + growth * value.abs() + 1e-6, "{said} is not {value} at {p}");
                }
            }
        }
        assert_eq!(cells, 1);
    }
}

#[test]
fn samples_that_cannot_be_merged_are_refused() {
    let make = |shape: [u32; 3], value: f32, continuity| {
        let lattice = Lattice { origin: DVec3::ZERO, spacing: DVec3::ONE, first: [0; 3], shape };
        let known = Known::Within(1.0);
        SampledField::new(lattice, vec![value; lattice.len()], known, continuity).expect("samples")
    };
    let refused = |samples: &SampledField, rules: &Rules| coalesce(samples, rules, &Run::default()).expect_err("refused").to_string();
    let rules = Rules::within(0.1);
    assert!(refused(&make([5, 1, 5], 1.0, Continuity::Everywhere), &rules).contains("two or more"));
    assert!(refused(&make([5, 5, 5], f32::INFINITY, Continuity::Everywhere), &rules).contains("finite"));
    assert!(refused(&make([5, 5, 5], 1.0, Continuity::ExceptOpenings), &rules).contains("openings"));
    assert!(refused(&make([5, 5, 5], 1.0, Continuity::Everywhere), &Rules { max_depth: 1, ..rules }).contains("max_depth"));
}
