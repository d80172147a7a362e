//! Marching cubes: closed and oriented whatever the samples, and where it should be.

use std::collections::{BTreeMap, BTreeSet};

use truefield::laws::{Random, check_threads};
use truefield::product::surface::{Border, surface};
use truefield::{Continuity, DVec3, Error, Known, Lattice, Run, SampledField, TriangleMesh};

const PLENTY: u64 = 1 << 30;

fn field(shape: [u32; 3], value: impl FnMut(usize) -> f32) -> SampledField {
    let lattice = Lattice { origin: DVec3::new(0.5, -3.0, 7.0), spacing: DVec3::new(0.25, 0.5, 2.0), first: [3, -2, 1], shape };
    let values = (0..lattice.len()).map(value).collect();
    SampledField::new(lattice, values, Known::Within(f64::INFINITY), Continuity::Everywhere).expect("a field")
}

/// How often each directed side occurs.
fn sides(mesh: &TriangleMesh) -> BTreeMap<(u32, u32), usize> {
    let mut sides = BTreeMap::new();
    for t in mesh.triangles() {
        for i in 0..3 {
            *sides.entry((t[i], t[(i + 1) % 3])).or_default() += 1;
        }
    }
    sides
}

/// Winding number of the mesh about a point: the sum of solid angles (Van Oosterom and Strackee 1983).
fn winding(mesh: &TriangleMesh, p: DVec3) -> f64 {
    let angle = |t: usize| {
        let [a, b, c] = mesh.corners(t as u32).map(|v| v - p);
        let [x, y, z] = [a.length(), b.length(), c.length()];
        2.0 * a.dot(b.cross(c)).atan2(x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y)
    };
    (0..mesh.triangles().len()).map(angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
}

fn bits(p: DVec3) -> [u64; 3] {
    (p + 0.0).to_array().map(f64::to_bits)
}

/// The crossings of all lattice edges, found one by one.
fn crossings(field: &SampledField, distance: f64, border: Border) -> Vec<[u64; 3]> {
    let lattice = *field.lattice();
    let shape = lattice.shape.map(i64::from);
    let value = |n: [i64; 3]| {
        let inside = (0..3).all(|a| (0..shape[a]).contains(&n[a]));
        inside.then(|| f64::from(field.values()[((n[0] * shape[1] + n[1]) * shape[2] + n[2]) as usize]))
    };
    let mut found = Vec::new();
    for i in -1..=shape[0] {
        for j in -1..=shape[1] {
            for k in -1..=shape[2] {
                for axis in 0..3 {
                    let (from, mut to) = ([i, j, k], [i, j, k]);
                    to[axis] += 1;
                    let (a, b) = (value(from), value(to));
                    let below = |v: Option<f64>| v.is_some_and(|v| v < distance);
                    let part = match (a, b) {
                        (Some(a), Some(b)) => ((distance - a) / (b - a)).clamp(0.0, 1.0),
                        _ if border == Border::Open => continue,
                        _ => 0.5,
                    };
                    if below(a) == below(b) {
                        continue;
                    }
                    let mut place: [f64; 3] = std::array::from_fn(|a| (lattice.first[a] + from[a]) as f64);
                    place[axis] += part;
                    found.push(bits(lattice.origin + DVec3::from_array(place) * lattice.spacing));
                }
            }
        }
    }
    found.sort_unstable();
    found
}

fn random_fields() -> Vec<SampledField> {
    let mut random = Random::new(1);
    let mut fields = Vec::new();
    let fixed = [[1, 1, 1], [2, 2, 2], [1, 3, 2], [3, 3, 62], [3, 2, 63], [2, 3, 64], [3, 3, 65], [2, 2, 130], [5, 6, 7]];
    for round in 0..200 {
        let shape = fixed.get(round).copied().unwrap_or_else(|| std::array::from_fn(|_| 1 + random.below(9) as u32));
        // From one sample in ten inside to nine; every second field with samples at the distance itself.
        let bias = random.between(-0.8, 0.8);
        let round_off = round % 2 == 0;
        fields.push(field(shape, |_| {
            let value = random.between(-1.0, 1.0) + bias;
            (if round_off { (value * 3.0).round() / 3.0 } else { value }) as f32
        }));
    }
    fields
}

#[test]
fn random_samples_have_closed_oriented_surfaces() {
    for (n, field) in random_fields().iter().enumerate() {
        let Ok(mesh) = surface(field, 0.0, Border::Closed, PLENTY, &Run::with_threads(2)) else {
            // Nothing inside, or, with samples at the distance itself, nothing with an area.
            assert!(n % 2 == 0 || field.values().iter().all(|&v| v >= 0.0), "field {n}");
            continue;
        };
        let sides = sides(&mesh);
        for (&(a, b), &count) in &sides {
            assert!(count == 1 && sides.get(&(b, a)) == Some(&1), "field {n}: side {a}, {b} occurs {count} times");
        }
        let mut vertices: Vec<[u64; 3]> = mesh.vertices().iter().map(|&v| bits(v)).collect();
        vertices.sort_unstable();
        assert_eq!(vertices, crossings(field, 0.0, Border::Closed), "field {n}");
        let used: BTreeSet<u32> = mesh.triangles().iter().flatten().copied().collect();
        assert_eq!(used.len(), mesh.vertices().len(), "field {n}: a vertex without triangles");
    }
}

#[test]
fn what_is_below_is_inside() {
    let mut judged = 0;
    for field in random_fields().iter().skip(1).step_by(2).filter(|f| f.values().len() < 150) {
        let Ok(mesh) = surface(field, 0.0, Border::Closed, PLENTY, &Run::default()) else { continue };
        for (n, &value) in field.values().iter().enumerate() {
            let turns = winding(&mesh, field.lattice().node(n));
            let expected = if value < 0.0 { 1.0 } else { 0.0 };
            assert!((turns - expected).abs() < 1e-6, "{turns} turns about sample {n}, which is {value}");
            judged += 1;
        }
    }
    assert!(judged > 1000);
}

#[test]
fn an_open_surface_has_its_rim_on_the_border() {
    for (n, field) in random_fields().iter().enumerate().filter(|(_, f)| f.lattice().shape.iter().all(|&s| s > 1)) {
        let Ok(mesh) = surface(field, 0.0, Border::Open, PLENTY, &Run::default()) else { continue };
        let extent = field.lattice().extent();
        let on_border = |v: DVec3| (0..3).any(|a| v[a] == extent.min[a] || v[a] == extent.max[a]);
        let sides = sides(&mesh);
        for (&(a, b), &count) in &sides {
            let rim = !sides.contains_key(&(b, a));
            let ends = [a, b].map(|v| mesh.vertices()[v as usize]);
            assert!(count == 1 && (!rim || ends.into_iter().all(on_border)), "field {n}: side {a}, {b}");
        }
        let mut vertices: Vec<[u64; 3]> = mesh.vertices().iter().map(|&v| bits(v)).collect();
        vertices.sort_unstable();
        assert_eq!(vertices, crossings(field, 0.0, Border::Open), "field {n}");
        // Closed, it is the same and a cap.
        let closed = surface(field, 0.0, Border::Closed, PLENTY, &Run::default()).expect("a mesh");
        assert!(closed.triangles().len() > mesh.triangles().len() || sides.keys().all(|&(a, b)| sides.contains_key(&(b, a))));
    }
}

#[test]
fn a_ball_is_round_and_outward() {
    let (center, radius) = (DVec3::new(1.7, -3.1, 12.0), 0.9);
    let lattice =
        Lattice { origin: DVec3::new(0.5, -4.4, 10.8), spacing: DVec3::new(0.05, 0.04, 0.06), first: [0; 3], shape: [48, 66, 41] };
    let values = (0..lattice.len()).map(|n| ((lattice.node(n) - center).length() - radius) as f32).collect();
    let known = Known::Rounded { band: f64::INFINITY, doubtful: Vec::new() };
    let field = SampledField::new(lattice, values, known, Continuity::Everywhere).expect("a field");
    for distance in [0.0, -0.3, 0.2] {
        let mesh = surface(&field, distance, Border::Closed, PLENTY, &Run::default()).expect("a mesh");
        let r = radius + distance;
        let volume: f64 = (0..mesh.triangles().len())
            .map(|t| {
                let [a, b, c] = mesh.corners(t as u32).map(|v| v - center);
                a.dot(b.cross(c)) / 6.0
            })
            .sum();
        let ball = 4.0 / 3.0 * std::f64::consts::PI * r.powi(3);
        assert!((volume / ball - 1.0).abs() < 0.01, "{volume} instead of {ball}");
        for v in mesh.vertices() {
            assert!(((*v - center).length() - r).abs() < 2e-3, "{v}");
        }
        // Of a ball: V - E + F = 2.
        assert_eq!(mesh.vertices().len() + mesh.triangles().len() - 3 * mesh.triangles().len() / 2, 2);
    }
}

#[test]
fn one_sample_is_an_octahedron() {
    let mesh = surface(&field([1, 1, 1], |_| -1.0), 0.0, Border::Closed, PLENTY, &Run::default()).expect("a mesh");
    assert_eq!((mesh.vertices().len(), mesh.triangles().len()), (6, 8));
    assert_eq!(mesh.extent().size(), DVec3::new(0.25, 0.5, 2.0));
    assert!(surface(&field([1, 1, 1], |_| -1.0), 0.0, Border::Open, PLENTY, &Run::default()).is_err());
}

#[test]
fn infinite_samples_do_not_move_the_surface_beyond_their_neighbours() {
    let field = field([3, 1, 1], |n| [f32::NEG_INFINITY, 1.0, f32::INFINITY][n]);
    let mesh = surface(&field, 0.0, Border::Closed, PLENTY, &Run::default()).expect("a mesh");
    assert!(mesh.vertices().iter().all(|v| v.is_finite()));
    assert_eq!(mesh.extent().max.x, field.lattice().node(1).x);
}

#[test]
fn surfaces_do_not_depend_on_threads() {
    let field = &random_fields()[8];
    check_threads("a surface", |run| {
        let mesh = surface(field, 0.1, Border::Closed, PLENTY, run)?;
        Ok((mesh.vertices().iter().map(|&v| bits(v)).collect::<Vec<_>>(), mesh.triangles().to_vec()))
    })
    .unwrap_or_else(|broken| panic!("{broken}"));
}

#[test]
fn surfaces_that_cannot_be_are_refused() {
    let run = Run::default();
    let field = field([4, 4, 4], |n| n as f32);
    for distance in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -0.5] {
        assert!(matches!(surface(&field, distance, Border::Closed, PLENTY, &run), Err(Error::Invalid(_))), "{distance}");
    }
    assert!(matches!(surface(&field, 100.0, Border::Open, PLENTY, &run), Err(Error::Invalid(_))));
    assert!(surface(&field, 100.0, Border::Closed, PLENTY, &run).is_ok());
    assert!(matches!(surface(&field, 30.0, Border::Closed, 1000, &run), Err(Error::Memory { .. })));
}
