//! Depth, heavy sections and wall thickness against solids whose answers are known.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use truefield::product::thickness::{greatest_depth, heavy_sections};
use truefield::{Aabb, DVec3, Distance, Run, SignChoice, Surface, TriangleMesh};

/// The union of the filled boxes of a rectilinear grid, as a closed mesh of their outer faces.
fn blocks(steps: [&[f64]; 3], filled: impl Fn([usize; 3]) -> bool) -> TriangleMesh {
    let counts = steps.map(|s| s.len() - 1);
    let [nx, ny, nz] = steps.map(<[f64]>::len);
    let vertices = (0..nx * ny * nz).map(|i| DVec3::new(steps[0][i % nx], steps[1][i / nx % ny], steps[2][i / nx / ny])).collect();
    let vertex = |i: [usize; 3]| (i[0] + nx * (i[1] + ny * i[2])) as u32;
    let mut triangles = Vec::new();
    for cell in 0..counts.iter().product() {
        let at = [cell % counts[0], cell / counts[0] % counts[1], cell / counts[0] / counts[1]];
        if !filled(at) {
            continue;
        }
        for axis in 0..3 {
            for high in [false, true] {
                let mut other = at;
                other[axis] = other[axis].wrapping_add(if high { 1 } else { usize::MAX });
                if other[axis] < counts[axis] && filled(other) {
                    continue;
                }
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                let corner = |du: usize, dv: usize| {
                    let mut i = at;
                    i[axis] += usize::from(high);
                    i[u] += du;
                    i[v] += dv;
                    vertex(i)
                };
                let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                triangles.extend(if high { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] });
            }
        }
    }
    TriangleMesh::new(vertices, triangles).expect("blocks")
}

fn cuboid(size: DVec3) -> TriangleMesh {
    blocks([&[0.0, size.x], &[0.0, size.y], &[0.0, size.z]], |_| true)
}

/// A closed profile `(radius, height)`, counter-clockwise seen with radius to the right, turned about z.
fn lathe(profile: &[(f64, f64)], steps: usize) -> TriangleMesh {
    let mut vertices = Vec::new();
    let mut ring = Vec::new();
    for &(r, z) in profile {
        ring.push(vertices.len());
        let count = if r == 0.0 { 1 } else { steps };
        vertices.extend((0..count).map(|i| {
            let (sin, cos) = (i as f64 / steps as f64 * TAU).sin_cos();
            DVec3::new(r * cos, r * sin, z)
        }));
    }
    let vertex = |p: usize, i: usize| (ring[p] + if profile[p].0 == 0.0 { 0 } else { i % steps }) as u32;
    let mut triangles = Vec::new();
    for p in 0..profile.len() {
        let q = (p + 1) % profile.len();
        for i in 0..steps {
            let [a, b, c, d] = [vertex(p, i), vertex(p, i + 1), vertex(q, i + 1), vertex(q, i)];
            triangles.extend([[a, b, c], [a, c, d]].into_iter().filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]));
        }
    }
    TriangleMesh::new(vertices, triangles).expect("a lathe part")
}

fn circle(center: (f64, f64), radius: f64, from: f64, to: f64, steps: usize) -> Vec<(f64, f64)> {
    (0..=steps)
        .map(|i| {
            let (sin, cos) = (from + (to - from) * i as f64 / steps as f64).sin_cos();
            let r = center.0 + radius * cos;
            (if r.abs() < 1e-12 { 0.0 } else { r }, center.1 + radius * sin)
        })
        .collect()
}

fn sphere(radius: f64, steps: usize) -> TriangleMesh {
    lathe(&circle((0.0, 0.0), radius, -PI / 2.0, PI / 2.0, steps / 2), steps)
}

fn cylinder(radius: f64, height: f64, steps: usize) -> TriangleMesh {
    lathe(&[(0.0, 0.0), (radius, 0.0), (radius, height), (0.0, height)], steps)
}

fn torus(major: f64, minor: f64, steps: usize) -> TriangleMesh {
    let mut profile = circle((major, 0.0), minor, 0.0, TAU, steps / 2);
    profile.pop();
    lathe(&profile, steps)
}

/// Turned about an odd axis and moved.
fn moved(mesh: &TriangleMesh, by: DVec3) -> TriangleMesh {
    let axis = DVec3::new(0.3, -0.5, 0.81).normalize();
    let (sin, cos) = 0.77f64.sin_cos();
    let turn = |v: DVec3| v * cos + axis.cross(v) * sin + axis * axis.dot(v) * (1.0 - cos);
    TriangleMesh::new(mesh.vertices().iter().map(|&v| turn(v) + by).collect(), mesh.triangles().to_vec()).expect("a moved mesh")
}

fn surface(mesh: TriangleMesh) -> Surface {
    Surface::new(Arc::new(mesh), SignChoice::Auto, &Run::default()).expect("a surface")
}

#[test]
fn greatest_depth_of_boxes_anywhere() {
    for size in [DVec3::new(3.0, 7.0, 11.0), DVec3::splat(4.0), DVec3::new(100.0, 80.0, 2.0), DVec3::new(1e-3, 5e-3, 2e-3)] {
        for by in [DVec3::ZERO, DVec3::new(12.3, -45.6, 7.8), DVec3::splat(1e5)] {
            for part in [cuboid(size), moved(&cuboid(size), by * size.max_element())] {
                let tolerance = 0.003 * size.min_element();
                let solid = surface(part);
                let found = greatest_depth(&solid, tolerance, &Run::default()).expect("a depth");
                let truth = 0.5 * size.min_element();
                let rounding = 1e-14 * (by.length() + 1.0) * size.length();
                assert!(found.depth.lower - rounding <= truth && truth <= found.depth.upper + rounding, "{size} {by}: {found:?}");
                assert!(found.depth.width() <= tolerance);
                assert!(-solid.at(found.point).upper >= found.depth.lower);
            }
        }
    }
}
#[test]
fn scratch() {
    for (name, mesh) in [("slab", moved(&cuboid(DVec3::new(100.0, 80.0, 2.0)), DVec3::ONE)), ("torus", torus(10.0, 3.0, 40)), ("sphere", sphere(5.0, 40)), ("cylinder", moved(&cylinder(5.0,30.0,40), DVec3::ONE))] {
        let start = std::time::Instant::now();
        let n = mesh.triangles().len();
        let s = surface(mesh);
        let d = greatest_depth(&s, 0.01, &Run::default()).expect("");
        println!("{name} {n} {:?} {:?}", d, start.elapsed());
        let h = heavy_sections(&s, 1.9, 0.02, &Run::default()).expect("");
        println!("{h:?} {:?}", start.elapsed());
    }
    let b = blocks([&[0.,10.,30.,50.,70.,100.], &[0.,20.,40.,60.], &[0.,4.,24.]], |[i,j,k]| k==0 || (j==1 && (i==1||i==3)));
    let s = surface(b);
    let h = heavy_sections(&s, 10.0, 0.05, &Run::default()).expect("");
    println!("{h:#?}");
    println!("truth {}", 10.*10.*14.);
}
