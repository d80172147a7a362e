"""Distance transforms against brute force over all pairs of voxels."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
import pytest
import truefield as tf
from numpy.typing import NDArray

SHAPES = [(1,), (37,), (9, 17), (1, 23), (31, 1), (7, 8, 9), (1, 6, 1), (3, 1, 11), (4, 5, 3, 6)]


def brute(image: NDArray[Any], matrix: NDArray[np.float64], kind: str = "background") -> NDArray[np.float64]:
    """All distances from centre to centre."""
    places = np.argwhere(np.ones(image.shape, dtype=bool)) @ matrix.T
    values = image.reshape(-1)
    squares = ((places[:, None, :] - places[None, :, :]) ** 2).sum(axis=2)
    if kind == "background":
        allowed = np.broadcast_to(values == 0, squares.shape)
    elif kind == "signed":
        allowed = (values == 0)[:, None] != (values == 0)[None, :]
    else:
        allowed = values[:, None] != values[None, :]
    least = np.where(allowed, squares, np.inf).min(axis=1)
    distance = np.sqrt(least) * (np.where(values != 0, -1.0, 1.0) if kind == "signed" else 1.0)
    return np.asarray(distance.reshape(image.shape))


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("density", [0.0, 0.02, 0.5, 0.97, 1.0])
def test_distances_are_those_of_brute_force(shape: tuple[int, ...], density: float) -> None:
    rng = np.random.default_rng(len(shape) + int(100 * density))
    image = (rng.random(shape) < density) * rng.integers(1, 4, shape)
    sampling = rng.choice([0.5, 1.0, 2.25], len(shape))
    for kind in ("background", "signed", "other_label"):
        options: dict[str, Any] = {"target": kind} if kind != "signed" else {"signed": True}
        np.testing.assert_array_equal(
            tf.distance_transform(image, **options), brute(image, np.eye(len(shape)), kind).astype(np.float32)
        )
        found = tf.distance_transform(image, sampling=sampling, **options)
        np.testing.assert_allclose(found, brute(image, np.diag(sampling), kind), rtol=1e-7)
        assert found.dtype == np.float32


def test_sampling_may_be_one_number_or_a_perpendicular_affine() -> None:
    image = np.random.default_rng(1).random((12, 13, 14)) < 0.97
    np.testing.assert_array_equal(
        tf.distance_transform(image, sampling=0.25), tf.distance_transform(image) * np.float32(0.25)
    )
    turn, _ = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))
    affine = np.eye(4)
    affine[:3, :3], affine[:3, 3] = turn * [0.5, 1.0, 3.0], [5, 6, 7]
    expected = tf.distance_transform(image, sampling=(0.5, 1.0, 3.0))
    np.testing.assert_allclose(tf.distance_transform(image, affine=affine), expected, rtol=2e-7)
    np.testing.assert_allclose(tf.distance_transform(image, affine=affine[:3, :3]), expected, rtol=2e-7)


@pytest.mark.parametrize("kind", ["background", "signed", "other_label"])
def test_axes_at_any_angles(kind: str) -> None:
    rng = np.random.default_rng(20)
    options: dict[str, Any] = {"target": kind} if kind != "signed" else {"signed": True}
    for shape in ((19, 23), (7, 9, 11), (1, 12), (8, 1, 9)):
        image = (rng.random(shape) < 0.9) * rng.integers(1, 3, shape)
        image.reshape(-1)[[0, -1]] = 0, 1
        matrix = np.eye(len(shape)) + rng.uniform(-0.5, 0.5, (len(shape),) * 2)
        found: Any = tf.distance_transform(image, affine=matrix, return_indices=True, return_bounds=True, **options)
        truth = brute(image, matrix, kind)
        np.testing.assert_allclose(found, truth, rtol=1e-6)
        np.testing.assert_array_equal(tf.distance_transform(np.asfortranarray(image), affine=matrix, **options), found)
        steps = np.moveaxis(found.indices - np.indices(shape), 0, -1) @ matrix.T
        np.testing.assert_allclose(np.linalg.norm(steps, axis=-1), np.abs(truth), rtol=1e-6)
        assert np.all(found.lower <= truth)
        assert np.all(truth <= found.upper)
        faces: Any = tf.distance_transform(image, affine=matrix, surface="between", return_bounds=True, **options)
        np.testing.assert_array_equal(faces.lower, found.lower)
        half = np.linalg.norm(matrix, axis=0).sum() / 2
        assert np.all(np.abs(faces.distance) <= np.abs(truth) * (1 + 1e-6))
        assert np.all(np.abs(faces.distance) >= np.abs(truth) - half)


def test_between_along_skewed_axes_is_the_distance_to_the_faces() -> None:
    image = np.zeros((12, 12), np.uint8)
    image[:6] = 1
    found = tf.distance_transform(image, affine=[[1.0, 0.0], [0.5, 1.0]], surface="between", signed=True)
    # The face is the line x = 5.5 in indices; far from its ends the distance goes straight to it.
    np.testing.assert_allclose(found[4:8, 6], [-1.5, -0.5, 0.5, 1.5], rtol=1e-6)


def test_between_is_the_distance_to_the_faces() -> None:
    image = np.zeros((40, 40, 40), np.uint8)
    image[10:30, 12:25, 15:22] = 1
    found = tf.distance_transform(image, signed=True, surface="between", sampling=(1.0, 2.0, 0.5))
    low, high = np.array([9.5, 23.0, 7.25]), np.array([29.5, 49.0, 10.75])
    points = np.moveaxis(np.indices(image.shape), 0, -1) * [1.0, 2.0, 0.5]
    outside = np.maximum(np.maximum(low - points, points - high), 0)
    depth = np.maximum(low - points, points - high).max(axis=-1)
    truth = np.linalg.norm(outside, axis=-1) + np.minimum(depth, 0)
    np.testing.assert_allclose(found, truth, rtol=1e-6)


def test_borders_and_periodic_axes() -> None:
    line = np.ones(6, np.uint8)
    assert np.all(np.isinf(tf.distance_transform(line)))
    assert np.all(tf.distance_transform(line, signed=True) == -np.inf)
    assert np.all(tf.distance_transform(line * 0, signed=True) == np.inf)
    np.testing.assert_array_equal(tf.distance_transform(line, border="background"), [1, 2, 3, 3, 2, 1])
    line[1] = 0
    np.testing.assert_array_equal(tf.distance_transform(line), [1, 0, 1, 2, 3, 4])
    np.testing.assert_array_equal(tf.distance_transform(line, periodic=True), [1, 0, 1, 2, 3, 2])
    np.testing.assert_array_equal(
        tf.distance_transform(line * 0, signed=True, border="foreground"),
        tf.distance_transform(line * 0 + 1, border="background"),
    )
    image = np.random.default_rng(3).random((15, 16)) < 0.97
    tiled = tf.distance_transform(np.tile(image, (3, 1)))[15:30]
    np.testing.assert_array_equal(tf.distance_transform(image, periodic=(True, False)), tiled)
    padded = tf.distance_transform(np.pad(image, 1), target="other_label")[1:-1, 1:-1]
    np.testing.assert_array_equal(tf.distance_transform(image, border="background", target="other_label"), padded)


WHOLE = ("bool", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", ">i4")
REAL = ("float16", "float32", "float64", "longdouble", ">f8")


@pytest.mark.parametrize("kind", WHOLE + REAL)
def test_every_type_and_order_gives_the_same(kind: str) -> None:
    rng = np.random.default_rng(4)
    image = (rng.random((11, 12, 13)) < 0.9) * rng.integers(1, 4, (11, 12, 13))
    given = image.astype(kind)
    image = given.astype(np.int64)
    before = given.copy()
    for view in (
        lambda a: a,
        np.asfortranarray,
        lambda a: a[::-1, ::2, 1:],
        lambda a: a.transpose(1, 0, 2),
        lambda a: a[..., 3],
    ):
        for options in ({}, {"signed": True}, {"target": "other_label"}, {"return_indices": True}):
            expected: Any = tf.distance_transform(
                np.ascontiguousarray(view(image)), sampling=range(1, view(image).ndim + 1), **options
            )
            found: Any = tf.distance_transform(view(given), sampling=range(1, view(given).ndim + 1), **options)
            np.testing.assert_array_equal(found, expected)
            if "return_indices" in options:
                np.testing.assert_array_equal(found.indices, expected.indices)
    np.testing.assert_array_equal(given, before)


def test_labels_of_any_width_are_told_apart() -> None:
    image = np.array([5, 5, 2**40 + 5, 2**40 + 5, -(2**40), 0, 0, 7])
    np.testing.assert_array_equal(tf.distance_transform(image, target="other_label"), [2, 1, 1, 1, 1, 1, 1, 1])
    for kind in (np.int64, np.float64):
        line = np.array([0, 0, 0, 3, 3, 3], kind)
        found = tf.distance_transform(line, target="other_label", border="background")
        np.testing.assert_array_equal(found, [3, 2, 1, 1, 2, 1])
    for kind in (np.int64, np.float64):
        line = np.array([-4, -4, -4, -4], kind)
        np.testing.assert_array_equal(
            tf.distance_transform(line, target="other_label", border="background"), [1, 2, 2, 1]
        )


def test_indices_are_sites_at_that_distance_and_the_first_of_them() -> None:
    rng = np.random.default_rng(5)
    for shape in SHAPES:
        image = rng.random(shape) < 0.8
        image.reshape(-1)[rng.integers(image.size)] = False
        found: Any = tf.distance_transform(image, return_indices=True)
        assert found.indices.shape == (len(shape), *shape)
        assert found.indices.dtype == np.int32
        assert not image[tuple(found.indices)].any()
        squares = ((found.indices - np.indices(shape)) ** 2).sum(axis=0)
        np.testing.assert_array_equal(np.sqrt(squares).astype(np.float32), found.distance)
        np.testing.assert_array_equal(np.ravel_multi_index(tuple(found.indices), shape), found.sites)
        places = np.argwhere(np.ones(shape, dtype=bool))
        sites = places[~image.reshape(-1)]
        first = ((places[:, None] - sites[None]) ** 2).sum(axis=2).argmin(axis=1)
        np.testing.assert_array_equal(found.indices.reshape(len(shape), -1).T, sites[first])
    nowhere: Any = tf.distance_transform(np.ones((3, 4)), return_indices=True)
    assert np.all(nowhere.indices == -1)
    bordered: Any = tf.distance_transform(np.ones((3, 4)), return_indices=True, border="background")
    assert np.all(bordered.indices == -1)


def test_bounds_hold_for_shapes_that_were_sampled() -> None:
    rng = np.random.default_rng(6)
    sampling = np.array([0.8, 1.1, 1.7])
    points = np.moveaxis(np.indices((40, 36, 30)), 0, -1) * sampling
    for _ in range(20):
        centre, radius = rng.uniform(14, 20, 3), rng.uniform(6, 12)
        truth = np.linalg.norm(points - centre, axis=-1) - radius
        found: Any = tf.distance_transform(truth < 0, sampling=sampling, signed=True, return_bounds=True)
        assert np.all(found.lower <= truth)
        assert np.all(truth <= found.upper)
        assert np.all(found.upper - found.lower <= 2.0001 * np.linalg.norm(sampling))
        # Every voxel that the sphere meets: a conservative voxelisation.
        reach = np.linalg.norm(np.maximum(np.abs(points - centre) - sampling / 2, 0), axis=-1)
        far = np.linalg.norm(np.abs(points - centre) + sampling / 2, axis=-1)
        met = (reach <= radius) & (radius <= far)
        found = tf.distance_transform(~met, sampling=sampling, return_bounds=True)
        assert np.all(found.lower <= np.abs(truth))
        assert np.all(np.abs(truth) <= found.upper)
        assert np.all(found.lower <= found.distance)
        assert np.all(found.distance <= found.upper)
        assert np.all(found.upper - found.lower <= 1.0001 * np.linalg.norm(sampling))


def test_a_result_is_an_array() -> None:
    image = np.random.default_rng(7).random((8, 9)) < 0.8
    plain, found = tf.distance_transform(image), tf.distance_transform(image, return_bounds=True)
    np.testing.assert_array_equal(np.asarray(found), plain)
    np.testing.assert_array_equal(found * 2 - found, plain)
    np.testing.assert_array_equal(np.sqrt(found), np.sqrt(plain))
    np.testing.assert_array_equal(found[2:, 3], plain[2:, 3])
    np.testing.assert_array_equal(found > 1, plain > 1)
    assert found.shape == (8, 9)
    assert len(found) == 8
    assert found.dtype == np.float32
    assert np.asarray(found, dtype=float).dtype == np.float64
    assert (found.indices, found.passes, found.changed) == (None, None, None)


def test_out_is_written_and_may_be_the_image() -> None:
    image = (np.random.default_rng(8).random((20, 30)) < 0.9).astype(np.float32)
    expected = tf.distance_transform(image)
    room = np.full((20, 30), np.nan, np.float32)
    assert tf.distance_transform(image, out=room) is room
    np.testing.assert_array_equal(room, expected)
    found: Any = tf.distance_transform(image, out=image, return_indices=True, return_bounds=True)
    assert found.distance is image
    np.testing.assert_array_equal(image, expected)
    assert np.all(found.lower <= expected)


def test_parts_with_margin_are_the_whole() -> None:
    image = np.random.default_rng(9).random((60, 50, 40)) < 0.95
    whole = tf.distance_transform(image)
    margin = int(np.ceil(whole.max()))
    for start in range(0, 60, 20):
        low, high = max(0, start - margin), min(60, start + 20 + margin)
        part = tf.distance_transform(image[low:high])[start - low : start - low + 20]
        np.testing.assert_array_equal(part, whole[start : start + 20])


def test_threads_do_not_matter() -> None:
    image = np.random.default_rng(10).random((70, 80, 90)) < 0.99
    for options in ({}, {"signed": True}, {"sampling": (1.0, np.pi, 0.3)}, {"target": "other_label", "periodic": True}):
        one = tf.distance_transform(image, threads=1, return_indices=True, **options)
        for threads in (2, 5):
            more = tf.distance_transform(image, threads=threads, return_indices=True, **options)
            np.testing.assert_array_equal(one.distance, more.distance)
            np.testing.assert_array_equal(one.sites, more.sites)


def test_voronoi_gives_the_nearest_label() -> None:
    rng = np.random.default_rng(11)
    for shape, sampling in (((30,), 1.0), ((20, 21), (1.0, 3.0)), ((9, 10, 11), (0.5, 1.0, 2.0))):
        labels = np.where(rng.random(shape) < 0.05, rng.integers(-5, 2**40, shape), 0)
        labels.reshape(-1)[7] = 9
        places = np.argwhere(np.ones(shape, dtype=bool)) * sampling
        sites = np.flatnonzero(labels)
        squares = ((places[:, None] - places[sites][None]) ** 2).sum(axis=2)
        expected = labels.reshape(-1)[sites[squares.argmin(axis=1)]].reshape(shape)
        found = tf.voronoi(labels, sampling=sampling)
        np.testing.assert_array_equal(found, expected)
        assert found.dtype == labels.dtype
    np.testing.assert_array_equal(tf.voronoi([0, 0, 0]), [0, 0, 0])
    np.testing.assert_array_equal(tf.voronoi([1, 0, 0, 0, 2, 0], periodic=True), [1, 1, 1, 2, 2, 1])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"sampling": 0.0}, "sampling is 0.0; give positive"),
        ({"sampling": (1.0, -1.0)}, "positive"),
        ({"sampling": (1.0, np.nan)}, "positive"),
        ({"sampling": (1.0, 1.0, 1.0)}, "3 lengths for 2 axes"),
        ({"sampling": "wide"}, "give a length"),
        ({"affine": np.zeros((2, 2))}, "singular"),
        ({"affine": np.eye(4)}, "shape"),
        ({"affine": [[1.0, 0.1], [0.0, 1.0]], "periodic": True}, "perpendicular"),
        ({"affine": [[1.0, 0.1], [0.0, 1.0]], "border": "background"}, "perpendicular"),
        ({"affine": np.eye(2), "sampling": 1.0}, "not both"),
        ({"affine": [[1.0, 0, 0], [0, 1, 0], [1, 0, 1]]}, "last row"),
        ({"signed": True, "target": "other_label"}, "inside"),
        ({"surface": "centres"}, "choose 'centers' or 'between'"),
        ({"target": "foreground"}, "choose 'background' or 'other_label'"),
        ({"border": "wall"}, "choose 'nothing'"),
        ({"method": "guess"}, "choose 'exact'"),
        ({"periodic": (True,)}, "periodic"),
        ({"periodic": 1}, "periodic"),
        ({"out": np.empty((3, 4))}, "float32"),
        ({"out": np.empty((4, 3), np.float32)}, "shape"),
        ({"out": np.empty((4, 3), np.float32).T}, "contiguous"),
        ({"threads": 0}, "threads"),
    ],
)
def test_what_cannot_be_used_is_refused(options: dict[str, Any], words: str) -> None:
    with pytest.raises(tf.TruefieldError, match=words):
        tf.distance_transform(np.ones((3, 4)), **options)


def test_images_that_cannot_be_used_are_refused() -> None:
    for image, words in ((np.ones(3, complex), "complex"), (np.float64(2), "single number"), (["a", "b"], "holds <U1")):
        with pytest.raises(tf.TruefieldError, match=words):
            tf.distance_transform(image)
    for kind in (np.float32, np.float64):
        image = np.ones((30, 40), kind)
        image[17, 39] = np.nan
        for options in ({}, {"signed": True}, {"target": "other_label"}):
            with pytest.raises(tf.TruefieldError, match="not a number"):
                tf.distance_transform(image, **options)
    huge = np.broadcast_to(np.zeros(1, bool), (100_000, 100_000, 1000))
    with pytest.raises(MemoryError, match="100000 x 100000 x 1000"):
        tf.distance_transform(huge)
    with pytest.raises(tf.TruefieldError, match="2 and 3 axes"):
        tf.distance_transform(np.ones((2, 2, 2, 2)), affine=np.eye(4) + 0.1)
    with pytest.raises(MemoryError, match="boundaries"):
        tf.distance_transform(np.ones((10, 10)), affine=[[1.0, 0.1], [0.0, 1.0]], memory=500)
    with pytest.raises(MemoryError):
        tf.voronoi(np.ones((10, 10)), memory=100)
    with pytest.raises(MemoryError):
        tf.distance_transform(np.ones((10, 10)), sampling=(1.0, np.pi), memory=1000)
    assert tf.distance_transform(np.ones((10, 10)), memory=400).shape == (10, 10)
    assert tf.distance_transform(np.ones((3, 0, 2))).shape == (3, 0, 2)


def test_progress_is_told_and_stops_the_work() -> None:
    image = np.random.default_rng(12).random((300, 300, 300)) < 0.99
    heard: list[tuple[str, float]] = []
    tf.distance_transform(image, progress=lambda phase, done: heard.append((phase, done)), threads=1)
    assert all(phase in ("rows", "columns", "root") and 0 <= done <= 1 for phase, done in heard)

    def stop(phase: str, done: float) -> None:
        raise RuntimeError(f"enough of {phase} at {done}")

    counted = threading.active_count()
    # Longer than the first report takes to come.
    large = np.broadcast_to(image[:2, None], (2, 200, 300, 300)).copy()
    with pytest.raises(RuntimeError, match="enough"):
        tf.distance_transform(large, progress=stop, threads=1)
    assert threading.active_count() == counted
