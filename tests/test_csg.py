"""Solids put together through the Python API."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
import truefield as tf
from numpy.typing import NDArray
from truefield import csg

Floats = NDArray[np.float64]


def points(count: int = 2000, size: float = 4.0, seed: int = 1) -> Floats:
    return np.random.default_rng(seed).uniform(-size, size, (count, 3))


def test_the_sentence_of_the_readme() -> None:
    bowl = csg.box((4, 4, 1)) - csg.sphere(1.2).translate((0, 0, 0.5))
    assert repr(bowl) == "csg.box((4, 4, 1)) - csg.sphere(1.2).translate((0, 0, 0.5))"
    lower, upper = bowl.bounds(points())
    value = bowl.distance(points())
    assert np.all((lower <= value) & (value <= upper))
    # Over the bowl's middle, and inside of the bottom under it.
    assert bowl.distance([[0, 0, 0.5], [0, 0, 3.0], [1.9, 0.0, 0.0]]) == pytest.approx([1.2, 2.5, -0.1])
    assert bowl.extent is not None
    assert np.array_equal(bowl.extent, [[-2, -2, -0.5], [2, 2, 0.5]])


def test_operators_are_the_least_and_the_greatest() -> None:
    a, b = csg.sphere(1.5), csg.box((2, 3, 4), center=(1, 0, 0))
    x, y, p = a.distance(points()), b.distance(points()), points()
    for shape, expected in [
        (a | b, np.minimum(x, y)),
        (a + b, np.minimum(x, y)),
        (csg.union(a, b), np.minimum(x, y)),
        (a & b, np.maximum(x, y)),
        (csg.intersection([a, b]), np.maximum(x, y)),
        (a - b, np.maximum(x, -y)),
        (~a, -x),
        (-a, -x),
        (a.offset(0.25), x - 0.25),
        (a.shell(0.25), np.maximum(x, -x - 0.25)),
    ]:
        assert np.array_equal(shape.distance(p), expected), repr(shape)


def test_primitives_measure_what_they_say() -> None:
    for shape, where, distance in [
        (csg.sphere(2, center=(1, 0, 0)), (4, 0, 0), 1.0),
        (csg.box((2, 2, 2)), (2, 2, 1), math.sqrt(2)),
        (csg.rounded_box((2, 2, 2), 0.5), (2, 2, 0), math.hypot(1.5, 1.5) - 0.5),
        (csg.cylinder(1, 4), (0, 0, 3), 1.0),
        (csg.cylinder(1, 4, axis="x"), (3, 0, 0), 1.0),
        (csg.cylinder(1, 4, axis=(0, 1, 0)), (0, 0, 3), 2.0),
        (csg.cone(1, 2), (0, 0, 2), 1.0),
        (csg.cone(1, 2, top=1), (3, 0, 0), 2.0),
        (csg.cone(1, 2, axis=(0, 0, -1)), (0, 0, -2), 1.0),
        (csg.capsule((0, 0, 0), (1, 0, 0), 0.5), (2, 0, 0), 0.5),
        (csg.torus(2, 0.5), (0.5, 0, 0), 1.0),
        (csg.torus(2, 0.5, axis="y", center=(1, 0, 0)), (1, 0, 2), -0.5),
        (csg.half_space((0, 0, 1), (0, 0, 2)), (5, 5, 3), 2.0),
        (csg.ellipsoid((3, 2, 1)), (0, 0, 4), 3.0),
        (csg.menger_sponge(2), (0.47, 0.47, 0.7), 0.2),
        (csg.menger_sponge(3, size=3), (1.4, 1.4, 3), 1.5),
        (csg.molecule([(0, 0, 0)], 1.5), (4, 0, 0), 2.5),
        (csg.sweep(csg.sphere(0.5), [(0, 0, 0), (3, 0, 0)]), (1, 2, 0), 1.5),
        (csg.sphere(1).scale(2).translate((1, 0, 0)), (4, 0, 0), 1.0),
        (csg.box((2, 2, 8)).rotate("x", 90), (0, 5, 0), 1.0),
    ]:
        assert shape.distance([where]) == pytest.approx([distance]), repr(shape)
        lower, upper = shape.bounds([where])
        assert lower == pytest.approx([distance])
        assert upper == pytest.approx([distance])
        step = 1e-6
        along = shape.gradient([where])[0]
        assert shape.distance([np.asarray(where) + step * along])[0] == pytest.approx(distance + step, abs=1e-9)


def test_meshes_mix_in() -> None:
    part = tf.shapes.housing()
    low, high = part.extent
    middle = (low + high) / 2
    hole = csg.cylinder(3.0, 1000.0, center=middle)
    cut = csg.mesh(part) - hole
    p = np.random.default_rng(3).uniform(low - 5, high + 5, (500, 3))
    expected = np.maximum(tf.Surface(part).distance(p), -hole.distance(p))
    assert np.array_equal(cut.distance(p), expected)
    assert np.array_equal((part - hole).distance(p), expected)
    assert np.array_equal((tf.Surface(part) & ~hole).distance(p), expected)
    assert np.array_equal((hole - part).distance(p), np.maximum(hole.distance(p), -tf.Surface(part).distance(p)))


def test_one_by_one_is_all_at_once() -> None:
    centers = np.random.default_rng(5).uniform(-3, 3, (300, 3))
    balls = [csg.sphere(0.4, center=tuple(c)) for c in centers]
    one_by_one = balls[0]
    cut = csg.box((6, 6, 6))
    for ball in balls[1:]:
        one_by_one = one_by_one | ball
        cut = cut - ball
    p = points(500)
    expected = np.min(np.linalg.norm(p[:, None] - centers, axis=2) - 0.4, axis=1)
    assert one_by_one.distance(p) == pytest.approx(expected, abs=1e-14)
    assert np.array_equal(one_by_one.distance(p), csg.union(balls).distance(p))
    assert np.array_equal(cut.distance(p), (csg.box((6, 6, 6)) - csg.union(balls[1:])).distance(p))
    assert repr(one_by_one) == "csg.sphere(0.4, center=" + repr(balls[0]).split("center=")[1] + " | ... (300 shapes)"


def test_sweeps_follow_points_and_poses() -> None:
    path = np.array([(0, 0, 0), (2, 0, 0), (2, 2, 0)], dtype=float)
    ball = csg.sweep(csg.sphere(0.3).translate((0, 0, 1)), path)
    capsules = csg.capsule((0, 0, 1), (2, 0, 1), 0.3) | csg.capsule((2, 0, 1), (2, 2, 1), 0.3)
    assert np.array_equal(ball.distance(points()), capsules.distance(points()))
    poses = np.tile(np.eye(4), (3, 1, 1))
    poses[:, :3, 3] = path
    chisel = csg.box((0.4, 0.2, 1)).rotate((1, 1, 0), 30)
    by_points, by_poses = csg.sweep(chisel, path), csg.sweep(chisel, poses)
    assert np.array_equal(by_points.distance(points(300)), by_poses.distance(points(300)))
    assert repr(by_poses) == "csg.sweep(csg.box((0.4, 0.2, 1)).rotate((1, 1, 0), 30), <3 poses>)"


def test_blends_fill_the_edge() -> None:
    ground, post = csg.half_space((0, 0, 0), (0, 0, 1)), csg.half_space((0, 0, 0), (1, 0, 0))
    # An arc of the radius between planes at right angles: its middle is on the diagonal.
    arc = 1 - math.sqrt(0.5)
    assert ground.blend(post, 1.0).distance([(arc, 0, arc)]) == pytest.approx([0.0], abs=1e-12)
    assert ground.blend(post, 1.0, kind="polynomial").distance([(0.25, 0, 0.25)]) == pytest.approx([0.0], abs=1e-12)
    assert ground.blend(post, 1.0).distance([(0.2, 0, 2)]) == pytest.approx([0.2])


def test_texts_read_as_they_were_written() -> None:
    a, b = csg.sphere(1), csg.box((1, 2, 3), center=(0, 0, 1))
    assert repr((a | b) - a) == "(csg.sphere(1) | csg.box((1, 2, 3), center=(0, 0, 1))) - csg.sphere(1)"
    assert repr((a & b).translate((0, 0, 1))).startswith("(csg.sphere(1) & ")
    assert repr(~a) == "~csg.sphere(1)"
    assert repr(csg.cylinder(1, 2, axis="x").rotate("z", 45)) == "csg.cylinder(1, 2, axis='x').rotate('z', 45)"
    assert repr(a.blend(b, 0.5)) == "csg.sphere(1).blend(csg.box((1, 2, 3), center=(0, 0, 1)), 0.5)"
    assert repr(csg.mesh(tf.shapes.housing())) == "csg.mesh('housing')"


BAD: list[tuple[str, Callable[[], object]]] = [
    ("radius is -1", lambda: csg.sphere(-1)),
    ("radius is nan", lambda: csg.sphere(math.nan)),
    ("three finite numbers", lambda: csg.sphere(1, center=(0, 0))),
    ("three finite numbers", lambda: csg.box((1, 2, math.inf))),
    ("an edge of the size is 0", lambda: csg.box((1, 0, 1))),
    ("half the shortest edge", lambda: csg.rounded_box((1, 1, 1), 0.6)),
    ("height is 0", lambda: csg.cylinder(1, 0)),
    ("axis is 'w'", lambda: csg.cylinder(1, 1, axis="w")),  # type: ignore[arg-type]
    ("direction that is not zero", lambda: csg.cylinder(1, 1, axis=(0, 0, 0))),
    ("larger radius", lambda: csg.cone(0, 1)),
    ("less than major", lambda: csg.torus(1, 2)),
    ("normal is", lambda: csg.half_space((0, 0, 0), (0, 0, 0))),
    ("a half axis", lambda: csg.ellipsoid((1, 1, -1))),
    ("level is", lambda: csg.menger_sponge(-1)),
    ("level is", lambda: csg.menger_sponge(99)),
    ("at least one center", lambda: csg.molecule(np.zeros((0, 3)), [])),
    ("do not fit", lambda: csg.molecule([(0, 0, 0)], [1, 2])),
    ("radius 0 is -1", lambda: csg.molecule([(0, 0, 0)], [-1])),
    ("sharpness", lambda: csg.molecule([(0, 0, 0)], [1], sharpness=0)),
    ("no points", lambda: csg.sweep(csg.sphere(1), [])),
    ("no array of numbers", lambda: csg.sweep(csg.sphere(1), [(0, 0, 0), (1, 0)])),
    ("not finite", lambda: csg.sweep(csg.sphere(1), [(0, 0, math.nan)])),
    ("not convex", lambda: csg.sweep(csg.torus(1, 0.2), [(0, 0, 0)])),
    (
        "does not only turn and move",
        lambda: csg.sweep(csg.box((1, 1, 1)), 2 * np.eye(4)[None] - np.diag([0, 0, 0, 1.0])),
    ),
    ("last row", lambda: csg.sweep(csg.box((1, 1, 1)), np.ones((2, 4, 4)))),
    ("no shapes", csg.union),
    ("not float", lambda: csg.union(csg.sphere(1), 1.0)),  # type: ignore[arg-type]
    ("boxes lie apart", lambda: csg.sphere(1) & csg.sphere(1, center=(9, 0, 0))),
    ("leaves nothing", lambda: csg.sphere(1).offset(-1)),
    ("offset is NaN", lambda: csg.sphere(1).offset(math.nan)),
    ("thickness is 0", lambda: csg.sphere(1).shell(0)),
    ("factor is 0", lambda: csg.sphere(1).scale(0)),
    ("angle is inf", lambda: csg.sphere(1).rotate("x", math.inf)),
    ('kind is "sharp"', lambda: csg.sphere(1).blend(csg.box((1, 1, 1)), 1, kind="sharp")),  # type: ignore[arg-type]
    ("TriangleMesh or a Surface", lambda: csg.mesh("part.stl")),  # type: ignore[arg-type]
    ("shape", lambda: csg.sphere(1).distance([(1, 2)])),
    ("finite", lambda: csg.sphere(1).distance([(1, 2, math.nan)])),
]


@pytest.mark.parametrize(("sentence", "make"), BAD)
def test_bad_input_is_refused_in_a_sentence(sentence: str, make: Callable[[], object]) -> None:
    with pytest.raises(tf.TruefieldError, match=sentence):
        make()


def test_numbers_are_no_shapes() -> None:
    with pytest.raises(TypeError):
        csg.sphere(1) | 3
    with pytest.raises(TypeError):
        3 - csg.sphere(1)
