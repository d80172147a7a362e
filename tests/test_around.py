"""The largest balls around points, against trying every ball."""

from __future__ import annotations

import math

import numpy as np
import truefield as tf
from numpy.typing import NDArray
from truefield.around import largest_around

Floats = NDArray[np.float64]


def tried(points: Floats, normals: Floats, centers: Floats, radii: Floats, share: float) -> Floats:
    way = points[:, None] - centers[None]
    close = np.linalg.norm(way, axis=2) <= (1.0 + share) * radii
    close &= np.einsum("ijk,ik->ij", way, normals) > 0.0
    found: Floats = np.where(close, 2.0 * radii, 0.0).max(axis=1)
    return found


def test_the_largest_ball_is_found_among_balls_of_all_sizes() -> None:
    rng = np.random.default_rng(5)
    for scale, away in ((1.0, 0.0), (1e-6, 3.0), (1e5, -1e7)):
        points = scale * rng.uniform(-1.0, 1.0, (400, 3)) + away
        centers = scale * rng.uniform(-1.0, 1.0, (700, 3)) + away
        normals = rng.normal(size=(400, 3))
        radii = scale * 10.0 ** rng.uniform(-4.0, -0.3, 700)
        found = largest_around(points, normals, centers, radii)
        # Balls that are nearly the same stand for each other: no more than their difference may be missed.
        corner = math.sqrt(3.0) - 1.0
        assert (found <= tried(points, normals, centers, radii, corner)).all()
        assert (found >= tried(points, normals, centers, radii, corner - 0.18)).all()
        assert (found > 0.0).mean() > 0.3


def test_without_balls_or_points_nothing_fits() -> None:
    none, some = np.zeros((0, 3)), np.zeros((2, 3))
    assert largest_around(none, none, some, np.ones(2)).shape == (0,)
    assert (largest_around(some, some + 1.0, none, np.zeros(0)) == 0.0).all()
    assert (largest_around(some, some + 1.0, some, np.array([0.0, np.nan])) == 0.0).all()


def test_a_block_is_shown_as_thick_as_it_is_up_to_its_corners() -> None:
    report = tf.thickness(tf.shapes.box((40.0, 30.0, 20.0)), tolerance=0.05, spacing=1.0)
    assert (report.samples.kind == 1).mean() > 0.2
    shown = np.asarray(report.chart().scalars["thickness"], dtype=np.float64)
    assert shown.max() <= 20.0 + 1e-9
    assert np.percentile(shown, 2) > 19.0
