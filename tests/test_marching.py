"""Wavefronts and marches through images, voxels of parts, and parts sampled by both."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
import truefield as tf
from truefield.marching import Farther
from truefield.sampling import VoxelRule


def _images() -> list[np.ndarray]:
    random = np.random.default_rng(5)
    shapes = [(40,), (1,), (31, 17), (1, 23), (9, 11, 13), (20, 1, 18), (3, 40, 7)]
    return [random.random(shape) > density for shape in shapes for density in (0.02, 0.3, 0.95, 1.5, -1.0)]


@pytest.mark.parametrize("signed", [False, True])
def test_wavefronts_are_the_exact_transform(signed: bool) -> None:
    for image in _images():
        for sampling in (None, 0.25, tuple(0.5 + 1.3 * axis for axis in range(image.ndim))):
            exact = tf.distance_transform(image, sampling=sampling, signed=signed, return_indices=True)
            front = tf.distance_transform(
                image, sampling=sampling, signed=signed, method="wavefront", return_indices=True
            )
            np.testing.assert_allclose(front, exact, rtol=3e-7)
            assert front.farther_than(exact, sampling) == Farther(0, 0.0)
            assert front.changed is not None
            assert front.passes == len(front.changed) < max(image.shape)
            fewest = 0 if image.all() or not image.any() else image.size if signed else np.count_nonzero(image)
            assert front.changed.sum() >= fewest


def test_marches_are_nearly_exact() -> None:
    for image in _images():
        exact = tf.distance_transform(image, return_indices=True)
        march = tf.distance_transform(image, method="marching", return_indices=True)
        assert march.passes is None
        assert march.changed is None
        both = np.isfinite(np.asarray(exact))
        np.testing.assert_array_equal(both, np.isfinite(np.asarray(march)))
        assert np.all(np.asarray(march)[both] >= np.asarray(exact)[both])
        farther = march.farther_than(exact)
        assert farther.voxels == np.count_nonzero(np.asarray(march) > np.asarray(exact))
        assert farther.voxels <= image.size / 20


def test_sites_are_background_at_that_distance() -> None:
    random = np.random.default_rng(8)
    image = (random.random((14, 15, 16)) > 0.02).astype(np.uint16) * 7
    for method in ("wavefront", "marching"):
        found = tf.distance_transform(image, sampling=(1.0, 0.5, 2.0), method=method, return_indices=True)
        assert found.indices is not None
        assert not image[tuple(found.indices)].any()
        steps = (np.indices(image.shape) - found.indices) * np.array([1.0, 0.5, 2.0]).reshape(3, 1, 1, 1)
        np.testing.assert_allclose(np.linalg.norm(steps, axis=0), np.asarray(found), rtol=1e-6)


def test_images_of_any_layout_and_type_are_read_alike() -> None:
    image = np.random.default_rng(9).random((12, 13, 14)) > 0.05
    truth = np.asarray(tf.distance_transform(image, method="wavefront"))
    for kind in (bool, np.int8, np.uint16, np.int64, np.float32, np.float64):
        np.testing.assert_array_equal(tf.distance_transform(image.astype(kind), method="wavefront"), truth)
    np.testing.assert_array_equal(tf.distance_transform(np.asfortranarray(image), method="wavefront"), truth)
    wide = np.zeros((24, 13, 28), bool)
    wide[::2, :, ::-2] = image
    np.testing.assert_array_equal(tf.distance_transform(wide[::2, :, ::-2], method="wavefront"), truth)
    out = np.empty(image.shape, np.float32)
    assert tf.distance_transform(image, method="wavefront", out=out).distance is out
    np.testing.assert_array_equal(out, truth)


def test_bounds_are_those_of_the_exact_transform() -> None:
    image = np.random.default_rng(2).random((10, 11, 12)) > 0.1
    for signed in (False, True):
        exact = tf.distance_transform(image, signed=signed, return_bounds=True)
        front = tf.distance_transform(image, signed=signed, method="wavefront", return_bounds=True)
        np.testing.assert_array_equal(front.lower, exact.lower)
        np.testing.assert_array_equal(front.upper, exact.upper)


def test_threads_do_not_matter() -> None:
    image = np.random.default_rng(3).random((60, 61, 62)) > 0.01
    one, three = (
        tf.distance_transform(image, method="wavefront", return_indices=True, threads=threads) for threads in (1, 3)
    )
    np.testing.assert_array_equal(one.sites, three.sites)
    np.testing.assert_array_equal(one.changed, three.changed)
    np.testing.assert_array_equal(np.asarray(one), np.asarray(three))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"periodic": True}, "periodic"),
        ({"surface": "between"}, "between"),
        ({"target": "other_label"}, "other_label"),
        ({"border": "background"}, "border"),
        ({"affine": [[1.0, 0.5], [0.0, 1.0]]}, "perpendicular"),
        ({"sampling": -1.0}, "positive"),
        ({"out": np.empty((3, 3), np.float32)}, "out"),
    ],
)
def test_what_marching_cannot_do_is_said(options: dict[str, object], words: str) -> None:
    for method in ("wavefront", "marching"):
        with pytest.raises(tf.TruefieldError, match=words):
            tf.distance_transform(np.eye(4), method=method, **options)  # type: ignore[call-overload]


def test_bad_images_are_refused() -> None:
    with pytest.raises(tf.TruefieldError, match="4 axes"):
        tf.distance_transform(np.ones((2, 2, 2, 2)), method="wavefront")
    with pytest.raises(tf.TruefieldError, match="not a number"):
        tf.distance_transform(np.array([1.0, np.nan]), method="marching")
    with pytest.raises(tf.TruefieldError, match="method"):
        tf.distance_transform(np.ones(3), method="sweeping")  # type: ignore[call-overload]
    with pytest.raises(MemoryError):
        tf.distance_transform(np.ones((100, 100)), method="wavefront", memory=1000)
    with pytest.raises(tf.TruefieldError, match="return_indices"):
        tf.distance_transform(np.eye(3), method="wavefront").farther_than(
            tf.distance_transform(np.eye(3), return_indices=True)
        )


def test_progress_is_heard_and_can_stop_a_wavefront() -> None:
    class EnoughError(Exception):
        pass

    def stop(_phase: str, _fraction: float) -> None:
        raise EnoughError

    image = np.ones((300, 300, 300), bool)
    image[0, 0, 0] = False
    with pytest.raises(EnoughError):
        tf.distance_transform(image, method="wavefront", progress=stop)


@pytest.fixture(scope="module")
def ball() -> tf.TriangleMesh:
    return tf.shapes.sphere()


def test_voxels_stand_around_the_samples(ball: tf.TriangleMesh) -> None:
    surface = tf.Surface(ball)
    field = tf.sampled_field(surface, resolution=40)
    marks = {rule: tf.voxelize(surface, resolution=40, rule=rule) for rule in get_args(VoxelRule)}
    touched = marks["conservative"]
    np.testing.assert_array_equal(touched.origin, field.origin)
    np.testing.assert_array_equal(touched.spacing, field.spacing)
    assert touched.shape == field.shape
    inside = np.asarray(marks["solid"])
    apart = np.abs(field.values) > 1e-6
    np.testing.assert_array_equal(inside[apart], (field.values < 0)[apart])
    assert marks["solid"].doubtful == 0
    thin, thinner = np.asarray(marks["separating_26"]), np.asarray(marks["separating_6"])
    assert np.all(thinner <= thin)
    assert np.all(thin <= np.asarray(touched))
    assert thinner.sum() < 0.7 * thin.sum()
    np.testing.assert_array_equal(np.argwhere(touched.values), touched.index)
    centres = touched.origin + touched.index * touched.spacing
    near = surface.nearest(centres)
    np.testing.assert_allclose(touched.distance, np.abs(near.distance), atol=1e-12)
    # Centres between two triangles are as near to both; rounding decides.
    assert np.mean(touched.triangle != near.triangle) < 0.01


def test_voxels_are_a_volume(ball: tf.TriangleMesh, tmp_path: Path) -> None:
    made = tf.voxelize(ball, spacing=0.2, rule="solid", margin=0.3)
    made.volume.write(tmp_path / "ball.nrrd")
    np.testing.assert_array_equal(tf.read_volume(tmp_path / "ball.nrrd").values, np.asarray(made))
    assert np.asarray(made).sum() * 0.2**3 == pytest.approx(4 / 3 * np.pi, rel=0.1)


def test_sampled_fields_of_any_source_are_the_same(ball: tf.TriangleMesh) -> None:
    surface = tf.Surface(ball)
    truth = surface.sample(30, margin=0.1)
    for part in (ball, surface, tf.complete_field(surface, resolution=8)):
        field = tf.sampled_field(part, 30, margin=0.1)
        np.testing.assert_array_equal(field.values, truth.values)
        np.testing.assert_array_equal(field.origin, truth.origin)


def test_marched_fields_enclose_exact_ones() -> None:
    part = tf.shapes.housing()
    surface = tf.Surface(part)
    exact = tf.sampled_field(surface, 90)
    for band in (None, 7.0):
        field = tf.sampled_field(surface, 90, method="wavefront", band=band)
        assert np.all(field.lower <= exact.values)
        assert np.all(exact.values <= field.upper)
        assert np.all(field.lower <= field.values)
        assert np.all(field.values <= field.upper)
        within = np.abs(exact.values) < (np.inf if band is None else band)
        widths = (field.upper - field.lower)[within]
        assert widths.max() <= np.sqrt(3) * field.spacing[0] * (1 + 1e-5)
        touched = tf.voxelize(surface, 90)
        np.testing.assert_allclose(np.abs(field.values[touched.values]), touched.distance, rtol=1e-6, atol=1e-12)


def test_a_box_may_be_given(ball: tf.TriangleMesh) -> None:
    low, high = (-0.5, -0.25, 0.0), (0.5, 0.25, 1.5)
    surface = tf.Surface(ball)
    exact = tf.sampled_field(surface, spacing=0.25, extent=(low, high))
    assert exact.shape == (5, 3, 7)
    np.testing.assert_allclose(exact.origin, low)
    field = tf.sampled_field(surface, spacing=0.25, extent=(low, high), method="wavefront")
    assert np.all((field.lower <= exact.values) & (exact.values <= field.upper))
    assert tf.voxelize(surface, spacing=0.25, extent=(low, high)).shape == exact.shape


@pytest.mark.parametrize("make", [tf.sampled_field, tf.voxelize])
def test_bad_arguments_are_sentences(make: Callable[..., Any], ball: tf.TriangleMesh) -> None:
    for options, words in (
        ({"resolution": 1}, "resolution"),
        ({"resolution": 10, "spacing": 0.1}, "not both"),
        ({"spacing": -1.0}, "spacing"),
        ({"margin": -1.0}, "margin"),
        ({"extent": (0.0, 1.0)}, "extent"),
        ({"extent": ((1.0, 1.0, 1.0), (0.0, 0.0, 0.0))}, "extent"),
        ({"extent": ((0.0, 0.0, 0.0), (1.0, 1.0, np.nan))}, "extent"),
    ):
        with pytest.raises(tf.TruefieldError, match=words):
            make(ball, **options)
    with pytest.raises(tf.TruefieldError, match="resample"):
        make(tf.sampled_field(ball, 5))
    with pytest.raises(MemoryError):
        make(ball, resolution=50, memory=100)
    with pytest.raises(tf.TruefieldError, match=r"conserved|sideways"):
        make(ball, **({"rule": "conserved"} if make is tf.voxelize else {"method": "sideways"}))
