//! Makers of well-formed and of badly formed meshes, as triangle soups to be welded or not.

use std::collections::HashMap;
use std::f64::consts::TAU;

use truefield::laws::Random;
use truefield::{DVec3, TriangleMesh};

pub type Soup = Vec<[DVec3; 3]>;

/// A mesh with equal corners (to the bit) made one.
pub fn welded(soup: &[[DVec3; 3]]) -> TriangleMesh {
    let mut index: HashMap<[u64; 3], u32> = HashMap::new();
    let mut vertices = Vec::new();
    let mut vertex = |v: DVec3| {
        // 0.0 and -0.0 are one place.
        let key = v.to_array().map(|x| (x + 0.0).to_bits());
        *index.entry(key).or_insert_with(|| {
            vertices.push(v);
            vertices.len() as u32 - 1
        })
    };
    let triangles = soup.iter().map(|t| t.map(&mut vertex)).collect();
    TriangleMesh::new(vertices, triangles).expect("a mesh")
}

/// A mesh in which every triangle has corners of its own, as in an STL file.
pub fn loose(soup: &[[DVec3; 3]]) -> TriangleMesh {
    let triangles = (0..soup.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    TriangleMesh::new(soup.concat(), triangles).expect("a mesh")
}

pub fn moved(soup: &[[DVec3; 3]], map: impl Fn(DVec3) -> DVec3) -> Soup {
    soup.iter().map(|t| t.map(&map)).collect()
}

pub fn flipped(soup: &[[DVec3; 3]]) -> Soup {
    soup.iter().map(|&[a, b, c]| [a, c, b]).collect()
}

fn quad(out: &mut Soup, [a, b, c, d]: [DVec3; 4]) {
    out.push([a, b, c]);
    out.push([a, c, d]);
}

/// The box from `min` to `max`.
pub fn cuboid(min: DVec3, max: DVec3) -> Soup {
    let at = |x: usize, y: usize, z: usize| DVec3::new([min.x, max.x][x], [min.y, max.y][y], [min.z, max.z][z]);
    let mut out = Vec::new();
    quad(&mut out, [at(0, 0, 0), at(0, 1, 0), at(1, 1, 0), at(1, 0, 0)]);
    quad(&mut out, [at(0, 0, 1), at(1, 0, 1), at(1, 1, 1), at(0, 1, 1)]);
    quad(&mut out, [at(0, 0, 0), at(1, 0, 0), at(1, 0, 1), at(0, 0, 1)]);
    quad(&mut out, [at(0, 1, 0), at(0, 1, 1), at(1, 1, 1), at(1, 1, 0)]);
    quad(&mut out, [at(0, 0, 0), at(0, 0, 1), at(0, 1, 1), at(0, 1, 0)]);
    quad(&mut out, [at(1, 0, 0), at(1, 1, 0), at(1, 1, 1), at(1, 0, 1)]);
    out
}

pub fn cube() -> Soup {
    cuboid(DVec3::ZERO, DVec3::ONE)
}

pub fn tetrahedron() -> Soup {
    let [a, b, c, d] = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    vec![[a, c, b], [a, b, d], [b, c, d], [c, a, d]]
}

/// A surface over a grid of `n` x `m` parameters in [0, 1], oriented along (d/du x d/dv).
pub fn sheet(n: usize, m: usize, at: impl Fn(f64, f64) -> DVec3) -> Soup {
    let mut out = Vec::new();
    let at = |i: usize, j: usize| at(i as f64 / n as f64, j as f64 / m as f64);
    for i in 0..n {
        for j in 0..m {
            quad(&mut out, [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    out
}

pub fn torus(n: usize, m: usize, large: f64, small: f64) -> Soup {
    // The last ring is the first, to the bit.
    let angle = |u: f64| if u >= 1.0 { 0.0 } else { u * TAU };
    sheet(n, m, |u, v| {
        let ((su, cu), (sv, cv)) = (angle(u).sin_cos(), angle(v).sin_cos());
        DVec3::new((large + small * cv) * cu, (large + small * cv) * su, small * sv)
    })
}

pub fn icosphere(level: u32) -> Soup {
    let g = (1.0 + 5f64.sqrt()) / 2.0;
    let v = |x: f64, y: f64, z: f64| DVec3::new(x, y, z).normalize();
    let p = [
        v(-1.0, g, 0.0),
        v(1.0, g, 0.0),
        v(-1.0, -g, 0.0),
        v(1.0, -g, 0.0),
        v(0.0, -1.0, g),
        v(0.0, 1.0, g),
        v(0.0, -1.0, -g),
        v(0.0, 1.0, -g),
        v(g, 0.0, -1.0),
        v(g, 0.0, 1.0),
        v(-g, 0.0, -1.0),
        v(-g, 0.0, 1.0),
    ];
    let faces = [
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    let mut out: Soup = faces.iter().map(|f| f.map(|i| p[i])).collect();
    for _ in 0..level {
        out = out
            .iter()
            .flat_map(|&[a, b, c]| {
                let (ab, bc, ca) = ((a + b).normalize(), (b + c).normalize(), (c + a).normalize());
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    out
}

/// A prism over a star-shaped outline around the origin: its caps are fans, its sides quads.
pub fn prism(outline: &[(f64, f64)], bottom: f64, top: f64) -> Soup {
    let at = |i: usize, z: f64| {
        let (x, y) = outline[i % outline.len()];
        DVec3::new(x, y, z)
    };
    let mut out = Vec::new();
    for i in 0..outline.len() {
        out.push([DVec3::Z * top, at(i, top), at(i + 1, top)]);
        out.push([DVec3::Z * bottom, at(i + 1, bottom), at(i, bottom)]);
        quad(&mut out, [at(i, bottom), at(i + 1, bottom), at(i + 1, top), at(i, top)]);
    }
    out
}

pub fn star(points: usize, inner: f64, height: f64) -> Soup {
    let outline: Vec<(f64, f64)> = (0..2 * points)
        .map(|i| {
            let (sin, cos) = (TAU * i as f64 / (2 * points) as f64).sin_cos();
            let r = if i % 2 == 0 { 1.0 } else { inner };
            (r * cos, r * sin)
        })
        .collect();
    prism(&outline, 0.0, height)
}

/// A rod as CAD systems write it: sides as long as the rod, caps fanned from one corner.
pub fn rod(sides: usize, radius: f64, length: f64) -> Soup {
    let at = |i: usize, z: f64| {
        let (sin, cos) = (TAU * (i % sides) as f64 / sides as f64).sin_cos();
        DVec3::new(radius * cos, radius * sin, z)
    };
    let mut out = Vec::new();
    for i in 0..sides {
        quad(&mut out, [at(i, 0.0), at(i + 1, 0.0), at(i + 1, length), at(i, length)]);
        if (1..sides - 1).contains(&i) {
            out.push([at(0, length), at(i, length), at(i + 1, length)]);
            out.push([at(0, 0.0), at(i + 1, 0.0), at(i, 0.0)]);
        }
    }
    out
}

/// A bumpy closed surface, like a scan.
pub fn scan(n: usize, m: usize, seed: u64) -> Soup {
    let mut random = Random::new(seed);
    let waves: Vec<(DVec3, f64, f64)> =
        (0..6).map(|_| (random.direction() * random.between(3.0, 9.0), random.between(0.0, TAU), random.between(0.02, 0.06))).collect();
    let bump = |d: DVec3| d * (1.0 + waves.iter().map(|(k, phase, height)| height * (k.dot(d) + phase).sin()).sum::<f64>());
    let angle = |u: f64| if u >= 1.0 { 0.0 } else { u * TAU };
    let ball = sheet(n, m, |u, v| {
        if v <= 0.0 || v >= 1.0 {
            return bump(if v <= 0.0 { -DVec3::Z } else { DVec3::Z });
        }
        let ((su, cu), (sv, cv)) = (angle(u).sin_cos(), ((v - 0.5) * TAU / 2.0).sin_cos());
        bump(DVec3::new(cu * cv, su * cv, sv))
    });
    // At the poles one half of each quad is a segment.
    ball.into_iter().filter(|[a, b, c]| a != b && b != c && c != a).collect()
}

/// Unrelated triangles with edges of about `size` in the unit cube.
pub fn random_soup(count: usize, size: f64, seed: u64) -> Soup {
    let mut random = Random::new(seed);
    (0..count)
        .map(|_| {
            let at = DVec3::new(random.unit(), random.unit(), random.unit());
            [(); 3].map(|()| at + random.direction() * (size * random.unit()))
        })
        .collect()
}

/// Triangles of relative heights from 1 down to 1e-16.
pub fn slivers(count: usize, seed: u64) -> Soup {
    let mut random = Random::new(seed);
    (0..count)
        .map(|_| {
            let at = DVec3::new(random.unit(), random.unit(), random.unit());
            let (x, y) = (random.direction(), random.direction());
            let height = random.length(1e-16, 1.0);
            let along = [random.between(-0.2, 1.2), 1.0, random.length(1e-12, 1.0)][random.below(3)];
            let mut t = [at, at + x, at + x * along + y * height];
            t.rotate_left(random.below(3));
            t
        })
        .collect()
}

/// Every coordinate moved by up to one unit in the last place, every corner for itself.
pub fn trembling(soup: &[[DVec3; 3]], seed: u64) -> Soup {
    let mut random = Random::new(seed);
    let mut shake = |x: f64| match random.below(3) {
        0 => x.next_up(),
        1 => x.next_down(),
        _ => x,
    };
    soup.iter().map(|t| t.map(|v| DVec3::from_array(v.to_array().map(&mut shake)))).collect()
}

/// The cube with its edges and faces subdivided on one side only.
pub fn t_junctions() -> Soup {
    let mut out = cube();
    let top: Soup = out.drain(2..4).collect();
    for [a, b, c] in top {
        let (ab, m) = (a * 0.5 + b * 0.5, (a + b + c) / 3.0);
        out.extend([[a, ab, m], [ab, b, m], [b, c, m], [c, a, m]]);
    }
    out
}

/// A band with a half twist: no side is inside.
pub fn moebius(n: usize) -> Soup {
    sheet(n, 2, |u, v| {
        let (sin, cos) = (u * TAU).sin_cos();
        let (half_sin, half_cos) = (u * TAU / 2.0).sin_cos();
        let w = v - 0.5;
        DVec3::new((1.0 + w * half_cos) * cos, (1.0 + w * half_cos) * sin, w * half_sin)
    })
}
