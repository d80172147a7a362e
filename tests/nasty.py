"""Meshes with one thing wrong, or nothing wrong but hard: what files in the wild bring. Each says what it is made of.

`NASTY` maps names to makers, `FLAWS` to what a mesh report has to find in them: counts, or None for any number. Where
nothing is listed the mesh is sound, only hard. `BORDERLINE` are too thin for a report to vouch for them.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from truefield import shapes
from truefield.mesh import TriangleMesh


def open_box() -> TriangleMesh:
    """A box without its lid."""
    box = shapes.box((3.0, 2.0, 1.0))
    return TriangleMesh(box.vertices, [t for t in box.triangles.tolist() if min(t) < 4], "open box")


def flipped_triangle() -> TriangleMesh:
    """A torus with one triangle turned over."""
    torus = shapes.torus(3.0, 1.0, (24, 12))
    triangles = torus.triangles.copy()
    triangles[100] = triangles[100, ::-1]
    return TriangleMesh(torus.vertices, triangles, "flipped triangle")


def inside_out() -> TriangleMesh:
    """A closed solid whose every triangle faces inward."""
    brevi = shapes.brevi()
    return TriangleMesh(brevi.vertices, brevi.triangles[:, ::-1], "inside out")


def duplicated() -> TriangleMesh:
    """A sphere with ten of its triangles listed twice."""
    sphere = shapes.sphere(2.0, 3)
    return TriangleMesh(sphere.vertices, np.vstack([sphere.triangles, sphere.triangles[40:50]]), "duplicated")


def collapsed() -> TriangleMesh:
    """A tooth with triangles of no area added: a corner twice, a corner three times, three corners in line."""
    tooth = shapes.one_ended_tooth()
    middle = 0.5 * (tooth.vertices[0] + tooth.vertices[1])
    more = [(0, 0, 1), (3, 3, 3), (0, len(tooth.vertices), 1)]
    return TriangleMesh(np.vstack([tooth.vertices, middle]), np.vstack([tooth.triangles, more]), "collapsed")


def loose_corners() -> TriangleMesh:
    """A sphere as loose triangles whose shared corners differ by a unit in the last place, as bad exporters write."""
    sphere = shapes.sphere(2.0, 3)
    corners = sphere.corners.reshape(-1, 3)
    towards = np.random.default_rng(11).choice([-np.inf, np.inf], corners.shape)
    return TriangleMesh(np.nextafter(corners, towards), np.arange(len(corners)).reshape(-1, 3), "loose corners")


def t_junctions() -> TriangleMesh:
    """A box, one face of which has a corner more in the middle of an edge than its neighbour has."""
    box = shapes.box(2.0)
    vertices = np.vstack([box.vertices, 0.5 * (box.vertices[4] + box.vertices[5])])
    top = [(4, 8, 7), (8, 5, 6), (8, 6, 7)]
    kept = [t for t in box.triangles.tolist() if min(t) < 4]
    return TriangleMesh(vertices, [*kept, *top], "T-junctions")


def crossing_spheres() -> TriangleMesh:
    """Two closed spheres that overlap, in one mesh."""
    sphere = shapes.sphere(1.0, 3)
    return _joined("crossing spheres", sphere, _moved(sphere, (0.9, 0.13, -0.21)))


def boxes_on_an_edge() -> TriangleMesh:
    """Two boxes that share one edge and no more: four triangles meet there."""
    box = shapes.box(1.0)
    return _welded("boxes on an edge", box, _moved(box, (1.0, 1.0, 0.0)))


def boxes_at_a_corner() -> TriangleMesh:
    """Two boxes that share one corner and no more."""
    box = shapes.box(1.0)
    return _welded("boxes at a corner", box, _moved(box, (1.0, 1.0, 1.0)))


def double_sheet() -> TriangleMesh:
    """A square lying on itself, back to back: a solid of no volume."""
    square = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0)]
    return TriangleMesh(square, [(0, 1, 2), (0, 2, 3), (0, 2, 1), (0, 3, 2)], "double sheet")


def soup() -> TriangleMesh:
    """Three hundred triangles that know nothing of each other."""
    generator = np.random.default_rng(5)
    corners = generator.uniform(-1.0, 1.0, (300, 1, 3)) + generator.normal(0.0, 0.2, (300, 3, 3))
    return TriangleMesh(corners.reshape(-1, 3), np.arange(900).reshape(-1, 3), "soup")


def needles() -> TriangleMesh:
    """A closed bar a million times longer than wide, its sides cut in needles."""
    return shapes.cylinder(1e-3, 1e3, 24)


def thin_wall() -> TriangleMesh:
    """A plate a hundred millionth of its length thick."""
    return shapes.plate((1.0, 1.0), 1e-8)


def far_away() -> TriangleMesh:
    """A tooth a million lengths from the origin."""
    return _moved(shapes.one_ended_tooth(), (1e6, -2e6, 3e6), "far away")


def huge() -> TriangleMesh:
    """A star a thousand million million million million units wide."""
    star = shapes.six_pointed_star()
    return TriangleMesh(star.vertices * 1e27, star.triangles, "huge")


def tiny() -> TriangleMesh:
    """A star smaller than an atom, were the unit a metre."""
    star = shapes.six_pointed_star()
    return TriangleMesh(star.vertices * 1e-12, star.triangles, "tiny")


def hollow() -> TriangleMesh:
    """A sound solid: a box with a spherical hollow inside."""
    hole = shapes.sphere(0.8, 3)
    return _joined(
        "hollow", shapes.box(2.0), TriangleMesh(hole.vertices + 1.01, hole.triangles[:, ::-1], "hollow sphere")
    )


def unused_vertices() -> TriangleMesh:
    """A sound box and a stray vertex far off that no triangle uses."""
    box = shapes.box(1.0)
    return TriangleMesh(np.vstack([box.vertices, [(1e9, 0.0, 0.0)]]), box.triangles, "unused vertices")


NASTY: dict[str, Callable[[], TriangleMesh]] = {
    maker.__name__: maker
    for maker in (
        *(open_box, flipped_triangle, inside_out, duplicated, collapsed, loose_corners, t_junctions, crossing_spheres),
        *(boxes_on_an_edge, boxes_at_a_corner, double_sheet, soup, needles, thin_wall, far_away, huge, tiny, hollow),
        unused_vertices,
    )
}


FLAWS: dict[str, dict[str, int | None]] = {
    "open_box": {"open_edges": 4},
    "flipped_triangle": {"inconsistent_edges": 3},
    "inside_out": {"inside_out_shells": 1},
    "duplicated": {"duplicate_triangles": 10, "non_manifold_edges": None},
    "collapsed": {"zero_area_triangles": 3, "open_edges": 2, "non_manifold_edges": 1},
    "loose_corners": {"open_edges": None, "pinched_vertices": None, "self_intersections": None},
    "t_junctions": {"open_edges": 3, "self_intersections": None},
    "crossing_spheres": {"self_intersections": None, "nested_shells": 1},
    "boxes_on_an_edge": {"non_manifold_edges": 1},
    "boxes_at_a_corner": {"pinched_vertices": 1},
    "double_sheet": {"opposite_triangles": 2, "non_manifold_edges": 1},
    "soup": {"open_edges": 900, "self_intersections": None},
    "unused_vertices": {"unreferenced_vertices": 1},
}
BORDERLINE = ("needles", "thin_wall")


def _moved(mesh: TriangleMesh, by: tuple[float, float, float], name: str = "moved") -> TriangleMesh:
    return TriangleMesh(mesh.vertices + np.array(by), mesh.triangles, name)


def _joined(name: str, first: TriangleMesh, second: TriangleMesh) -> TriangleMesh:
    """Both in one mesh, one after the other."""
    vertices = np.vstack([first.vertices, second.vertices])
    return TriangleMesh(vertices, np.vstack([first.triangles, second.triangles + len(first.vertices)]), name)


def _welded(name: str, first: TriangleMesh, second: TriangleMesh) -> TriangleMesh:
    """Both in one mesh, with common vertices made one."""
    both = _joined(name, first, second)
    vertices, which = np.unique(both.vertices, axis=0, return_inverse=True)
    return TriangleMesh(vertices, which.reshape(-1)[both.triangles], name)
