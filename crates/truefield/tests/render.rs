//! Pictures against what geometry says they must show.

#![allow(clippy::unwrap_used)]

use truefield::product::render::{
    Background, Camera, Canvas, Finish, Ink, Paint, Picture, Projection, Ramp, Samples, Scene, View, covering_radius, render,
};
use truefield::{DVec3, Error, Run, TriangleMesh};

const PLAIN: Finish = Finish { ambient: 1.0, diffuse: 0.0, specular: 0.0, shininess: 1.0 };
const PERSPECTIVE: Projection = Projection::Perspective { field_of_view: 40.0 };
const ORANGE: Paint = Paint::Uniform([230, 120, 40]);

/// Evenly spread numbers from 0 to 1, the same every time.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn point(&mut self) -> DVec3 {
        DVec3::new(self.next(), self.next(), self.next()) * 2.0 - 1.0
    }
}

fn canvas(width: u32, height: u32, samples: Samples) -> Canvas {
    Canvas { width, height, samples, background: Background::Transparent, occlusion: 0.0 }
}

fn draw(scene: &Scene, camera: &Camera, canvas: &Canvas) -> Picture {
    render(scene, camera, canvas, &Run::with_threads(2)).unwrap()
}

fn box_corners(half: f64) -> Vec<DVec3> {
    (0..8).map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) * 2.0 * half - half).collect()
}

/// Covered pixels, parts of pixels counted as such.
fn coverage(picture: &Picture) -> f64 {
    picture.rgba.chunks_exact(4).map(|p| f64::from(p[3]) / 255.0).sum()
}

/// Width of a pixel in model units (in perspective at unit depth), seen from outside.
fn pixel(camera: &Camera, width: u32, height: u32) -> f64 {
    let lens = camera.lens(width, height);
    let [right, depth] = [camera.eye() + camera.forward(), camera.forward()];
    // Two points a small step apart, across the view.
    let across = depth.any_orthonormal_vector();
    let (a, b) = (lens.pixel(right).unwrap(), lens.pixel(right + across * 1e-3).unwrap());
    1e-3 / (a[0] - b[0]).hypot(a[1] - b[1])
}

fn soup(triangles: &[[DVec3; 3]]) -> TriangleMesh {
    let vertices = triangles.iter().flatten().copied().collect();
    TriangleMesh::new(vertices, (0..triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect()).unwrap()
}

fn sphere_points(count: usize, radius: f64) -> Vec<DVec3> {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    (0..count)
        .map(|k| {
            let z = 1.0 - (2.0 * k as f64 + 1.0) / count as f64;
            let (sin, cos) = (golden * k as f64).sin_cos();
            DVec3::new(cos * (1.0 - z * z).sqrt(), sin * (1.0 - z * z).sqrt(), z) * radius
        })
        .collect()
}

/// A square of side 2 across the z axis, cut into triangles with shaken inner vertices.
fn shaken_square(cells: u32, random: &mut Random) -> TriangleMesh {
    let side = cells + 1;
    let mut vertices = Vec::new();
    for j in 0..side {
        for i in 0..side {
            let inner = |k: u32| k > 0 && k < cells;
            let shake = if inner(i) && inner(j) { 0.7 / f64::from(cells) } else { 0.0 };
            let place = |k: u32, r: f64| 2.0 * f64::from(k) / f64::from(cells) - 1.0 + shake * (r - 0.5);
            vertices.push(DVec3::new(place(i, random.next()), place(j, random.next()), 0.0));
        }
    }
    let mut triangles = Vec::new();
    for j in 0..cells {
        for i in 0..cells {
            let v = j * side + i;
            triangles.extend([[v, v + 1, v + side + 1], [v, v + side + 1, v + side]]);
        }
    }
    TriangleMesh::new(vertices, triangles).unwrap()
}

#[test]
fn the_outline_of_a_ball_has_the_area_of_geometry() {
    for projection in [Projection::Orthographic, PERSPECTIVE] {
        for (view, radius) in [(View::Isometric, 0.9), (View::Top, 0.41), (View::Front, 0.043)] {
            let mut scene = Scene::new();
            scene.add_balls(vec![DVec3::ZERO], vec![radius], ORANGE, Finish::POLISHED, 1.0).unwrap();
            let camera = Camera::fit(box_corners(1.0), view, projection, 0.05).unwrap();
            let picture = draw(&scene, &camera, &canvas(400, 300, Samples::Nine));
            let away = camera.eye().length();
            let outline = if projection == Projection::Orthographic { radius } else { radius / (away * away - radius * radius).sqrt() };
            let expected = std::f64::consts::PI * (outline / pixel(&camera, 400, 300)).powi(2);
            let found = coverage(&picture);
            assert!((found - expected).abs() < 0.003 * expected, "{projection:?} {view:?} {radius}: {found} pixels, not {expected}");
        }
    }
}

#[test]
fn the_outline_of_triangles_has_the_area_of_geometry() {
    let mut random = Random(3);
    for _ in 0..20 {
        let corners = [random.point(), random.point(), random.point()];
        let mut scene = Scene::new();
        scene.add_mesh(&soup(&[corners]), ORANGE, Finish::SATIN, 1.0, None).unwrap();
        let camera = Camera::fit(box_corners(1.0), View::Isometric, Projection::Orthographic, 0.02).unwrap();
        let found = coverage(&draw(&scene, &camera, &canvas(500, 500, Samples::Nine)));
        let area = 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]).dot(camera.forward()).abs();
        let expected = area / pixel(&camera, 500, 500).powi(2);
        assert!((found - expected).abs() < 0.003 * expected + 6.0, "{found} pixels, not {expected}");
    }
}

#[test]
fn depth_at_pixel_centres_is_the_depth_of_geometry() {
    for projection in [Projection::Orthographic, PERSPECTIVE] {
        let camera = Camera::fit(box_corners(1.0), View::Isometric, projection, 0.05).unwrap();
        let lens = camera.lens(160, 120);
        let (center, radius, normal) = (DVec3::new(0.2, -0.1, 0.3), 0.5, DVec3::new(0.3, -0.5, 0.8).normalize());
        let across = normal.any_orthonormal_vector();
        let along = normal.cross(across);
        let plate = [across, along - across, -along - across].map(|v| v * 0.7);
        let mut scenes = [Scene::new(), Scene::new(), Scene::new()];
        scenes[0].add_balls(vec![center], vec![radius], ORANGE, PLAIN, 1.0).unwrap();
        scenes[1].add_mesh(&soup(&[plate]), ORANGE, PLAIN, 1.0, None).unwrap();
        scenes[2].add_points(vec![DVec3::ZERO], vec![normal.as_vec3().to_array()], 0.6, ORANGE, PLAIN).unwrap();
        for (which, scene) in scenes.iter().enumerate() {
            let picture = draw(scene, &camera, &canvas(160, 120, Samples::One));
            let mut seen = 0;
            for (index, &depth) in picture.depth.iter().enumerate().filter(|(_, d)| d.is_finite()) {
                // The point that this pixel and this depth stand for must lie on the shape: search it along the depth.
                let (x, y) = ((index % 160) as f64 + 0.5, (index / 160) as f64 + 0.5);
                let point = unproject(&camera, &lens, x, y, f64::from(depth));
                let off = match which {
                    0 => point.distance(center) - radius,
                    _ => point.dot(normal),
                };
                assert!(off.abs() < 2e-6, "{projection:?} scene {which}, pixel {index}: {off} off the surface");
                seen += 1;
            }
            assert!(seen > 500, "scene {which}: only {seen} pixels");
            let opaque = picture.rgba.chunks_exact(4).filter(|p| p[3] == 255).count();
            assert_eq!(opaque, seen, "depth and colour agree on what is covered");
        }
    }
}

/// The point at a pixel coordinate and depth, found from the public projection alone (which is affine at one depth).
fn unproject(camera: &Camera, lens: &truefield::product::render::Lens, x: f64, y: f64, depth: f64) -> DVec3 {
    let right = camera.forward().any_orthonormal_vector();
    let up = camera.forward().cross(right);
    let base = camera.eye() + camera.forward() * depth;
    let [o, r, u] = [base, base + right, base + up].map(|p| lens.pixel(p).unwrap());
    let (a, b, c, d) = (r[0] - o[0], u[0] - o[0], r[1] - o[1], u[1] - o[1]);
    let det = a * d - b * c;
    let (px, py) = (x - o[0], y - o[1]);
    base + right * ((px * d - b * py) / det) + up * ((a * py - px * c) / det)
}

#[test]
fn triangles_that_share_edges_leave_no_gap_and_overlap_nowhere() {
    let mut random = Random(17);
    let square = shaken_square(23, &mut random);
    for (view, projection) in [
        (View::Top, Projection::Orthographic),
        (View::Top, PERSPECTIVE),
        (View::Along { direction: DVec3::new(0.3, 0.2, -1.0), up: DVec3::new(0.1, 1.0, 0.2) }, Projection::Orthographic),
    ] {
        let mut scene = Scene::new();
        scene.add_mesh(&square, ORANGE, PLAIN, 0.4, None).unwrap();
        // The margin is below zero in effect: all of the picture lies inside the square.
        let middle: Vec<DVec3> = box_corners(0.3).into_iter().map(|p| DVec3::new(p.x, p.y, 0.0)).collect();
        let camera = Camera::fit(middle, view, projection, 0.0).unwrap();
        let picture = draw(&scene, &camera, &canvas(333, 301, Samples::Nine));
        let (least, most) = picture.rgba.chunks_exact(4).fold((255, 0), |(a, b), p| (a.min(p[3]), b.max(p[3])));
        // One sheet everywhere: 0.4 face on, a little more where the view is slanted or diverges.
        assert!(least >= 101 && most <= 112, "{view:?} {projection:?}: opacity from {least} to {most}");
    }
}

#[test]
fn sheets_of_glass_that_cross_are_laid_over_each_other_in_order_of_depth() {
    let mut random = Random(5);
    for (round, projection) in [Projection::Orthographic, PERSPECTIVE, Projection::Orthographic].into_iter().enumerate() {
        let count = 24;
        let triangles: Vec<[DVec3; 3]> = (0..count).map(|_| [random.point(), random.point(), random.point()]).collect();
        let colours: Vec<[u8; 3]> = (0..count).map(|_| [random.next(), random.next(), random.next()].map(|c| (255.0 * c) as u8)).collect();
        let opacities: Vec<f64> = (0..count).map(|k| if round == 2 && k % 6 == 0 { 1.0 } else { 0.1 + 0.6 * random.next() }).collect();
        let mut scene = Scene::new();
        for k in 0..count {
            scene.add_mesh(&soup(&[triangles[k]]), Paint::Uniform(colours[k]), PLAIN, opacities[k], None).unwrap();
        }
        let camera = Camera::fit(box_corners(1.0), View::Front, projection, 0.02).unwrap();
        let (width, height) = (97, 71);
        let picture = draw(&scene, &camera, &canvas(width, height, Samples::One));
        let lens = camera.lens(width, height);
        let mut crossings = 0;
        for y in 0..height {
            for x in 0..width {
                let (px, py) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
                let (near, far) = (unproject(&camera, &lens, px, py, 0.5), unproject(&camera, &lens, px, py, 1.5));
                let mut hits: Vec<(f64, usize)> = Vec::new();
                let mut doubtful = false;
                for (k, [a, b, c]) in triangles.iter().enumerate() {
                    let (ab, ac, d) = (*b - *a, *c - *a, far - near);
                    let det = ab.dot(d.cross(ac));
                    let s = (near - *a).dot(d.cross(ac)) / det;
                    let t = d.dot((near - *a).cross(ab)) / det;
                    let rim = s.min(t).min(1.0 - s - t);
                    doubtful |= rim.abs() < 1e-9;
                    if rim > 0.0 {
                        hits.push((0.5 + ac.dot((near - *a).cross(ab)) / det, k));
                    }
                }
                hits.sort_by(|p, q| p.0.total_cmp(&q.0));
                doubtful |= hits.windows(2).any(|w| (w[1].0 - w[0].0).abs() < 1e-5);
                if doubtful {
                    continue;
                }
                crossings += hits.len();
                let (mut light, mut through) = ([0.0; 3], 1.0);
                for &(_, k) in &hits {
                    let [a, b, c] = triangles[k];
                    let toward = (near - far).normalize();
                    let normal = (b - a).cross(c - a).normalize();
                    let normal = if normal.dot(toward) < 0.0 { -normal } else { normal };
                    let opacity = 1.0 - (1.0 - opacities[k]).powf(1.0 / normal.dot(toward).max(0.04));
                    for (sum, colour) in light.iter_mut().zip(colours[k]) {
                        *sum += through * opacity * decode(colour) * (0.9 + 0.1 * normal.z);
                    }
                    through *= 1.0 - opacity;
                }
                let index = 4 * (y * width + x) as usize;
                let found = &picture.rgba[index..index + 4];
                let opacity: f64 = 1.0 - through;
                assert!((f64::from(found[3]) - 255.0 * opacity).abs() < 1.0, "opacity {} at {x}, {y}, not {}", found[3], 255.0 * opacity);
                for channel in 0..3 {
                    let expected = if opacity > 0.0 { encode(light[channel] / opacity) } else { 0.0 };
                    assert!((f64::from(found[channel]) - expected).abs() < 1.0, "channel {channel} at {x}, {y}: {found:?}, not {expected}");
                }
            }
        }
        assert!(crossings > 4000, "the scene is worth looking at: {crossings}");
    }
}

fn decode(code: u8) -> f64 {
    let c = f64::from(code) / 255.0;
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

fn encode(light: f64) -> f64 {
    255.0 * if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 }
}

#[test]
fn thousands_of_sheets_are_drawn_within_the_memory_set_aside() {
    let layers = 2000;
    let triangles: Vec<[DVec3; 3]> = (0..layers)
        .map(|k| {
            [DVec3::new(-9.0, -9.0, 0.0), DVec3::new(9.0, -9.0, 0.0), DVec3::new(0.0, 9.0, 0.0)].map(|p| p + DVec3::Z * 1e-4 * f64::from(k))
        })
        .collect();
    let mut scene = Scene::new();
    scene.add_mesh(&soup(&triangles), ORANGE, PLAIN, 0.001, None).unwrap();
    let camera = Camera::fit(box_corners(1.0), View::Top, Projection::Orthographic, 0.0).unwrap();
    let picture = draw(&scene, &camera, &canvas(32, 32, Samples::Nine));
    let expected = 255.0 * (1.0 - 0.999_f64.powi(layers));
    assert!(picture.rgba.chunks_exact(4).all(|p| (f64::from(p[3]) - expected).abs() < 1.0));
}

/// Every kind of thing at once.
fn everything() -> Scene {
    let mut random = Random(99);
    let mut scene = Scene::new();
    let square = shaken_square(9, &mut random);
    let values = square.vertices().iter().map(|v| if v.x > 0.8 { f64::NAN } else { v.x + v.y }).collect();
    let ramp = Ramp { colours: vec![[0, 0, 80], [250, 240, 60]], low: -1.0, high: 1.0 };
    let ink = Some(Ink { colour: [0, 0, 0], opacity: 0.6, width: 1.5 });
    scene.add_mesh(&square, Paint::ValuePerVertex(values, ramp), Finish::CHART, 1.0, ink).unwrap();
    let crossing: Vec<[DVec3; 3]> = (0..40).map(|_| [random.point(), random.point(), random.point()]).collect();
    scene.add_mesh(&soup(&crossing), ORANGE, Finish::POLISHED, 0.2, ink).unwrap();
    let points = sphere_points(20_000, 0.6);
    let normals = points.iter().map(|p| p.as_vec3().normalize().to_array()).collect();
    let radius = covering_radius(&points).unwrap();
    scene.add_points(points, normals, radius, Paint::Uniform([90, 160, 220]), Finish::SATIN).unwrap();
    let centers = vec![DVec3::new(0.6, -0.5, 0.4), DVec3::new(-0.4, -0.3, 0.5)];
    scene.add_balls(centers.clone(), vec![0.3, 0.2], Paint::PerElement(vec![[200, 30, 30], [30, 200, 30]]), Finish::POLISHED, 1.0).unwrap();
    scene.add_balls(centers, vec![0.4, 0.5], ORANGE, Finish::POLISHED, 0.3).unwrap();
    scene
}

#[test]
fn the_bytes_do_not_depend_on_the_threads() {
    let scene = everything();
    for projection in [Projection::Orthographic, PERSPECTIVE] {
        let camera = Camera::fit(box_corners(1.0), View::Isometric, projection, 0.05).unwrap();
        let canvas = Canvas { occlusion: 0.8, ..canvas(230, 170, Samples::Nine) };
        let [one, two, seven] = [1, 2, 7].map(|threads| render(&scene, &camera, &canvas, &Run::with_threads(threads)).unwrap());
        assert_eq!(one.rgba, two.rgba);
        assert_eq!(one.rgba, seven.rgba);
        assert!(one.depth.iter().zip(&seven.depth).all(|(a, b)| a.to_bits() == b.to_bits()));
        assert!(coverage(&one) > 5000.0);
    }
}

#[test]
fn the_order_of_the_layers_does_not_matter() {
    let camera = Camera::fit(box_corners(1.0), View::Isometric, Projection::Orthographic, 0.05).unwrap();
    let mut random = Random(4);
    let meshes: Vec<TriangleMesh> = (0..6).map(|_| soup(&[[random.point(), random.point(), random.point()]])).collect();
    let drawn = |order: &[usize]| {
        let mut scene = Scene::new();
        for &k in order {
            scene
                .add_mesh(&meshes[k], Paint::Uniform([40 * k as u8, 90, 200]), Finish::SATIN, if k == 2 { 1.0 } else { 0.4 }, None)
                .unwrap();
        }
        draw(&scene, &camera, &canvas(200, 150, Samples::Nine)).rgba
    };
    assert_eq!(drawn(&[0, 1, 2, 3, 4, 5]), drawn(&[5, 3, 1, 4, 2, 0]));
}

#[test]
fn points_of_a_sphere_make_a_sphere_without_holes() {
    for projection in [Projection::Orthographic, PERSPECTIVE] {
        for count in [300, 20_000, 300_000] {
            let points = sphere_points(count, 1.0);
            let radius = covering_radius(&points).unwrap();
            let spacing = (4.0 * std::f64::consts::PI / count as f64).sqrt();
            assert!((0.75..1.8).contains(&(radius / spacing)), "{count} points {spacing} apart get discs of radius {radius}");
            let normals = points.iter().map(|p| p.as_vec3().to_array()).collect();
            let mut scene = Scene::new();
            scene.add_points(points, normals, radius, ORANGE, Finish::SATIN).unwrap();
            let camera = Camera::fit(box_corners(1.0), View::Isometric, projection, 0.05).unwrap();
            let picture = draw(&scene, &camera, &canvas(240, 240, Samples::Nine));
            let lens = camera.lens(240, 240);
            let mut inside = 0;
            for (index, &depth) in picture.depth.iter().enumerate() {
                let (x, y) = ((index % 240) as f64 + 0.5, (index / 240) as f64 + 0.5);
                let point = unproject(&camera, &lens, x, y, 1.0);
                let direction = if projection == Projection::Orthographic { camera.forward() } else { (point - camera.eye()).normalize() };
                let away = (point - direction * point.dot(direction)).length();
                // Where discs turn edge-on their rim stands for the surface.
                if away < 0.97 {
                    inside += 1;
                    assert_eq!(picture.rgba[4 * index + 3], 255, "{count} points leave a hole at {x}, {y}");
                    let off = unproject(&camera, &lens, x, y, f64::from(depth)).length() - 1.0;
                    assert!(off > -1e-6 && off < 0.6 * radius * radius + 1e-6, "{count} points: {off} off at {x}, {y}");
                }
            }
            assert!(inside > 5000);
        }
    }
}

#[test]
fn values_take_their_colour_from_the_ramp_after_interpolation() {
    // A ramp that is not monotone: colours interpolated between the vertices would never be green.
    let ramp = Ramp { colours: vec![[255, 0, 0], [0, 255, 0], [0, 0, 255]], low: 0.0, high: 2.0 };
    let mesh = soup(&[[DVec3::new(-1.0, -1.0, 0.0), DVec3::new(1.0, -1.0, 0.0), DVec3::new(0.0, 1.0, 0.0)]]);
    let camera = Camera::fit(mesh.vertices().iter().copied(), View::Top, Projection::Orthographic, 0.0).unwrap();
    let drawn = |paint: Paint| {
        let mut scene = Scene::new();
        scene.add_mesh(&mesh, paint, PLAIN, 1.0, None).unwrap();
        draw(&scene, &camera, &canvas(101, 101, Samples::One)).rgba
    };
    for paint in [Paint::ValuePerVertex(vec![0.0, 2.0, 1.0], ramp.clone()), Paint::ValuePerCorner(vec![[0.0, 2.0, 1.0]], ramp)] {
        let picture = drawn(paint);
        // The middle of the bottom edge has value 1.
        let at = 4 * (99 * 101 + 50);
        let [r, g, b] = [picture[at], picture[at + 1], picture[at + 2]];
        assert!(g > 220 && r < 60 && b < 60, "{r} {g} {b}");
    }
}

#[test]
fn lines_follow_the_sharp_edges_and_nothing_else() {
    let corner = |i: usize| DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64);
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles: Vec<[DVec3; 3]> = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).map(|t| t.map(corner)).collect();
    let cube = soup(&triangles);
    let camera = Camera::fit(cube.vertices().iter().copied(), View::Top, Projection::Orthographic, 0.1).unwrap();
    let mut scene = Scene::new();
    scene.add_mesh(&cube, Paint::Uniform([255, 255, 255]), PLAIN, 1.0, Some(Ink { colour: [0, 0, 0], opacity: 1.0, width: 4.0 })).unwrap();
    let picture = draw(&scene, &camera, &canvas(200, 200, Samples::Nine));
    let dark: usize = picture.rgba.chunks_exact(4).filter(|p| p[3] == 255 && p[0] < 20).count();
    // The square's outline, 160 pixels a side and 4 wide; its diagonal, which is flat, would add some 900.
    assert!((2500..=2620).contains(&dark), "{dark} dark pixels");
    assert!(picture.rgba[4 * (100 * 200 + 100)] > 240);
}

#[test]
fn corners_are_darker_and_free_faces_are_not() {
    // A floor with a wall.
    let floor = [DVec3::new(-1.0, -1.0, 0.0), DVec3::new(1.0, -1.0, 0.0), DVec3::new(1.0, 1.0, 0.0), DVec3::new(-1.0, 1.0, 0.0)];
    let wall = [DVec3::new(-1.0, 1.0, 0.0), DVec3::new(1.0, 1.0, 0.0), DVec3::new(1.0, 1.0, 1.0), DVec3::new(-1.0, 1.0, 1.0)];
    let mesh = soup(&[floor, wall].into_iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect::<Vec<_>>());
    let mut scene = Scene::new();
    scene.add_mesh(&mesh, Paint::Uniform([200, 200, 200]), PLAIN, 1.0, None).unwrap();
    let view = View::Along { direction: DVec3::new(0.0, 1.0, -1.0), up: DVec3::Z };
    let camera = Camera::fit(mesh.vertices().iter().copied(), view, Projection::Orthographic, 0.02).unwrap();
    let lens = camera.lens(300, 300);
    let [open, shaded] = [0.0, 1.0].map(|occlusion| draw(&scene, &camera, &Canvas { occlusion, ..canvas(300, 300, Samples::Nine) }));
    let at = |picture: &Picture, p: DVec3| {
        let [x, y, _] = lens.pixel(p).unwrap();
        i32::from(picture.rgba[4 * (y as usize * 300 + x as usize)])
    };
    let (free, corner) = (DVec3::new(0.0, -0.3, 0.0), DVec3::new(0.0, 0.96, 0.0));
    assert!((at(&open, free) - at(&shaded, free)).abs() <= 2, "{} {}", at(&open, free), at(&shaded, free));
    assert!(at(&open, corner) - at(&shaded, corner) > 12, "{} {}", at(&open, corner), at(&shaded, corner));
}

#[test]
fn what_reaches_behind_the_eye_is_cut_and_not_folded_over() {
    let mut scene = Scene::new();
    // A floor from far before to far behind an eye that looks along y from about y = -3.
    let far = 500.0;
    let floor = [DVec3::new(-far, -far, -0.5), DVec3::new(far, -far, -0.5), DVec3::new(0.0, far, -0.5)];
    scene.add_mesh(&soup(&[floor]), ORANGE, PLAIN, 1.0, Some(Ink { colour: [0; 3], opacity: 1.0, width: 1.0 })).unwrap();
    let camera = Camera::fit(box_corners(1.0), View::Front, PERSPECTIVE, 0.0).unwrap();
    let picture = draw(&scene, &camera, &canvas(100, 100, Samples::One));
    let lens = camera.lens(100, 100);
    for (index, depth) in picture.depth.iter().enumerate() {
        let y = index / 100;
        // The horizon is in the middle of the picture; the far end of the floor is a little below it.
        assert_eq!(depth.is_finite(), y >= 51 || (y == 50 && depth.is_finite()), "row {y}");
        if depth.is_finite() {
            let point = unproject(&camera, &lens, (index % 100) as f64 + 0.5, y as f64 + 0.5, f64::from(*depth));
            assert!((point.z + 0.5).abs() < 1e-4, "{point}");
        }
    }
}

#[test]
fn a_scene_far_from_the_origin_looks_the_same() {
    let mut random = Random(8);
    let triangles: Vec<[DVec3; 3]> = (0..30).map(|_| [random.point(), random.point(), random.point()]).collect();
    let drawn = |shift: DVec3, scale: f64| {
        let moved: Vec<[DVec3; 3]> = triangles.iter().map(|t| t.map(|p| p * scale + shift)).collect();
        let mesh = soup(&moved);
        let mut scene = Scene::new();
        scene.add_mesh(&mesh, ORANGE, Finish::SATIN, 0.4, None).unwrap();
        let camera = Camera::fit(mesh.vertices().iter().copied(), View::Isometric, Projection::Orthographic, 0.05).unwrap();
        draw(&scene, &camera, &canvas(200, 150, Samples::Nine)).rgba
    };
    let here = drawn(DVec3::ZERO, 1.0);
    for (shift, scale) in [(DVec3::new(4e6, -3e6, 1e6), 1.0), (DVec3::ZERO, 1e-9), (DVec3::ZERO, 1e12)] {
        let there = drawn(shift, scale);
        let off = here.iter().zip(&there).filter(|(a, b)| a.abs_diff(**b) > 8).count();
        assert!(off < 60, "{off} bytes differ at {shift}, scale {scale}");
    }
}

#[test]
fn an_empty_scene_is_its_background() {
    let camera = Camera::fit(box_corners(1.0), View::Top, Projection::Orthographic, 0.0).unwrap();
    let white = Canvas { background: Background::Colour([255, 254, 253]), occlusion: 1.0, ..canvas(40, 30, Samples::TwentyFive) };
    let picture = draw(&Scene::new(), &camera, &white);
    assert!(picture.rgba.chunks_exact(4).all(|p| p == [255, 254, 253, 255]));
    assert!(picture.depth.iter().all(|d| d.is_infinite()));
    assert!(draw(&Scene::new(), &camera, &canvas(1, 1, Samples::One)).rgba == [0, 0, 0, 0]);
}

fn sentence<T: std::fmt::Debug>(result: Result<T, Error>) -> String {
    let text = result.unwrap_err().to_string();
    assert!(text.len() > 20 && !text.contains('\n'), "{text}");
    text
}

#[test]
fn what_cannot_be_drawn_is_said_in_a_sentence() {
    let camera = Camera::fit(box_corners(1.0), View::Top, Projection::Orthographic, 0.0).unwrap();
    let run = Run::default();
    for (width, height) in [(0, 10), (10, 0), (20_000, 10), (10, u32::MAX)] {
        assert!(sentence(render(&Scene::new(), &camera, &canvas(width, height, Samples::One), &run)).contains(&width.to_string()));
    }
    let dark = Canvas { occlusion: f64::NAN, ..canvas(10, 10, Samples::One) };
    assert!(sentence(render(&Scene::new(), &camera, &dark, &run)).contains("occlusion"));
    let mut scene = Scene::new();
    let nan = DVec3::new(0.0, f64::NAN, 0.0);
    let up = vec![[0.0, 0.0, 1.0_f32]];
    assert!(sentence(scene.add_points(vec![nan], up.clone(), 1.0, ORANGE, PLAIN)).contains("point 0"));
    assert!(
        sentence(scene.add_points(vec![DVec3::ZERO], vec![[f32::INFINITY, 0.0, 0.0]], 1.0, ORANGE, PLAIN)).contains("normal of point 0")
    );
    assert!(sentence(scene.add_points(vec![DVec3::ZERO; 2], up.clone(), 1.0, ORANGE, PLAIN)).contains("2 points"));
    for radius in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(sentence(scene.add_points(vec![DVec3::ZERO], up.clone(), radius, ORANGE, PLAIN)).contains("radius"));
        assert!(sentence(scene.add_balls(vec![DVec3::ZERO], vec![radius], ORANGE, PLAIN, 1.0)).contains("ball 0"));
    }
    assert!(sentence(scene.add_balls(vec![nan], vec![1.0], ORANGE, PLAIN, 1.0)).contains("centre 0"));
    assert!(sentence(scene.add_balls(vec![DVec3::ZERO], vec![1.0], Paint::PerElement(vec![]), PLAIN, 1.0)).contains("need 1 colours"));
    assert!(sentence(scene.add_balls(vec![DVec3::ZERO], vec![1.0], Paint::PerVertex(vec![[0; 3]]), PLAIN, 1.0)).contains("no vertices"));
    let mesh = soup(&[[DVec3::ZERO, DVec3::X, DVec3::Y]]);
    for opacity in [0.0, 1.5, f64::NAN] {
        assert!(sentence(scene.add_mesh(&mesh, ORANGE, PLAIN, opacity, None)).contains("opacity"));
    }
    assert!(sentence(scene.add_mesh(&mesh, ORANGE, PLAIN, 1.0, Some(Ink { colour: [0; 3], opacity: 1.0, width: 0.0 }))).contains("width"));
    let ramp = |low, high, count| Ramp { colours: vec![[0; 3]; count], low, high };
    for bad in [ramp(1.0, 1.0, 2), ramp(0.0, f64::NAN, 2), ramp(0.0, 1.0, 1)] {
        assert!(sentence(scene.add_mesh(&mesh, Paint::ValuePerElement(vec![0.0], bad), PLAIN, 1.0, None)).contains("ramp"));
    }
    assert!(scene.extent().is_none(), "nothing of what was refused is in the scene");
    assert!(sentence(Camera::fit([nan], View::Top, Projection::Orthographic, 0.0)).contains("finite"));
    assert!(sentence(Camera::fit([], View::Top, Projection::Orthographic, 0.0)).contains("at least one point"));
    assert!(sentence(Camera::fit([DVec3::X], View::Top, Projection::Orthographic, 0.5)).contains("margin"));
    let along = |direction, up| View::Along { direction, up };
    for view in [along(DVec3::ZERO, DVec3::Z), along(DVec3::Z, DVec3::NEG_Z), along(nan, DVec3::Z)] {
        assert!(sentence(Camera::fit([DVec3::X], view, Projection::Orthographic, 0.0)).contains("frame"));
    }
    assert!(sentence(Camera::fit([DVec3::X], View::Top, Projection::Perspective { field_of_view: 180.0 }, 0.0)).contains("field of view"));
    assert!(sentence(View::named("sideways")).contains("sideways"));
    assert!(sentence(covering_radius(&[])).contains("unknown"));
}

#[test]
fn a_cancelled_picture_stops() {
    let cancel = truefield::Cancel::new();
    cancel.cancel();
    let run = Run { cancel: &cancel, ..Run::default() };
    let camera = Camera::fit(box_corners(1.0), View::Top, Projection::Orthographic, 0.0).unwrap();
    assert_eq!(render(&everything(), &camera, &canvas(64, 64, Samples::One), &run).unwrap_err(), Error::Cancelled);
}
