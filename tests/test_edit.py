"""Editing adaptive fields, levels of detail, samples merged, polygons."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import truefield as tf
from truefield import csg, polygons

RNG = np.random.default_rng(1)


def ball(radius: float = 1.0) -> tf.Shape:
    return csg.sphere(radius)


@pytest.fixture(scope="module")
def field() -> tf.AdaptiveField:
    return tf.adaptive_field(ball(), 0.01)


@pytest.fixture(scope="module")
def points(field: tf.AdaptiveField) -> tf.arguments.Floats:
    low, high = field.extent
    return RNG.uniform(low, high, (20_000, 3))


def test_operations_are_minimum_and_maximum(field: tf.AdaptiveField, points: tf.arguments.Floats) -> None:
    tool = csg.sphere(0.4, center=(0.8, 0.1, 0.0))
    old, new = ball().distance(points), tool.distance(points)
    h = np.maximum(0.2 - np.abs(old - new), 0.0)
    for edited, expected in (
        (field.carve(tool), np.maximum(old, -new)),
        (field.fill(tool), np.minimum(old, new)),
        (field.intersect(tool), np.maximum(old, new)),
        (field.blend(tool, 0.2), np.minimum(old, new) - h * h / 0.8),
    ):
        near = np.abs(expected) < 0.1
        assert np.abs(edited.distance(points) - expected)[near].max() < 0.03
        lower, upper = edited.bounds(points)
        outside = expected > 0.0
        assert np.all(upper[outside] >= expected[outside] - 1e-9)
        assert np.all(lower[~outside] <= expected[~outside] + 1e-9)


def test_a_tool_is_swept_along_its_path(field: tf.AdaptiveField) -> None:
    path = [[-0.2, 0.0, 1.0], [0.1, 0.0, 1.0], [0.1, 0.05, 1.0]]
    cut = field.carve(csg.sphere(0.3), path=path)
    start, end = np.array(path[0]), np.array(path[1])
    along = start + np.linspace(0.0, 1.0, 50)[:, None] * (end - start)
    assert np.all(cut.distance(along) > 0.2)
    assert np.all(field.distance(along) < 0.1)
    with pytest.raises(tf.TruefieldError, match="no points"):
        field.carve(csg.sphere(0.1), path=np.empty((0, 3)))
    with pytest.raises(tf.TruefieldError, match="finite"):
        field.carve(csg.sphere(0.1), path=[[np.nan, 0.0, 0.0]])
    with pytest.raises(tf.TruefieldError, match="radius"):
        field.blend(csg.sphere(0.1), -1.0)


def test_detail_grows_coarser_and_stays_honest(field: tf.AdaptiveField, points: tf.arguments.Floats) -> None:
    truth = ball().distance(points)
    before = field.statistics()["leaves"]
    for coarse in (field.level_of_detail(t) for t in (0.02, 0.1, 1.0)):
        lower, upper = coarse.bounds(points)
        assert np.all((lower <= truth) & (truth <= upper))
        assert coarse.statistics()["leaves"] <= before
        before = coarse.statistics()["leaves"]
    assert field.level_of_detail(depth=3).statistics()["depth"] == 3
    for bad in ({}, {"tolerance": 0.1, "depth": 2}, {"tolerance": -1.0}, {"depth": -1}):
        with pytest.raises(tf.TruefieldError):
            field.level_of_detail(**bad)


def test_samples_become_a_tree() -> None:
    mesh = tf.adaptive_field(ball(), 0.02).surface()
    sampled = tf.Surface(mesh).sample(33)
    merged = tf.adaptive_field(sampled, 0.01)
    assert merged.statistics()["leaves"] < 32**3
    points = RNG.uniform(-0.8, 0.8, (2000, 3)) * mesh.extent[1]
    truth = tf.Surface(mesh).distance(points)
    lower, upper = merged.bounds(points)
    assert np.all((lower <= truth) & (truth <= upper))


def same(a: tf.AdaptiveField, b: tf.AdaptiveField, points: tf.arguments.Floats) -> None:
    assert a.distance(points).tobytes() == b.distance(points).tobytes()
    assert np.array(a.bounds(points)).tobytes() == np.array(b.bounds(points)).tobytes()
    assert a.statistics()["cells"] == b.statistics()["cells"]


def test_saved_is_loaded(field: tf.AdaptiveField, points: tf.arguments.Floats, tmp_path: Path) -> None:
    tool = csg.sphere(0.3, center=(0.9, 0.0, 0.0))
    surface = field.surface()
    flat = tf.adaptive_field(polygons.letter_r(), 0.01, domain=((-0.5, -0.5, 0), (1, 1.5, 1)))
    for number, each in enumerate(
        (
            field,
            field.carve(tool).fill(csg.sphere(0.2, center=(0, 1, 0))),
            tf.adaptive_field(ball(), 0.01, method="cubic"),
            tf.adaptive_field(surface, 0.05, method="exact"),
            tf.adaptive_field(ball(), 0.01, growth=np.inf),
            flat,
        )
    ):
        path = tmp_path / f"{number}.tfield"
        each.save(path)
        loaded = tf.load(path)
        assert isinstance(loaded, tf.AdaptiveField)
        same(each, loaded, points)
        loaded.save(tmp_path / "again.tfield")
        assert (tmp_path / "again.tfield").read_bytes() == path.read_bytes()


def test_the_first_part_of_a_file_is_a_coarser_field(
    field: tf.AdaptiveField, points: tf.arguments.Floats, tmp_path: Path
) -> None:
    path, cut = tmp_path / "field.tfield", tmp_path / "cut.tfield"
    edited = field.carve(csg.sphere(0.3, center=(0.9, 0.0, 0.0)))
    edited.save(path)
    whole = path.read_bytes()
    for depth in (0, 2, 4, 24):
        coarse = tf.load(path, depth=depth)
        assert isinstance(coarse, tf.AdaptiveField)
        same(coarse, edited.level_of_detail(depth=depth), points)
    cut.write_bytes(whole[: len(whole) // 3])
    coarse = tf.load(cut, depth=3)
    assert isinstance(coarse, tf.AdaptiveField)
    same(coarse, edited.level_of_detail(depth=3), points)
    with pytest.raises(tf.FileError, match="truncated"):
        tf.load(cut)
    with pytest.raises(tf.FileError, match="truncated"):
        tf.load(cut, depth=24)
    samples = tmp_path / "samples.tfield"
    tf.Surface(field.surface()).sample(9).save(samples)
    with pytest.raises(tf.FileError, match="no levels"):
        tf.load(samples, depth=2)


def test_damage_is_found_anywhere(tmp_path: Path) -> None:
    path, bad = tmp_path / "field.tfield", tmp_path / "bad.tfield"
    tf.adaptive_field(ball(), 0.1).carve(csg.sphere(0.3, center=(0.9, 0, 0))).save(path)
    whole = path.read_bytes()
    for at in [*range(0, 64, 3), *np.linspace(64, len(whole) - 1, 300).astype(int)]:
        changed = bytearray(whole)
        changed[at] ^= 0x41
        bad.write_bytes(changed)
        with pytest.raises(tf.FileError):
            tf.load(bad)
    for size in np.linspace(0, len(whole) - 1, 60).astype(int):
        bad.write_bytes(whole[:size])
        with pytest.raises(tf.FileError):
            tf.load(bad)
    newer = bytearray(whole)
    newer[8] = 2
    bad.write_bytes(newer)
    with pytest.raises(tf.FileError, match="newer"):
        tf.load(bad)


def test_polygons_are_flat_shapes() -> None:
    letter = polygons.letter_r(2.0)
    low, high = tf.adaptive_field(letter, 0.05).extent
    assert np.isfinite([low, high]).all()
    inside = letter.distance([[0.16, 1.0, 0.0], [0.7, 1.42, 5.0], [1.0, 0.3, -2.0], [0.1, 0.1, 9.0]])
    assert np.array_equal(inside < 0, [True, False, True, True])
    field = tf.adaptive_field(letter, 0.005, domain=((-0.5, -0.5, 0), (2.0, 2.5, 1)))
    assert field.statistics()["cells"] % 4 == 1
    square = polygons.polygon([[0, 0], [1, 0], [1, 1], [0, 1]])
    assert square.distance([[0.5, 0.25, 7.0]])[0] == -0.25
    with pytest.raises(tf.TruefieldError, match="polygon"):
        field.carve(csg.sphere(0.3))
    for loops in ([], [[0, 0], [1, 1]], [[[0, 0, 0]]], "text", [[0, 0], [1, 0], [np.nan, 1]]):
        with pytest.raises(tf.TruefieldError):
            polygons.polygon(loops)  # type: ignore[arg-type]
    with pytest.raises(tf.TruefieldError, match="fill"):
        polygons.polygon([[0, 0], [1, 0], [1, 1]], fill="odd")  # type: ignore[arg-type]


def test_fields_are_tools_and_shapes(field: tf.AdaptiveField, points: tf.arguments.Floats) -> None:
    """A field cuts as the shape it is of, and mixes with shapes."""
    ball_at = csg.sphere(0.4, center=(1, 0, 0))
    tool = tf.adaptive_field(ball_at, 0.01, domain=((-0.6, -1.2, -1.2), (2.2, 1.2, 1.2)))
    carved, expected = field.carve(tool), field.carve(ball_at)
    said, wanted = carved.distance(points), expected.distance(points)
    near_surface = np.abs(wanted) < 0.1
    assert np.abs(said - wanted)[near_surface].max() < 0.04
    low, high = carved.bounds(points)
    truth_low, truth_high = expected.bounds(points)
    assert (low <= truth_high + 1e-9).all()
    assert (truth_low <= high + 1e-9).all()
    near = np.array([[0.6, 0, 0], [1, 0.4, 0], [0.85, 0.1, 0.2]])
    for mixed in (csg.field(tool) - csg.sphere(0.1), tool.fill(csg.sphere(0.1)), csg.box((3, 3, 3)) & csg.field(tool)):
        assert np.allclose(mixed.distance(near), ball_at.distance(near), atol=0.03)
    again = tf.adaptive_field(tool, 0.02)
    assert (np.abs(again.distance(near) - ball_at.distance(near)) < 0.04).all()


def test_edited_fields_know_what_they_are_of(field: tf.AdaptiveField) -> None:
    """Sharp edges are kept after edits, one kind after another."""
    step = csg.box((0.5, 0.5, 0.5), center=(0.8, 0, 0))
    edited = (
        field.carve(step).carve(csg.sphere(0.2, center=(-1, 0, 0))).fill(csg.box((0.4, 0.4, 0.4), center=(0, 1, 0)))
    )
    whole = (ball() - step - csg.sphere(0.2, center=(-1, 0, 0))) | csg.box((0.4, 0.4, 0.4), center=(0, 1, 0))
    shape = edited.intersect(csg.box((4, 4, 1.8))).blend(csg.sphere(0.2, center=(0, -1, 0)), 0.1).shape
    assert shape is not None
    assert edited.shape is not None
    points = np.random.default_rng(4).uniform(-1.3, 1.3, (2000, 3))
    assert np.allclose(edited.shape.distance(points), whole.distance(points), atol=1e-12)
    blended = (whole & csg.box((4, 4, 1.8))).blend(csg.sphere(0.2, center=(0, -1, 0)), 0.1, "polynomial")
    assert np.allclose(shape.distance(points), blended.distance(points), atol=1e-12)
    # Along the inner edge of the step, where an interpolated surface would be round.
    edge = np.abs(np.abs(edited.surface().vertices[:, :2]) - (0.55, 0.25)).max(axis=1)
    assert np.count_nonzero(edge < 1e-6) > 10
    assert tf.adaptive_field(ball(), 0.05).level_of_detail(depth=2).shape is None


@pytest.mark.parametrize(
    ("sentence", "make"),
    [
        ("beyond", lambda: csg.field(tf.adaptive_field(ball(), 0.1, domain=((0, 0, 0), (2, 2, 2))))),
        ("csg.field takes an AdaptiveField", lambda: csg.field(ball())),  # type: ignore[arg-type]
        ("a shape is needed", lambda: tf.adaptive_field(ball(), 0.1).carve("ball")),  # type: ignore[arg-type]
    ],
)
def test_what_is_no_tool_is_refused(sentence: str, make: Callable[[], object]) -> None:
    """One sentence says why."""
    with pytest.raises(tf.TruefieldError, match=sentence):
        make()
