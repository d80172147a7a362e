"""Adaptive fields in Python: of meshes and of shapes, exact and interpolated."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import truefield as tf
from truefield import csg


def _points(field: tf.AdaptiveField, count: int = 50_000) -> np.ndarray:
    low, high = field.extent
    return np.random.default_rng(4).uniform(low - 0.1 * (high - low), high + 0.1 * (high - low), (count, 3))


@pytest.fixture(scope="module")
def part() -> tf.TriangleMesh:
    return tf.shapes.box((4.0, 3.0, 2.0))


@pytest.mark.parametrize("method", ["linear", "cubic", "exact", "mixed"])
@pytest.mark.parametrize("rule", ["verified", "samples"])
def test_bounds_of_a_part_hold_its_distances(part: tf.TriangleMesh, method: str, rule: str) -> None:
    field = tf.adaptive_field(part, 0.02, growth=0.1, max_depth=6, method=method, rule=rule)  # type: ignore[arg-type]
    points = _points(field)
    truth = tf.Surface(part).distance(points)
    lower, upper = field.bounds(points)
    assert (lower <= truth).all()
    assert (truth <= upper).all()
    said = field.distance(points)
    low, high = field.extent
    inside = ((points >= low) & (points <= high)).all(axis=1)
    assert np.isnan(said[~inside]).all()
    if method == "exact":
        assert np.array_equal(said[inside], truth[inside])
        assert field.statistics()["exact"] == field.statistics()["leaves"]
    if method == "linear" and rule == "verified":
        near = inside & (np.abs(truth) < 0.05)
        assert np.abs(said - truth)[near].max() < 0.2


def test_tolerance_holds_at_the_surface_and_grows_away_from_it(part: tf.TriangleMesh) -> None:
    field = tf.adaptive_field(part, 0.01, growth=0.05)
    points = _points(field)
    said, truth = field.distance(points), tf.Surface(part).distance(points)
    inside = np.isfinite(said)
    assert (np.abs(said - truth)[inside] <= 0.01 + 0.05 * np.abs(truth[inside]) + 1e-9).all()


def test_a_shape_and_its_mesh_make_fields_of_one_solid(part: tf.TriangleMesh) -> None:
    one = tf.adaptive_field(part, 0.01, domain=((-3, -3, -3), (5, 5, 5)))
    low, high = part.extent
    other = tf.adaptive_field(
        csg.box((4.0, 3.0, 2.0), center=((low + high) / 2).tolist()), 0.01, domain=((-3, -3, -3), (5, 5, 5))
    )
    points = _points(one)
    lower, upper = one.bounds(points)
    low, high = other.bounds(points)
    assert (np.maximum(lower, low) <= np.minimum(upper, high)).all()


def test_exact_fields_need_no_tolerance_and_others_do(part: tf.TriangleMesh) -> None:
    assert tf.adaptive_field(part, method="exact").statistics()["exact"] > 0
    with pytest.raises(tf.TruefieldError, match="needs a tolerance"):
        tf.adaptive_field(part)
    for method in ("exact", "mixed"):
        with pytest.raises(tf.TruefieldError, match=f'"{method}" is for meshes'):
            tf.adaptive_field(csg.sphere(1.0), 0.1, method=method)


def test_mixed_fields_interpolate_where_that_will_do_and_keep_few_triangles_elsewhere(tmp_path: Path) -> None:
    part = tf.shapes.brevi()
    low, high = part.extent
    tolerance = 1e-3 * float(np.max(high - low))
    linear = tf.adaptive_field(part, tolerance)
    mixed = tf.adaptive_field(part, tolerance, method="mixed")
    counts = mixed.statistics()
    assert 0 < counts["exact"] < counts["leaves"] < linear.statistics()["leaves"] / 3
    points = _points(mixed)
    truth, said = tf.Surface(part).distance(points), mixed.distance(points)
    inside = np.isfinite(said)
    assert (np.abs(said - truth)[inside] <= tolerance + 0.05 * np.abs(truth[inside]) + 1e-9).all()

    middle, radius = part.vertices[7], 0.1 * float(np.max(high - low))
    tool = csg.sphere(radius).translate(middle.tolist())
    cut = mixed.carve(tool)
    lower, upper = cut.bounds(points)
    # Never less than either solid's distance; the same where the tool is far.
    way = tool.distance(points)
    assert (upper >= np.maximum(truth, -way) - 1e-9).all()
    far = way > np.abs(truth)
    assert (lower <= truth)[far].all()
    assert (truth <= upper)[far].all()
    cut.save(tmp_path / "cut.tfield")
    assert np.array_equal(np.stack(tf.load(tmp_path / "cut.tfield").bounds(points)), np.stack([lower, upper]))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"tolerance": -1.0}, "tolerance"),
        ({"tolerance": np.nan}, "tolerance"),
        ({"tolerance": 1e-30}, "rounding"),
        ({"growth": -0.5}, "growth"),
        ({"growth": np.nan}, "growth"),
        ({"max_depth": 99}, "max_depth"),
        ({"method": "quartic"}, "method"),
        ({"rule": "hope"}, "rule"),
        ({"domain": ((1, 1, 1), (0, 0, 0))}, "domain"),
        ({"domain": [[0, 0, 0]]}, "domain"),
        ({"domain": "abc"}, "domain"),
        ({"domain": (1, 2)}, "domain"),
        ({"domain": ((0, 0, 0), (np.nan, 1, 1))}, "domain"),
        ({"threads": 0}, "threads"),
    ],
)
def test_wrong_arguments_get_a_sentence(part: tf.TriangleMesh, arguments: dict[str, object], message: str) -> None:
    with pytest.raises(tf.TruefieldError, match=message):
        tf.adaptive_field(part, **{"tolerance": 0.1, **arguments})  # type: ignore[arg-type]
    if message != "threads":
        with pytest.raises(tf.TruefieldError, match=message):
            tf.adaptive_field(csg.sphere(1.0), **{"tolerance": 0.1, **arguments})  # type: ignore[arg-type]


def test_what_does_not_fit_is_refused_before_it_is_built(part: tf.TriangleMesh) -> None:
    for shape in (part, csg.sphere(1.0)):
        with pytest.raises(MemoryError, match="larger tolerance"):
            tf.adaptive_field(shape, 1e-6, memory=2**22)
        with pytest.raises(MemoryError, match="of 1e-14 "):
            tf.adaptive_field(shape, 1e-14, memory=2**22)
    # Whoever need not have cells alone is told what takes fewer.
    with pytest.raises(MemoryError, match="method mixed"):
        tf.adaptive_field(part, 1e-6, memory=2**22)
    with pytest.raises(MemoryError, match=r"a max_depth\)"):
        tf.adaptive_field(part, 1e-14, method="cubic", memory=2**22)


def test_progress_is_told_and_can_stop() -> None:
    def stop(phase: str, fraction: float) -> None:
        assert phase
        assert 0.0 <= fraction <= 1.0
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        tf.adaptive_field(csg.sphere(1.0), 1e-6, progress=stop)


def test_any_number_of_threads_makes_the_same_field(part: tf.TriangleMesh) -> None:
    points = _points(tf.adaptive_field(part, 0.1))
    for method in ("linear", "exact", "mixed"):
        fields = [tf.adaptive_field(part, 0.01, method=method, threads=n) for n in (1, 2, 5)]
        first, *others = (np.stack(field.bounds(points)) for field in fields)
        assert all(np.array_equal(first, other) for other in others)


def test_leaves_tile_the_domain_and_tell_their_errors() -> None:
    field = tf.adaptive_field(csg.sphere(1.0), 0.01)
    leaves = field.leaves()
    low, high = field.extent
    assert len(leaves.low) == field.statistics()["leaves"]
    assert np.isclose(np.prod(leaves.high - leaves.low, axis=1).sum(), np.prod(high - low))
    points = np.random.default_rng(3).uniform(leaves.low, leaves.high)
    off = (np.linalg.norm(points, axis=1) - 1.0) - field.distance(points)
    assert (leaves.lower - 1e-12 <= off).all()
    assert (off <= leaves.upper + 1e-12).all()
