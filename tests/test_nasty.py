"""Meshes with flaws: what is wrong is said, and every distance and decided side is still right."""

from __future__ import annotations

from dataclasses import fields

import brute
import numpy as np
import pytest
import truefield as tf
from nasty import BORDERLINE, FLAWS, NASTY
from solids import cube
from truefield.check import Finding


def _probes(mesh: tf.TriangleMesh, count: int) -> brute.Array:
    """Points around, in, and within a millionth of the mesh."""
    generator = np.random.default_rng(23)
    lower, upper = mesh.extent
    diagonal = float(np.linalg.norm(upper - lower))
    margin = 0.3 * (upper - lower) + 0.05 * diagonal
    around = generator.uniform(lower - margin, upper + margin, (count, 3))
    within = generator.uniform(lower, upper, (count, 3))
    corners = mesh.corners[generator.integers(len(mesh.triangles), size=count)]
    weights = generator.dirichlet(np.ones(3), count)
    close = (corners * weights[:, :, None]).sum(axis=1) + generator.normal(0.0, 1e-6 * diagonal, (count, 3))
    return np.concatenate([around, within, close])


def _diagonal(mesh: tf.TriangleMesh) -> float:
    lower, upper = mesh.extent
    return float(np.linalg.norm(upper - lower))


@pytest.mark.parametrize("name", [name for name in NASTY if name not in BORDERLINE])
def test_the_report_finds_each_flaw_and_no_other(name: str) -> None:
    check = NASTY[name]().check()
    found = {field.name: getattr(check, field.name) for field in fields(check)}
    counts = {key: value.count for key, value in found.items() if isinstance(value, Finding) and value.count}
    expected = FLAWS.get(name, {})
    assert counts.keys() == expected.keys()
    for key, count in expected.items():
        assert count is None or counts[key] == count
    assert len(check.problems()) == len(expected)


@pytest.mark.parametrize("name", NASTY)
def test_distances_equal_brute_force(name: str) -> None:
    mesh = NASTY[name]()
    points = _probes(mesh, 150)
    truth = brute.distances(mesh, points)
    surface = tf.Surface(mesh)
    allowed = 1e-12 * _diagonal(mesh)
    nearest = surface.nearest(points)
    assert np.abs(np.abs(surface.distance(points)) - truth).max() <= allowed
    # A place, unlike a distance, can only be as fine as the coordinates themselves.
    allowed += 2.0 * float(np.spacing(np.abs(mesh.corners).max()))
    assert np.abs(np.linalg.norm(nearest.point - points, axis=1) - truth).max() <= allowed
    own = brute.to_triangles(nearest.point, mesh.corners[nearest.triangle])
    assert own.max() <= allowed


@pytest.mark.parametrize("name", NASTY)
def test_complete_field_equals_brute_force(name: str) -> None:
    mesh = NASTY[name]()
    lower, upper = mesh.extent
    points = np.random.default_rng(29).uniform(lower, upper, (400, 3))
    field = tf.complete_field(mesh, resolution=12)
    truth = brute.distances(mesh, points)
    low, high = field.bounds(points)
    allowed = 1e-12 * _diagonal(mesh)
    assert np.abs(np.abs(field.distance(points)) - truth).max() <= allowed
    assert np.all(low <= high)
    assert np.all(np.maximum(np.abs(low), np.abs(high)) >= truth - allowed)


@pytest.mark.parametrize("name", NASTY)
def test_decided_sides_follow_the_winding_number(name: str) -> None:
    mesh = NASTY[name]()
    points = _probes(mesh, 150)
    low, high = tf.Surface(mesh).bounds(points)
    decided = ~((low < 0.0) & (high > 0.0))
    winding = np.abs(brute.winding_numbers(mesh, points))
    # Beside the threshold, and on the surface, rounding decides for the judge too.
    clear = (np.abs(winding - 0.5) > 1e-3) & (brute.distances(mesh, points) > 1e-12 * _diagonal(mesh))
    judged = decided & clear
    assert np.array_equal(high[judged] < 0.0, winding[judged] > 0.5)
    if name not in ("double_sheet", *BORDERLINE):
        assert judged.mean() > 0.95


def test_points_too_far_to_square_are_refused() -> None:
    surface = tf.Surface(cube())
    assert surface.distance([[1e150, 0, 0]])[0] == pytest.approx(1e150)
    for ask in (surface.distance, surface.bounds):
        with pytest.raises(tf.TruefieldError, match=r"point 1 is .* give coordinates of 1e150 at most"):
            ask(np.array([[0, 0, 0], [0, -1e155, 0]]))
