"""Guards CONVENTIONS.md: each test holds one line of its table against the library."""

from __future__ import annotations

import numpy as np
import pytest
import truefield as tf

# An asymmetric box, so that an exchanged axis shows: 6 x 4 x 2 about a centre off the origin.
LOW, HIGH = np.array([1.0, -2.0, 5.0]), np.array([7.0, 2.0, 7.0])
CENTRE = (LOW + HIGH) / 2


@pytest.fixture(scope="module")
def part() -> tf.TriangleMesh:
    corners = np.array(np.meshgrid(*zip(LOW, HIGH, strict=True), indexing="ij")).reshape(3, -1).T
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return tf.TriangleMesh(corners, [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))])


def test_sign_is_negative_inside(part: tf.TriangleMesh) -> None:
    points = np.array([CENTRE, [8.0, 0.0, 6.0], [7.0, 0.0, 6.0]])
    for asked in (tf.Surface(part), tf.complete_field(part, resolution=12)):
        np.testing.assert_allclose(asked.distance(points), [-1.0, 1.0, 0.0], rtol=0, atol=1e-15)


def test_gradient_points_outward(part: tf.TriangleMesh) -> None:
    points = np.array([[6.5, 0.5, 6.0], [7.5, 0.5, 6.0]])
    for asked in (tf.Surface(part), tf.complete_field(part, resolution=12)):
        np.testing.assert_allclose(asked.gradient(points), [[1.0, 0.0, 0.0]] * 2, rtol=0, atol=1e-15)
        np.testing.assert_allclose(asked.nearest(points).normal, [[1.0, 0.0, 0.0]] * 2, rtol=0, atol=1e-15)


def test_samples_are_indexed_x_y_z_and_lie_where_stated(part: tf.TriangleMesh) -> None:
    surface = tf.Surface(part)
    assert tf.complete_field(part, resolution=12).shape == (12, 8, 4)
    for sampled in (surface.sample(resolution=13), tf.complete_field(part, resolution=12).sample(resolution=13)):
        assert sampled.values.shape == (13, 9, 5)
        assert sampled.spacing.tolist() == [0.5, 0.5, 0.5]
        assert sampled.origin.tolist() == LOW.tolist()
        index = np.array([[0, 0, 0], [3, 1, 2], [5, 6, 1], np.array(sampled.values.shape) - 1])
        truth = surface.distance(np.asarray(sampled.origin) + index * sampled.spacing)
        np.testing.assert_allclose(sampled.values[tuple(index.T)], truth, rtol=1e-7, atol=1e-7)


def test_bulk_samples_are_single_and_enclose_the_truth(part: tf.TriangleMesh) -> None:
    surface = tf.Surface(part)
    sampled = surface.sample(resolution=37)
    index = np.argwhere(np.ones(sampled.values.shape, dtype=bool))
    truth = surface.distance(np.asarray(sampled.origin) + index * sampled.spacing).reshape(sampled.values.shape)
    for array in (sampled.values, sampled.lower, sampled.upper):
        assert array.dtype == np.float32
    assert np.all(sampled.lower.astype(np.float64) <= truth)
    assert np.all(truth <= sampled.upper.astype(np.float64))
    np.testing.assert_array_equal(sampled.values, truth.astype(np.float32))


def test_features_are_numbered_as_stated() -> None:
    triangle = tf.Surface(tf.TriangleMesh([[0, 0, 0], [4, 0, 0], [0, 4, 0]], [[0, 1, 2]]))
    asked = [[1, 1, 1], [2, -1, 0], [3, 3, 0], [-1, 2, 0], [-1, -1, 0], [6, -1, 0], [-1, 6, 0]]
    found = triangle.nearest(np.array(asked, dtype=float))
    np.testing.assert_array_equal(found.feature, range(7))


def test_ties_go_to_the_lowest_triangle() -> None:
    corners = [[0, 0, 0], [4, 0, 0], [0, 4, 0]]
    twice = tf.Surface(tf.TriangleMesh(corners, [[0, 1, 2], [0, 1, 2], [1, 2, 0]]))
    assert twice.nearest(np.array([[1.0, 1.0, 3.0], [9.0, 9.0, 9.0]])).triangle.tolist() == [0, 0]


def test_interval_is_of_zero_width_where_exact(part: tf.TriangleMesh) -> None:
    points = np.random.default_rng(1).uniform(LOW - 1, HIGH + 1, (1000, 3))
    surface = tf.Surface(part)
    lower, upper = surface.bounds(points)
    np.testing.assert_array_equal(lower, upper)
    np.testing.assert_array_equal(lower, surface.distance(points))


def test_interval_spans_zero_where_the_side_is_unknown(part: tf.TriangleMesh) -> None:
    # A box without its top: seen from the middle of the opening, the walls fill just half of all directions.
    without_top = np.asarray(part.triangles)[(np.asarray(part.vertices)[part.triangles][:, :, 2] < HIGH[2]).any(axis=1)]
    surface = tf.Surface(tf.TriangleMesh(part.vertices, without_top))
    lower, upper = surface.bounds(np.array([[CENTRE[0], CENTRE[1], HIGH[2]]]))
    assert (lower[0], upper[0]) == (-2.0, 2.0)


def test_wall_thickness_is_twice_the_depth(part: tf.TriangleMesh) -> None:
    heavy = tf.thickness(part, tolerance=0.01, above=1.9)
    assert heavy.greatest_depth.depth.lower <= 1.0 <= heavy.greatest_depth.depth.upper
    assert heavy.greatest_thickness.lower <= 2.0 <= heavy.greatest_thickness.upper
    assert len(heavy.heavy_sections) == 1
    assert not tf.thickness(part, tolerance=0.01, above=2.1).heavy_sections


def test_contours_outside_are_positive(part: tf.TriangleMesh) -> None:
    field = tf.complete_field(part, resolution=12)
    for level in (-0.5, 0.5):
        shell = field.contour(level, tolerance=0.1)
        np.testing.assert_allclose(tf.Surface(part).distance(shell.points), level, rtol=0, atol=0.05)


def test_results_are_the_same_bits_for_any_number_of_threads(part: tf.TriangleMesh) -> None:
    points = np.random.default_rng(2).uniform(LOW - 1, HIGH + 1, (5000, 3))
    for threads in (2, 7):
        np.testing.assert_array_equal(
            tf.Surface(part, threads=threads).distance(points, threads=threads),
            tf.Surface(part, threads=1).distance(points, threads=1),
        )


def test_progress_hears_words_and_fractions() -> None:
    heard: list[tuple[str, float]] = []
    tf.complete_field(tf.shapes.sphere(), resolution=64, progress=lambda phase, done: heard.append((phase, done)))
    assert heard
    assert all(isinstance(phase, str) and 0 <= done <= 1 for phase, done in heard)


def test_errors_are_one_sentence(part: tf.TriangleMesh) -> None:
    with pytest.raises(ValueError, match="resolution") as caught:
        tf.complete_field(part, resolution=0)
    assert isinstance(caught.value, tf.TruefieldError)
    assert "\n" not in str(caught.value)


def test_images_are_foreground_where_they_are_not_zero() -> None:
    image = np.zeros((6, 5))
    image[3:] = -7.5
    steps = np.array([-2.0, -1.0, 0.0, 1.0, 2.0, 3.0])
    centers = tf.distance_transform(image, sampling=(0.5, 9.0), signed=True, surface="centers")
    between = tf.distance_transform(image, sampling=(0.5, 9.0), signed=True, surface="between")
    for found, nearest in ((centers, 1.0), (between, 0.5)):
        outside, inside = -steps[:3] + nearest, -(steps[3:] - 1.0 + nearest)
        np.testing.assert_array_equal(found[:, 2], 0.5 * np.concatenate([outside, inside]))
    assert np.all(np.isinf(tf.distance_transform(np.ones((3, 3)))))


def test_shapes_are_centred_and_their_values_are_bounds() -> None:
    csg = tf.csg
    for shape in (csg.box((2, 4, 6)), csg.cylinder(1, 6), csg.cone(1, 6, top=1)):
        assert shape.distance([[0, 0, 4]]) == pytest.approx([1.0])
    assert csg.half_space((0, 0, 1), (0, 0, 1)).distance([[0, 0, 0]]) == pytest.approx([-1.0])
    # Two halves of one block: the value ends at the face they share, the bounds go on.
    halves = csg.box((2, 2, 2), center=(-1, 0, 0)) | csg.box((2, 2, 2), center=(1, 0, 0))
    lower, upper = halves.bounds([[0.25, 0.0, 0.0]])
    assert halves.distance([[0.25, 0.0, 0.0]]) == pytest.approx([-0.25])
    assert lower[0] <= -1.0
    assert upper == pytest.approx([-0.25])
