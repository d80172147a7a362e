"""What people do with adaptive fields: rays, surfaces, contact, pictures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import truefield as tf
from commands import Command
from numpy.typing import NDArray
from PIL import Image
from truefield import csg
from truefield.pictures import field_picture


@pytest.fixture(scope="module")
def ball() -> tf.AdaptiveField:
    return tf.adaptive_field(csg.sphere(1.0, center=(0.5, 0.0, 0.0)), tolerance=0.002)


def rays(count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    random = np.random.default_rng(3)
    origins = random.normal(size=(count, 3))
    origins *= 3.0 / np.linalg.norm(origins, axis=1, keepdims=True)
    return origins, (random.normal(size=(count, 3)) * 0.3 - origins) * random.uniform(0.01, 100.0, size=(count, 1))


@pytest.mark.parametrize("method", ["linear", "cubic"])
@pytest.mark.parametrize("distance", [0.0, 0.1, -0.2])
def test_rays_meet_a_ball(ball: tf.AdaptiveField, method: str, distance: float) -> None:
    origins, directions = rays(5000)
    hits = ball.raycast(origins, directions, method=method, distance=distance)  # type: ignore[arg-type]
    unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    start = origins - [0.5, 0.0, 0.0]
    along = np.sum(unit * start, axis=1)
    square = along**2 - np.sum(start**2, axis=1) + (1.0 + distance) ** 2
    clear = np.abs(square) > 0.1
    assert clear.sum() > 3000
    assert np.array_equal(hits.hit[clear], square[clear] > 0.0)
    met = clear & hits.hit
    truth = -along[met] - np.sqrt(square[met])
    assert np.abs(hits.distance[met] - truth).max() < 0.05
    assert np.allclose(origins[met] + unit[met] * hits.distance[met, None], hits.point[met])
    outward = (hits.point[met] - [0.5, 0.0, 0.0]) / (1.0 + distance)
    assert np.sum(outward * hits.normal[met], axis=1).min() > 0.99
    assert np.isnan(hits.point[~hits.hit]).all()
    assert np.isinf(hits.distance[~hits.hit]).all()


def test_hidden_points(ball: tf.AdaptiveField) -> None:
    assert ball.occluded((3.0, 0.0, 0.0), (-1.0, 0.0, 0.0)).tolist() == [True]
    assert ball.occluded((3.0, 0.0, 0.0), (-9.0, 0.0, 0.0), 1.4).tolist() == [False]
    assert ball.occluded((3.0, 0.0, 0.0), [(-9.0, 0.0, 0.0), (0.0, 1.0, 0.0)], 1.6).tolist() == [True, False]


@pytest.mark.parametrize(
    ("origins", "directions", "words"),
    [
        ((0, 0, np.nan), (1, 0, 0), "origin of ray 0"),
        ((0, 0, 0), [(1, 0, 0), (0, 0, 0)], "direction of ray 1"),
        (np.zeros((2, 3)), np.ones((3, 3)), "as many directions"),
        ((0, 0), (1, 0, 0), "shape"),
    ],
)
def test_rays_that_cannot_be(ball: tf.AdaptiveField, origins: object, directions: object, words: str) -> None:
    with pytest.raises(tf.TruefieldError, match=words):
        ball.raycast(origins, directions)  # type: ignore[arg-type]


def test_a_method_that_is_none(ball: tf.AdaptiveField) -> None:
    with pytest.raises(tf.TruefieldError, match="linear"):
        ball.raycast((0, 0, 0), (1, 0, 0), method="quadratic")  # type: ignore[arg-type]


def test_surfaces_are_sound_and_where_they_should_be(ball: tf.AdaptiveField) -> None:
    for distance in (0.0, 0.15, -0.3):
        mesh = ball.surface(distance)
        found = mesh.check()
        assert found.watertight
        assert found.consistent
        assert found.pinched_vertices.count == 0
        assert found.self_intersections.count == 0
        assert found.volume == pytest.approx(4 / 3 * np.pi * (1 + distance) ** 3, rel=0.02)
        away = np.linalg.norm(mesh.vertices - [0.5, 0.0, 0.0], axis=1) - 1.0 - distance
        assert np.abs(away).max() < 0.002 + 0.05 * abs(distance)


def test_sharp_edges_are_kept_where_the_shape_is_at_hand() -> None:
    shape = csg.box((1.0, 0.8, 0.6))
    mesh = tf.adaptive_field(shape, 0.01, growth=np.inf).surface(shape=shape)
    assert mesh.check().volume == pytest.approx(0.48, rel=1e-6)
    assert np.abs(shape.distance(mesh.vertices)).max() < 1e-6
    corners = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.4, 0.4) for z in (-0.3, 0.3)])
    apart = np.linalg.norm(mesh.vertices[:, None] - corners, axis=2).min(axis=0)
    assert apart.max() < 1e-6


def test_no_surface_is_said() -> None:
    field = tf.adaptive_field(csg.sphere(1.0), 0.1)
    with pytest.raises(tf.TruefieldError, match="no surface is at distance"):
        field.surface(-3.0)
    with pytest.raises(MemoryError):
        field.surface(memory=100)


def test_what_would_leave_the_domain_is_refused_and_what_the_domain_cuts_is_not(tmp_path: Path) -> None:
    field = tf.adaptive_field(csg.sphere(1.0), 0.02)
    field.save(tmp_path / "a.tfield")
    loaded = tf.load(tmp_path / "a.tfield")
    assert isinstance(loaded, tf.AdaptiveField)
    for one in (field, field.level_of_detail(depth=4), loaded):
        assert one.surface(0.2).check().watertight
        # The domain ends 0.25 from the ball.
        with pytest.raises(tf.TruefieldError, match="domain"):
            one.surface(0.5)
        with pytest.raises(tf.TruefieldError, match="domain"):
            one.render(distance=0.5, size=(64, 64))
        with pytest.raises(tf.TruefieldError, match="domain"):
            one.raycast((3, 0, 0), (-1, 0, 0), distance=100.0)
    wide = tf.adaptive_field(csg.sphere(1.0), 0.02, domain=((-2, -2, -2), (2, 2, 2)))
    assert np.abs(np.linalg.norm(wide.surface(0.5).vertices, axis=1) - 1.5).max() < 0.05
    half = tf.adaptive_field(csg.sphere(1.0), 0.02, domain=((0, -1, -1), (2, 1, 1)))
    assert half.surface(0.2).check().watertight
    plane = tf.adaptive_field(tf.polygons.letter_r(), 0.01)
    assert plane.surface(0.05).check().watertight
    with pytest.raises(tf.TruefieldError, match="domain"):
        plane.surface(0.5)


def test_the_nearest_points_lie_on_the_surface(ball: tf.AdaptiveField) -> None:
    low, high = ball.extent
    points = np.random.default_rng(5).uniform(low, high, (3000, 3))
    points[0] = (0.5, 0.0, 0.0)
    found = ball.nearest(points)
    assert np.array_equal(found.distance, ball.distance(points))
    assert np.array_equal(found.normal, ball.gradient(points))
    assert (found.triangle == -1).all()
    assert (found.feature == 0).all()
    away = np.linalg.norm(points - [0.5, 0.0, 0.0], axis=1) - 1.0
    assert np.abs(np.linalg.norm(found.point - [0.5, 0.0, 0.0], axis=1) - 1.0).max() < 0.005
    assert (np.linalg.norm(points - found.point, axis=1) - np.abs(away)).max() < 0.01
    beyond = ball.nearest([(9.0, 0.0, 0.0)])
    assert np.isnan(beyond.distance).all()
    assert np.isnan(beyond.point).all()
    assert beyond.triangle[0] == -1


def test_exact_fields_name_the_nearest_triangle() -> None:
    part = tf.shapes.six_pointed_star()
    field, surface = tf.adaptive_field(part, method="exact"), tf.Surface(part)
    points = np.random.default_rng(6).uniform(*field.extent, (2000, 3))
    found, truth = field.nearest(points), surface.nearest(points)
    for name in ("distance", "point", "triangle", "feature"):
        np.testing.assert_array_equal(getattr(found, name), getattr(truth, name))
    # An edit may have taken the nearest place: then it is looked for.
    low, high = part.extent
    carved = field.carve(csg.box(0.6 * (high - low), center=high))
    known = carved.nearest(points)
    met = np.isfinite(known.point).all(axis=1)
    assert met.mean() > 0.99
    below, above = carved.bounds(known.point[met])
    assert np.minimum(np.abs(below), np.abs(above)).max() < 0.01
    assert (known.triangle == -1).all()


def test_collisions_hold_the_truth() -> None:
    a = csg.sphere(1.0)
    apart = tf.collide(a, csg.sphere(0.5, center=(2.0, 0.0, 0.0)))
    assert apart.state == "separated"
    assert apart.lower <= 0.5 <= apart.upper
    assert apart.upper - apart.lower < 0.01
    assert np.linalg.norm(apart.point_a) == pytest.approx(1.0, abs=1e-4)
    assert np.linalg.norm(apart.point_b - [2.0, 0.0, 0.0]) == pytest.approx(0.5, abs=1e-4)
    inside = tf.collide(tf.shapes.housing(), csg.sphere(500.0))
    assert inside.state == "penetrating"
    assert inside.upper < 0.0
    field = tf.adaptive_field(csg.box((1.0, 1.0, 1.0)), 0.01)
    stored = tf.collide(field, csg.sphere(0.25, center=(0.0, 0.0, 1.0)), tolerance=0.05)
    assert stored.lower <= 0.25 <= stored.upper
    with pytest.raises(tf.TruefieldError, match="tolerance"):
        tf.collide(a, a, tolerance=-1.0)


def test_pictures_by_rays(ball: tf.AdaptiveField, tmp_path: Path) -> None:
    whole = field_picture(ball, tmp_path / "ball.png", size=(96, 64), view="front")
    assert Image.open(tmp_path / "ball.png").size == (96, 64)
    dark = np.asarray(whole).min(axis=2) < 250
    # A disc in the middle.
    assert dark[32, 48]
    assert not dark[2, 2]
    wide, high = dark.any(axis=0).sum(), dark.any(axis=1).sum()
    assert abs(int(wide) - int(high)) <= 2
    clear = np.asarray(ball.render(size=(96, 64), background=None, samples=1))
    assert set(np.unique(clear[..., 3])) == {0, 255}
    same = [np.asarray(ball.render(size=(96, 64), threads=threads)) for threads in (1, 2)]
    assert np.array_equal(same[0], same[1])
    with pytest.raises(tf.TruefieldError, match="samples"):
        ball.render(size=(96, 64), samples=4)


def test_the_command_refuses_what_it_cannot_draw(truefield: Command, tmp_path: Path) -> None:
    there = ("render", tmp_path / "no.tfield", "-o")
    assert "--view" in truefield.refused(*there, tmp_path / "a.png", "--view", "1,2")
    assert "--size" in truefield.refused(*there, tmp_path / "a.png", "--size", "wide")
    assert "--samples" in truefield.refused(*there, tmp_path / "a.png", "--samples", "4")
    assert "PNG" in truefield.refused(*there, tmp_path / "a.jpg")
    assert "no.tfield" in truefield.refused(*there, tmp_path / "a.png")
