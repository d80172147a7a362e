"""Shapes are what they claim: manifold, outward, of the stated size, count, volume and greatest depth."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
import trimesh
from truefield import shapes
from truefield.errors import TruefieldError
from truefield.mesh import TriangleMesh


def _solid(mesh: TriangleMesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)


def _size(mesh: TriangleMesh) -> list[float]:
    lower, upper = mesh.extent
    return [float(length) for length in upper - lower]


@pytest.mark.parametrize("name", shapes.names())
def test_every_shape_is_one_closed_outward_solid_without_flat_triangles(name: str) -> None:
    mesh = shapes.make(name)
    solid = _solid(mesh)
    assert solid.is_watertight
    assert solid.is_winding_consistent
    assert solid.volume > 0.0
    assert len(np.unique(mesh.vertices, axis=0)) == len(mesh.vertices)
    a, b, c = np.moveaxis(mesh.vertices[mesh.triangles], 1, 0)
    longest = np.max([np.linalg.norm(a - b, axis=1), np.linalg.norm(b - c, axis=1), np.linalg.norm(c - a, axis=1)])
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    assert area.min() > 1e-8 * longest**2


@pytest.mark.parametrize("name", shapes.names())
def test_a_shape_is_the_same_every_time(name: str) -> None:
    first, second = shapes.make(name), shapes.make(name)
    assert first.vertices.tobytes() == second.vertices.tobytes()
    assert first.triangles.tobytes() == second.triangles.tobytes()


@pytest.mark.parametrize(
    ("name", "count", "size", "volume"),
    [
        ("cube", 12, (5, 5, 5), 125.0),
        ("tetrahedron", 4, (1, 1, 1), 1 / 6),
        ("one_ended_tooth", 16, (1, 2, 2), 2.575),
        ("two_ended_tooth", 20, (1, 2, 3.85), 4.85),
        ("six_pointed_star", 48, (1, 3, 2 * math.sqrt(3)), 3 * math.sqrt(3)),
    ],
)
def test_simple_models_have_the_papers_counts_and_boxes(
    name: str, count: int, size: tuple[float, ...], volume: float
) -> None:
    mesh = shapes.make(name)
    assert len(mesh.triangles) == count
    assert _size(mesh) == pytest.approx(size, abs=1e-12)
    assert _solid(mesh).volume == pytest.approx(volume, rel=1e-12)


def test_analytic_volumes_are_exact() -> None:
    n = 37
    prism = 0.5 * n * math.sin(2 * math.pi / n) * 3.0**2 * 4.0
    assert _solid(shapes.cylinder(3.0, 4.0, n)).volume == pytest.approx(prism, rel=1e-11)
    assert _solid(shapes.box((2.0, 3.0, 5.0))).volume == pytest.approx(30.0, rel=1e-14)
    assert _solid(shapes.plate((7.0, 3.0), 0.25)).volume == pytest.approx(5.25, rel=1e-14)
    assert _solid(shapes.wedge((4.0, 2.0, 1.0))).volume == pytest.approx(4.0, rel=1e-14)


def test_curved_solids_approach_the_smooth_ones() -> None:
    errors = [4 / 3 * math.pi - _solid(shapes.sphere(1.0, level)).volume for level in (2, 3, 4, 5)]
    assert all(3.0 < coarse / fine < 5.0 for coarse, fine in itertools.pairwise(errors))
    smooth = 2 * math.pi**2 * 3.0
    assert 0.0 < smooth - _solid(shapes.torus(3.0, 1.0, (192, 96))).volume < 2e-3 * smooth
    assert _solid(shapes.torus()).euler_number == 0


def test_housing_is_a_casting_of_the_stated_size() -> None:
    mesh = shapes.housing()
    assert _size(mesh) == [160.0, 110.0, 80.0]
    assert 10_000 < len(mesh.triangles) < 30_000
    # A float32 file must give the same mesh back.
    assert np.array_equal(mesh.vertices, mesh.vertices.astype(np.float32))


@pytest.mark.parametrize(
    ("name", "options", "words"),
    [
        ("gearbox", {}, "no shape called 'gearbox'"),
        ("cube", {"edge": 3.0}, "edge"),
        ("box", {"size": (1.0, -1.0, 1.0)}, "positive"),
        ("box", {"size": (1.0, 1.0)}, "three"),
        ("plate", {"size": (1.0,)}, "two numbers"),
        ("cylinder", {"segments": 2}, "at least 3"),
        ("torus", {"tube_radius": 4.0}, "thinner"),
        ("sphere", {"subdivisions": 11}, "0..10"),
        ("sphere", {"radius": math.nan}, "finite"),
        ("tetrahedron", {"size": 0.0}, "positive"),
    ],
)
def test_impossible_shapes_are_refused_in_one_sentence(name: str, options: dict[str, object], words: str) -> None:
    with pytest.raises(TruefieldError, match=words):
        shapes.make(name, **options)
