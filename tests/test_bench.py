"""The judge of bench/ must itself be right, and must notice planted faults."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from truefield import shapes

from bench.judge import Judge
from bench.lattice import Lattice
from bench.verdict import verdicts

Floats = NDArray[np.float64]


def _cube_distance(points: Floats) -> Floats:
    """Signed distance to the cube [0, 1]^3, by its formula."""
    outside = np.abs(points - 0.5) - 0.5
    return np.asarray(np.linalg.norm(np.maximum(outside, 0), axis=1) + np.minimum(outside.max(axis=1), 0))


@pytest.fixture
def judge() -> Judge:
    corners = np.array(np.meshgrid([0.0, 1.0], [0.0, 1.0], [0.0, 1.0], indexing="ij")).reshape(3, -1).T
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))]
    return Judge(corners, np.array(triangles))


def test_judge_knows_the_cube(judge: Judge) -> None:
    points = np.random.default_rng(1).uniform(-2, 3, (5000, 3))
    truth = _cube_distance(points)
    np.testing.assert_allclose(judge.distance(points), np.abs(truth), rtol=0, atol=1e-15)
    np.testing.assert_array_equal(judge.inside(points), truth < 0)


def test_judge_culls_nothing_that_is_nearest() -> None:
    mesh = shapes.six_pointed_star()
    vertices, triangles = np.asarray(mesh.vertices), np.asarray(mesh.triangles, dtype=np.int64)
    judge = Judge(vertices, triangles)
    points = np.random.default_rng(2).uniform(vertices.min(0) - 1, vertices.max(0) + 1, (500, 3))
    alone = [Judge(vertices, triangles[i : i + 1]).distance(points) for i in range(len(triangles))]
    np.testing.assert_allclose(judge.distance(points), np.min(alone, axis=0), rtol=0, atol=0)


def test_lattice_reaches_from_end_to_end() -> None:
    lattice = Lattice.over(np.array([[0.0, 0.0, 0.0], [4.0, 2.0, 1.25]]), 9)
    assert (lattice.spacing, lattice.shape) == (0.5, (9, 5, 4))
    assert lattice.first == (0.0, 0.0, -0.125)
    rows = np.arange(len(lattice))
    slabs = np.concatenate([points for _, points in lattice.slabs(20)])
    np.testing.assert_array_equal(slabs, lattice.points(rows))


def test_verdict_finds_planted_faults(judge: Judge) -> None:
    points = np.random.default_rng(3).uniform(-1, 2, (100_000, 3))
    right = _cube_distance(points)
    wrong_sign, wrong_distance, partial = right.copy(), right.copy(), right[:5000].copy()
    flipped = np.flatnonzero(np.abs(right) > 0.1)[:7]
    wrong_sign[flipped] *= -1
    wrong_distance[12_345] += 0.25
    partial[3] += 0.5
    answers = [right, wrong_sign, wrong_distance, partial]
    ours, sign, distance, part = verdicts(answers, judge, points.__getitem__, None)
    assert ours.largest_error < 1e-15
    assert ours.wrong_signs == 0
    assert (sign.wrong_signs, sign.estimated) == (7, False)
    assert distance.largest_error == pytest.approx(0.25)
    assert part.largest_error == pytest.approx(0.5)


def test_verdict_spares_nobody_for_being_first(judge: Judge) -> None:
    points = np.random.default_rng(4).uniform(-1, 2, (50_000, 3))
    right = _cube_distance(points)
    bad = right.copy()
    bad[np.flatnonzero(np.abs(right) > 0.1)[:5]] *= -1
    first, second = verdicts([bad, right], judge, points.__getitem__, None)
    assert (first.wrong_signs, second.wrong_signs) == (5, 0)


def test_verdict_estimates_when_most_signs_differ(judge: Judge) -> None:
    points = np.random.default_rng(5).uniform(-1, 2, (50_000, 3))
    right = _cube_distance(points)
    _, other = verdicts([right, -right], judge, points.__getitem__, None)
    assert other.estimated
    assert other.wrong_signs == pytest.approx(len(points), rel=0.05)


def test_verdict_misses_no_hole_in_a_band(judge: Judge) -> None:
    points = np.random.default_rng(6).uniform(-1, 2, (50_000, 3))
    right = _cube_distance(points)
    band = np.where(np.abs(right) < 0.2, right, np.nan)
    holed = np.where(np.abs(right) < 0.1, right, np.nan)
    whole, hole = verdicts([band, holed], judge, points.__getitem__, 0.2)
    assert whole.largest_error < 1e-15
    assert 0.05 < hole.largest_error <= 0.1
