//! Meshes and judges for tests that try to break things.
#![allow(dead_code, reason = "every test file uses its own part")]

pub mod judge;
pub mod shapes;

use truefield::{DVec3, Run, TriangleMesh};

/// What is known of a mesh's inside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Watertight as a set, whatever its topology: inside is where the winding number is 1.
    Solid,
    /// Closed and oriented, but it overlaps itself: winding numbers are whole but not 0 and 1.
    Overlapping,
    /// Anything else.
    Open,
}

/// A mesh of the corpus.
pub struct Nasty {
    pub name: &'static str,
    pub mesh: TriangleMesh,
    pub kind: Kind,
}

/// The corpus: small enough for brute force.
pub fn corpus() -> Vec<Nasty> {
    use shapes::*;
    let mut out = Vec::new();
    let mut add = |name: &'static str, kind: Kind, mesh: TriangleMesh| out.push(Nasty { name, mesh, kind });
    let shift = |by: DVec3| move |v: DVec3| v + by;
    let scale = |by: f64| move |v: DVec3| v * by;
    let both = |a: Soup, b: Soup| [a, b].concat();
    let turn = |v: DVec3| turned(v);

    add("cube", Kind::Solid, welded(&cube()));
    add("cube, loose corners", Kind::Solid, loose(&cube()));
    add("tetrahedron", Kind::Solid, welded(&tetrahedron()));
    add("turned cube", Kind::Solid, welded(&moved(&cube(), turn)));
    add("sphere", Kind::Solid, welded(&icosphere(2)));
    add("torus", Kind::Solid, welded(&torus(16, 9, 1.0, 0.35)));
    add("star", Kind::Solid, welded(&star(6, 0.4, 0.3)));
    add("sharp star", Kind::Solid, welded(&star(17, 0.05, 0.01)));
    add("rod", Kind::Solid, welded(&rod(24, 0.5, 200.0)));
    add("scan", Kind::Solid, welded(&scan(20, 12, 5)));
    add("hollow sphere", Kind::Solid, welded(&both(icosphere(1), flipped(&moved(&icosphere(1), scale(0.8))))));
    add("thin plate", Kind::Solid, welded(&cuboid(DVec3::ZERO, DVec3::new(1.0, 0.7, 1e-9))));
    add("fine detail", Kind::Solid, welded(&both(cube(), moved(&icosphere(1), |v| v * 1e-9 + DVec3::splat(2.0)))));
    add("t-junctions", Kind::Solid, welded(&t_junctions()));

    add("cubes sharing a face", Kind::Solid, welded(&both(cube(), moved(&cube(), shift(DVec3::X)))));
    add("cubes sharing an edge", Kind::Solid, welded(&both(cube(), moved(&cube(), shift(DVec3::X + DVec3::Y)))));
    add("cubes sharing a corner", Kind::Solid, welded(&both(cube(), moved(&cube(), shift(DVec3::ONE)))));
    add("crossing cubes", Kind::Overlapping, welded(&both(cube(), moved(&cube(), |v| turn(v) + 0.3))));
    add("cube twice", Kind::Overlapping, welded(&both(cube(), cube())));
    add("cube, both ways", Kind::Open, welded(&both(cube(), flipped(&cube()))));
    add("inside out", Kind::Open, welded(&flipped(&icosphere(1))));
    let mut some = icosphere(1);
    for t in some.iter_mut().step_by(7) {
        t.swap(0, 1);
    }
    add("some flipped", Kind::Open, welded(&some));
    add("cube without lid", Kind::Open, welded(&cube()[..10]));
    add(
        "sphere with holes",
        Kind::Open,
        welded(&icosphere(2).into_iter().enumerate().filter(|(i, _)| i % 9 != 0).map(|(_, t)| t).collect::<Soup>()),
    );
    add("one triangle", Kind::Open, welded(&[[DVec3::ZERO, DVec3::X, DVec3::Y]]));
    add("flat sheet", Kind::Open, welded(&sheet(6, 6, |u, v| DVec3::new(u, v, 0.25))));
    add("moebius band", Kind::Open, welded(&moebius(24)));
    add("soup", Kind::Open, loose(&random_soup(150, 0.4, 1)));
    add("fine soup", Kind::Open, loose(&random_soup(300, 0.03, 2)));
    add("slivers", Kind::Open, loose(&slivers(200, 3)));
    add("needle", Kind::Open, welded(&[[DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1e-15, 0.0)]]));
    add("same triangle ten times", Kind::Open, welded(&[[DVec3::ZERO, DVec3::X, DVec3::Y]].repeat(10)));
    add(
        "coplanar, overlapping",
        Kind::Open,
        welded(&both(sheet(3, 3, |u, v| DVec3::new(u, v, 0.0)), sheet(2, 2, |u, v| DVec3::new(u + 0.1, v + 0.2, 0.0)))),
    );
    let degenerate: Soup = cube().iter().flat_map(|&[a, b, c]| [[a, a, b], [a, b, c], [c, c, c], [a, b, a * 0.5 + b * 0.5]]).collect();
    add("cube with zero areas", Kind::Open, welded(&degenerate));
    add("trembling sphere", Kind::Open, loose(&trembling(&icosphere(1), 4)));
    add(
        "three on an edge",
        Kind::Open,
        welded(&[[DVec3::ZERO, DVec3::Z, DVec3::X], [DVec3::ZERO, DVec3::Z, DVec3::Y], [DVec3::ZERO, DVec3::Z, -DVec3::ONE]]),
    );

    let far = DVec3::new(1e6, -2e6, 1.5e6);
    add("far cube", Kind::Solid, welded(&moved(&cube(), shift(far))));
    add("far torus", Kind::Solid, welded(&moved(&torus(12, 8, 1.0, 0.4), shift(far))));
    add("far soup", Kind::Open, loose(&moved(&random_soup(100, 0.3, 6), shift(far))));
    add("huge sphere", Kind::Solid, welded(&moved(&icosphere(1), scale(3e30))));
    add("vast sphere", Kind::Solid, welded(&moved(&icosphere(1), scale(1e90))));
    add("tiny sphere", Kind::Solid, welded(&moved(&icosphere(1), scale(3e-30))));
    add("minute star", Kind::Solid, welded(&moved(&star(5, 0.3, 0.2), scale(1e-90))));
    out
}

/// A turn about no axis in particular.
fn turned(v: DVec3) -> DVec3 {
    let (x, y) = (DVec3::new(2.0, -1.0, 2.0) / 3.0, DVec3::new(2.0, 2.0, -1.0) / 3.0);
    x * v.x + y * v.y + x.cross(y) * v.z
}

/// Brute force for many points, on two threads.
pub fn judged<T: Send>(points: &[DVec3], judge: impl Fn(DVec3) -> T + Sync) -> Vec<T> {
    let blocks = Run::with_threads(2).blocks("judge", points.len().div_ceil(256), |block| {
        Ok(points[block * 256..((block + 1) * 256).min(points.len())].iter().map(|&p| judge(p)).collect::<Vec<T>>())
    });
    blocks.expect("a verdict").into_iter().flatten().collect()
}
