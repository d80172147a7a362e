//! Attacks on what shapes say between samples.

// Each test file uses its own part of this.
#![allow(dead_code)]

use truefield::laws::Random;
use truefield::{Aabb, DVec3, Interval, SampleBlock, Source};

fn value(shape: &dyn Source, p: DVec3) -> f64 {
    let mut out = [0.0];
    shape.values(&[p], &mut out).expect("a value");
    out[0]
}

/// Between samples, values stay as near to anything that may be said as the shape promises.
pub fn residuals(name: &str, shape: &dyn Source, p: DVec3, size: f64, round: f64, random: &mut Random) {
    let edge = random.length(1e-3, 0.5) * size;
    let low = p - DVec3::new(random.unit(), random.unit(), random.unit()) * edge;
    let cell = Aabb::new(low, low + DVec3::new(0.1 + random.unit(), 0.1 + random.unit(), 0.1 + random.unit()) * edge);
    attack(name, shape, &cell, edge, round, random);
}

/// The same for a given cell.
pub fn aligned(shape: &dyn Source, cell: &Aabb, round: f64, random: &mut Random) {
    attack("a field at its leaves", shape, cell, cell.size().x, round, random);
}

fn attack(name: &str, shape: &dyn Source, cell: &Aabb, edge: f64, round: f64, random: &mut Random) {
    let boxes = [1 + random.below(3), 1 + random.below(3), 1 + random.below(3)];
    let count = DVec3::from_array(boxes.map(|n| n as f64));
    let each = cell.size() / count;
    let nodes = |n: usize| 0..=n;
    let node = |i: usize, j: usize, k: usize| cell.min + cell.size() * (DVec3::new(i as f64, j as f64, k as f64) / count);
    let points: Vec<DVec3> = nodes(boxes[0])
        .flat_map(|i| nodes(boxes[1]).flat_map(move |j| nodes(boxes[2]).map(move |k| (i, j, k))))
        .map(|(i, j, k)| node(i, j, k))
        .collect();
    let mut values = vec![0.0; points.len()];
    shape.values(&points, &mut values).expect("values");
    let off = edge * [0.0, 0.01, 1.0][random.below(3)];
    let said: Vec<f64> = values.iter().map(|value| value + off * (random.unit() - 0.5)).collect();
    let block = SampleBlock { cell: *cell, points: &points, values: &values, said: &said, boxes, square: each.length_squared() };
    let mut out = vec![Interval::ALL; block.len()];
    shape.residual(&block, &mut out).expect("residuals");
    block.each_box(|number, corners| {
        for _ in 0..8 {
            let share = match random.below(3) {
                0 => DVec3::splat(0.5),
                _ => DVec3::new(random.unit(), random.unit(), random.unit()),
            };
            let weight = |corner: usize| {
                let part = |axis: usize| if corner >> axis & 1 == 1 { share[axis] } else { 1.0 - share[axis] };
                part(0) * part(1) * part(2)
            };
            let q = points[corners[0]] + each * share;
            let interpolated: f64 = (0..8).map(|corner| weight(corner) * said[corners[corner]]).sum();
            let (found, allowed) = (value(shape, q) - interpolated, out[number].widen(4.0 * round + 1e-14 * q.length()));
            assert!(allowed.contains(found), "{name}: {found} at {q} is not in {:?}, box {number} of {cell:?}, {boxes:?}", out[number]);
        }
    });
}
