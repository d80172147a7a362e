"""Sampled fields through Python; what they promise is judged in the core's own tests."""

from __future__ import annotations

import numpy as np
import pytest
import truefield as tf
from numpy.typing import NDArray

ORIGIN, SPACING, SHAPE = np.array([-1.2, -1.0, -0.9]), np.array([0.05, 0.08, 0.11]), (49, 26, 17)

Floats = NDArray[np.float64]


def nodes() -> Floats:
    return np.asarray(ORIGIN + np.argwhere(np.ones(SHAPE, bool)).reshape(*SHAPE, 3) * SPACING)


def ball(points: Floats, centre: tuple[float, float, float] = (0.0, 0.0, 0.0), radius: float = 0.6) -> Floats:
    return np.asarray(np.linalg.norm(points - np.asarray(centre), axis=-1) - radius)


@pytest.fixture(scope="module")
def field() -> tf.SampledField:
    return tf.SampledField.from_array(ball(nodes()), ORIGIN, SPACING, error=1e-6)


@pytest.fixture(scope="module")
def probes() -> Floats:
    return np.random.default_rng(3).uniform(ORIGIN, ORIGIN + (np.array(SHAPE) - 1) * SPACING, (5000, 3))


def test_samples_are_kept_as_given(field: tf.SampledField) -> None:
    assert field.shape == SHAPE
    assert field.origin.tolist() == ORIGIN.tolist()
    assert field.spacing.tolist() == SPACING.tolist()
    np.testing.assert_array_equal(field.values, ball(nodes()).astype(np.float32))
    assert not field.values.flags.writeable
    assert "49 x 26 x 17" in repr(field)


def test_it_answers_like_every_field(field: tf.SampledField, probes: Floats) -> None:
    truth = ball(probes)
    lower, upper = field.bounds(probes)
    assert np.all((lower <= truth) & (truth <= upper))
    assert np.all(upper - lower < 2 * np.linalg.norm(SPACING))
    np.testing.assert_allclose(field.distance(probes), truth, atol=0.02)
    away = np.linalg.norm(probes, axis=1) > 0.3
    directions = probes[away] / np.linalg.norm(probes[away], axis=1, keepdims=True)
    assert np.all(np.sum(field.gradient(probes[away]) * directions, axis=1) > 0.95)
    np.testing.assert_allclose(np.linalg.norm(field.gradient(probes), axis=1), 1.0)


def test_outside_the_lattice_only_bounds_are_known(field: tf.SampledField) -> None:
    far = np.array([[5.0, 0.0, 0.0], [-1.3, 0.0, 0.0]])
    assert np.isnan(field.distance(far)).all()
    assert np.isnan(field.gradient(far)).all()
    lower, upper = field.bounds(far)
    assert np.all((lower <= ball(far)) & (ball(far) <= upper) & np.isfinite(upper - lower))


def test_solids_are_combined_by_operators(field: tf.SampledField, probes: Floats) -> None:
    centre = (0.5, 0.1, 0.0)
    other = tf.SampledField.from_array(ball(nodes(), centre), ORIGIN, SPACING, error=1e-6)
    a, b = ball(probes), ball(probes, centre)
    for made, sign in [
        (field | other, np.minimum(a, b)),
        (field & other, np.maximum(a, b)),
        (field - other, np.maximum(a, -b)),
        (~field, -a),
        (field.offset(0.1), a - 0.1),
        (field.offset(-0.1), a + 0.1),
    ]:
        lower, upper = made.bounds(probes)
        assert np.all(sign[lower > 0] > 0)
        assert np.all(sign[upper < 0] < 0)
        assert np.mean((lower > 0) | (upper < 0)) > 0.6
        np.testing.assert_allclose(made.distance(probes), sign, atol=0.06)
        assert np.all(made.lower <= made.values)
        assert np.all(made.values <= made.upper)


def test_only_fields_are_combined(field: tf.SampledField) -> None:
    with pytest.raises(TypeError):
        field | 3  # type: ignore[operator]
    with pytest.raises(tf.TruefieldError, match="int"):
        field.union(3)  # type: ignore[arg-type]
    moved = tf.SampledField.from_array(ball(nodes()), ORIGIN + 1e-9, SPACING, error=1e-6)
    with pytest.raises(tf.TruefieldError, match="resample"):
        field & moved


def test_resampling(field: tf.SampledField) -> None:
    again = field.resample()
    np.testing.assert_allclose(again.values, field.values, atol=1e-6)
    finer = field.resample(spacing=0.04)
    assert finer.shape == (61, 51, 45)
    inside = finer.origin + np.argwhere(np.ones(finer.shape, bool)) * finer.spacing
    np.testing.assert_allclose(finer.values.reshape(-1), field.distance(inside), atol=0.02)
    part = field.resample(origin=(0, 0, 0), shape=(3, 4, 5))
    assert part.shape == (3, 4, 5)
    assert part.spacing.tolist() == SPACING.tolist()
    same = finer.resample(like=field)
    assert same.shape == field.shape
    truth = ball(nodes())
    assert np.all((same.lower <= truth) & (truth <= same.upper))
    with pytest.raises(tf.TruefieldError, match="not both"):
        field.resample(field, spacing=0.1)
    with pytest.raises(MemoryError, match="samples"):
        field.resample(spacing=0.01, memory=1000)
    for bad in (0.0, -1.0, np.nan):
        with pytest.raises(tf.TruefieldError):
            field.resample(spacing=bad)


def test_bounds_of_samples_are_rounded_outward() -> None:
    values = np.full((2, 2, 2), 0.1)
    field = tf.SampledField.from_array(values, lower=values, upper=values)
    assert np.all(field.lower.astype(float) <= 0.1)
    assert np.all(field.upper.astype(float) >= 0.1)
    assert np.all(field.upper - field.lower <= np.spacing(np.float32(0.1)))


def test_nothing_is_promised_of_values_without_error() -> None:
    field = tf.SampledField.from_array(np.zeros((2, 2, 2)))
    lower, upper = field.bounds([[0.5, 0.5, 0.5]])
    assert (lower[0], upper[0]) == (-np.inf, np.inf)
    assert field.distance([0.5, 0.5, 0.5]).tolist() == [0.0]


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"values": np.zeros((2, 2))}, "values"),
        ({"values": np.zeros((2, 0, 2))}, "values"),
        ({"values": [[["a"]]]}, "values"),
        ({"values": np.full((2, 2, 2), np.nan)}, "not a number"),
        ({"spacing": 0.0}, "spacing"),
        ({"spacing": (1, 2)}, "spacing"),
        ({"spacing": (1, -2, 1)}, "spacing"),
        ({"origin": (np.inf, 0, 0)}, "origin"),
        ({"error": -1.0}, "error"),
        ({"error": "much"}, "error"),
        ({"error": 1.0, "lower": np.zeros((2, 2, 2))}, "not both"),
        ({"lower": np.zeros((2, 2, 2))}, "together"),
        ({"lower": np.ones((2, 2, 2)), "upper": np.ones((2, 2, 2))}, "between its bounds"),
        ({"lower": np.zeros((2, 2, 1)), "upper": np.zeros((2, 2, 1))}, "samples"),
    ],
)
def test_bad_samples_are_one_sentence(arguments: dict[str, object], named: str) -> None:
    with pytest.raises(tf.TruefieldError, match=named) as caught:
        tf.SampledField.from_array(**({"values": np.zeros((2, 2, 2))} | arguments))  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)


def test_a_part_s_samples_are_combined_too() -> None:
    part = tf.shapes.sphere()
    surface = tf.Surface(part)
    field = surface.sample(resolution=21, margin=0.3)
    shell = field - field.offset(-0.1)
    truth = np.maximum(field.values, -(field.values + 0.1))
    np.testing.assert_allclose(shell.values, truth, atol=1e-5)


def test_the_surface_is_a_closed_mesh_like_every_mesh(field: tf.SampledField) -> None:
    mesh = field.surface()
    again = tf.TriangleMesh(mesh.vertices, mesh.triangles, mesh.name)
    for a, b in zip(mesh.extent, again.extent, strict=True):
        np.testing.assert_array_equal(a, b)
    assert mesh.vertices.dtype == np.float64
    assert mesh.triangles.dtype == np.int64
    assert not mesh.vertices.flags.writeable
    assert not mesh.triangles.flags.writeable
    found = mesh.check()
    assert found.watertight
    assert found.consistent
    assert found.volume == pytest.approx(4 / 3 * np.pi * 0.6**3, rel=0.02)
    assert tf.Surface(mesh).sign_rule.name == "pseudonormal"
    np.testing.assert_allclose(ball(mesh.vertices), 0.0, atol=0.01)
    assert tf.Surface(mesh).distance([0.0, 0.0, 0.0]) < 0


def test_a_surface_that_reaches_the_border_is_closed_or_has_a_rim(field: tf.SampledField) -> None:
    closed, rimmed = field.surface(0.5), field.surface(0.5, border="open")
    assert closed.check().watertight
    assert not rimmed.check().watertight
    low, high = closed.extent
    assert np.all(low >= ORIGIN - SPACING / 2)
    assert np.all(high <= ORIGIN + (np.array(SHAPE) - 0.5) * SPACING)


def test_surfaces_that_cannot_be_are_one_sentence(field: tf.SampledField) -> None:
    for distance in (-1.0, np.nan, np.inf):
        with pytest.raises(tf.TruefieldError, match="distance"):
            field.surface(distance)
    with pytest.raises(tf.TruefieldError, match="border"):
        field.surface(border="none")  # type: ignore[arg-type]
    with pytest.raises(MemoryError):
        field.surface(memory=100)


def test_contours_carry_their_bounds(field: tf.SampledField) -> None:
    for placement in ("lattice", "projected"):
        cloud = field.contour(-0.1, 0.02, placement=placement)
        assert len(cloud) > 1000
        assert np.abs(field.distance(cloud.points) + 0.1).max() <= 0.01 * (1 + 1e-9)
        truth = ball(cloud.points)
        lower, upper = (np.asarray(cloud.scalars[name], float) for name in ("lower", "upper"))
        assert np.all((lower <= truth) & (truth <= upper))
        np.testing.assert_allclose(np.linalg.norm(np.asarray(cloud.normals), axis=1), 1.0)
    assert len(field.contour(9.0, 0.1)) == 0
    with pytest.raises(tf.TruefieldError, match="tolerance"):
        field.contour(0.0, 0.0)
    with pytest.raises(tf.TruefieldError, match="placement"):
        field.contour(0.0, 0.1, placement="anywhere")  # type: ignore[arg-type]
    with pytest.raises(MemoryError):
        field.contour(0.0, 0.01, memory=1000)


def test_the_medial_axis_of_a_wall_is_its_middle() -> None:
    x, y, z = np.meshgrid(*(np.arange(n) * 0.1 for n in (41, 31, 21)), indexing="ij")
    wall = tf.SampledField.from_array(np.abs(y - 1.52) - 0.9 + 0.0 * (x + z), spacing=0.1)
    middle = wall.medial_axis()
    assert len(middle) == 41 * 21
    np.testing.assert_allclose(middle.points[:, 1], 1.55)
    np.testing.assert_allclose(np.asarray(middle.scalars["radius"], float), 0.85, atol=1e-6)
    np.testing.assert_allclose(np.asarray(middle.scalars["angle"], float), 180.0, atol=1e-3)
    assert len(wall.medial_axis("outside")) == 0
    assert len((~wall).medial_axis("outside")) == len(middle)
    for bad in (0, 200):
        with pytest.raises(tf.TruefieldError, match="angle"):
            wall.medial_axis(angle=bad)
    with pytest.raises(tf.TruefieldError, match="side"):
        wall.medial_axis("between")  # type: ignore[arg-type]


def test_the_transform_of_a_scan_is_a_field_whose_bounds_hold(probes: Floats) -> None:
    """What a scanner makes of a ball, in voxels: the truth is the ball's."""
    inside = ball(nodes()) < 0
    scan = tf.Volume(inside, ORIGIN, SPACING)
    for surface in ("centers", "between"):
        made = tf.distance_transform(
            scan.values, sampling=scan.spacing, signed=True, surface=surface, return_bounds=True
        )
        field = tf.SampledField.from_volume(scan.holding(made.distance), lower=made.lower, upper=made.upper)
        lower, upper = field.bounds(probes)
        truth = ball(probes)
        assert np.all((lower <= truth) & (truth <= upper))
        mesh = field.surface()
        assert mesh.check().watertight
        assert np.abs(ball(mesh.vertices)).max() < np.linalg.norm(SPACING)
        grown = field.offset(0.1)
        assert np.all((grown.lower <= ball(nodes()) - 0.1) & (ball(nodes()) - 0.1 <= grown.upper))


def test_nearest_points_are_on_the_surface(field: tf.SampledField, probes: Floats) -> None:
    found = field.nearest(probes)
    np.testing.assert_array_equal(found.distance, field.distance(probes))
    np.testing.assert_array_equal(found.normal, field.gradient(probes))
    assert (found.triangle == -1).all()
    assert not found.feature.any()
    # Only from around the middle, where there is no one way out, walking may miss.
    there = np.asarray(np.isfinite(found.point).all(axis=1))
    assert there[np.linalg.norm(probes, axis=1) > 0.15].all()
    assert np.abs(ball(found.point[there])).max() < 0.01
    lower, upper = field.bounds(found.point[there])
    assert (lower <= 0.12).all()
    assert (upper >= -0.12).all()
    # The walk ends near the nearest point: no farther from it than the gradient of a cell can turn.
    away = probes[there] * (0.6 / np.linalg.norm(probes[there], axis=1))[:, None]
    assert np.median(np.linalg.norm(found.point[there] - away, axis=1)) < 0.01
    outside = field.nearest([[9.0, 9.0, 9.0]])
    assert np.isnan(outside.point).all()
    assert np.isnan(outside.distance).all()
