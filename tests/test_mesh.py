from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest
import truefield as tf
from numpy.typing import ArrayLike
from solids import CORNERS, blob, cube
from truefield.weld import leaders

TRIANGLE = [[0, 1, 2]]
POINTS = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0]]


def test_a_mesh_keeps_its_arrays_as_they_are_and_read_only() -> None:
    vertices = np.asfortranarray(CORNERS)
    triangles = np.array([[0, 1, 2], [2, 1, 3], [2, 1, 3], [5, 5, 5]], dtype=np.uint16)
    mesh = tf.TriangleMesh(vertices, triangles, "part")
    assert mesh.vertices.dtype == np.float64
    assert mesh.vertices.flags.c_contiguous
    assert mesh.triangles.dtype == np.int64
    assert np.array_equal(mesh.vertices, CORNERS)
    assert np.array_equal(mesh.triangles, triangles)
    assert mesh.name == "part"
    for array in (mesh.vertices, mesh.triangles, *mesh.extent):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 7
    vertices[0] = 9.0
    assert mesh.vertices[0, 0] == 0.0
    with pytest.raises(AttributeError):
        mesh.vertices = CORNERS  # type: ignore[misc]


def test_the_extent_is_that_of_the_triangles() -> None:
    mesh = tf.TriangleMesh([*POINTS, [9.0, 9.0, 9.0]], TRIANGLE)
    lower, upper = mesh.extent
    assert lower.tolist() == [0.0, 0.0, 0.0]
    assert upper.tolist() == [1.0, 2.0, 0.0]


def test_a_mesh_can_be_pickled() -> None:
    mesh = blob()
    copy = pickle.loads(pickle.dumps(mesh))
    assert np.array_equal(copy.vertices, mesh.vertices)
    assert np.array_equal(copy.triangles, mesh.triangles)
    assert copy.name == mesh.name
    assert not copy.vertices.flags.writeable


@pytest.mark.parametrize(
    ("vertices", "triangles", "sentence"),
    [
        ([], TRIANGLE, r"vertices has shape \(0,\)"),
        (np.empty((0, 3)), TRIANGLE, "no vertices"),
        (np.zeros((4, 2)), TRIANGLE, r"vertices has shape \(4, 2\)"),
        ([[0, 0, 0], [1, 2]], TRIANGLE, "vertices cannot be turned into numbers"),
        ([["a", "b", "c"]], TRIANGLE, "vertices cannot be turned into numbers"),
        ([[0, 0, 0], [1, 0, np.nan], [0, 1, 0]], TRIANGLE, r"vertex 1 is \(1.0, 0.0, nan\)"),
        ([[0, 0, 0], [1, 0, 0], [0, -np.inf, 0]], TRIANGLE, r"vertex 2 is \(0.0, -inf, 0.0\)"),
        (POINTS, [], "no triangles"),
        (POINTS, [0, 1, 2], r"triangles has shape \(3,\)"),
        (POINTS, [[0, 1, 2, 0]], r"triangles has shape \(1, 4\)"),
        (POINTS, [[0, 1], [1, 2, 0]], "triangles is no array"),
        (POINTS, [[0.0, 1.0, 2.0]], "dtype float64; give integer"),
        (POINTS, [[0, 1, 2], [0, 1, 3]], r"triangle 1 refers to vertices \[0, 1, 3\] but .* only 3 vertices"),
        (POINTS, [[0, 1, -1]], "triangle 0 refers to"),
        (POINTS, np.array([[0, 1, 2**63]], dtype=np.uint64), "triangle 0 refers to"),
        (POINTS, [[0, 1, 1], [2, 2, 2]], "all 2 triangles of the mesh have zero area"),
        ([[0, 0, 0], [1, 1, 1], [2, 2, 2]], TRIANGLE, "zero area"),
        ([[3, 3, 3]] * 3, TRIANGLE, "diagonal of 0.0"),
        ([[-1e308, 0, 0], [1e308, 0, 0], [0, 1e308, 0]], TRIANGLE, "diagonal of inf"),
    ],
)
def test_what_is_no_mesh_is_refused_in_one_sentence(vertices: ArrayLike, triangles: ArrayLike, sentence: str) -> None:
    with pytest.raises(tf.TruefieldError, match=sentence) as caught:
        tf.TriangleMesh(vertices, triangles)
    assert "\n" not in str(caught.value)
    assert isinstance(caught.value, ValueError)


def split(mesh: tf.TriangleMesh, noise: float) -> tf.TriangleMesh:
    """Every triangle with corners of its own, off by at most half the noise."""
    generator = np.random.default_rng(2)
    corners = mesh.corners.reshape(-1, 3)
    shaken = corners + generator.uniform(-noise / 2, noise / 2, corners.shape)
    return tf.TriangleMesh(shaken, np.arange(len(corners)).reshape(-1, 3), mesh.name)


@pytest.mark.parametrize("noise", [0.0, 1e-9])
def test_welding_joins_what_nearly_coincides(noise: float) -> None:
    part = blob()
    apart = split(part, noise)
    assert len(apart.vertices) == 3 * len(part.triangles)
    whole = apart.weld(noise)
    assert len(whole.vertices) == len(part.vertices)
    assert whole.check().problems() == []
    assert np.abs(whole.corners - apart.corners).max() <= noise
    assert {tuple(vertex) for vertex in whole.vertices.tolist()} <= {
        tuple(vertex) for vertex in apart.vertices.tolist()
    }
    assert whole.triangles[0].tolist() == [0, 1, 2]
    assert whole.name == part.name


def test_welding_keeps_what_is_farther_apart_and_every_triangle() -> None:
    part = blob()
    gaps = np.linalg.norm(part.vertices[:, None] - part.vertices[None], axis=2)
    closest = gaps[gaps > 0].min()
    same = part.weld(closest * 0.999)
    assert np.array_equal(same.vertices, part.vertices)
    assert np.array_equal(same.triangles, part.triangles)
    coarse = part.weld(closest * 1.001)
    assert len(coarse.vertices) == len(part.vertices) - 1
    assert len(coarse.triangles) == len(part.triangles)


@pytest.mark.parametrize("within", [0.0, 0.005, 0.02, 0.04])
def test_groups_of_near_points_are_those_of_brute_force(within: float) -> None:
    points = np.random.default_rng(4).random((800, 3)) * [1.0, 0.3, 0.1] - 5.0
    points[7], points[9] = points[600], points[1]
    near = np.linalg.norm(points[:, None] - points[None], axis=2) <= within
    expected = np.arange(len(points))
    while not np.array_equal(lowest := np.where(near, expected, len(points)).min(axis=1), expected):
        expected = lowest
    assert np.array_equal(leaders(points, within), expected)


@pytest.mark.parametrize("within", [-1.0, np.nan, np.inf, 10.0])
def test_welding_by_what_is_no_length_or_too_much_is_refused(within: float) -> None:
    with pytest.raises(tf.TruefieldError):
        cube().weld(within)


@pytest.mark.parametrize("suffix", [".stl", ".ply", ".obj", ".off"])
def test_writing_leaves_no_other_file_and_replaces_the_old_one(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"part{suffix}"
    path.write_bytes(b"old")
    cube().write(path)
    assert [file.name for file in tmp_path.iterdir()] == [path.name]
    assert len(tf.read(path).triangles) == 12


def test_writing_to_an_unknown_suffix_says_which_are_known(tmp_path: Path) -> None:
    with pytest.raises(tf.FileError, match=r"\.stl, \.obj, \.ply, \.off"):
        cube().write(tmp_path / "part.step")
    assert not list(tmp_path.iterdir())


def test_points_are_taken_as_they_are_or_refused() -> None:
    surface = tf.Surface(tf.shapes.cube())
    points = np.random.default_rng(1).uniform(-1.0, 6.0, (20, 3))
    expected = surface.distance(points)
    unaligned = np.frombuffer(b"x" + points.tobytes(), np.uint8)[1:].view(np.float64).reshape(-1, 3)
    for same in (unaligned, points.astype(">f8"), np.asfortranarray(points), points[::-1][::-1], points.tolist()):
        np.testing.assert_array_equal(surface.distance(same), expected)
    dates = np.zeros((2, 3), "M8[s]")
    for wrong in (points + 1j, dates, np.ma.masked_array(points, points > 5.0), "abc", None):
        with pytest.raises(tf.TruefieldError, match="points"):
            surface.distance(wrong)  # type: ignore[arg-type]
    for threads in (0, -1, 1.5, "all", 2**70):
        with pytest.raises(tf.TruefieldError, match="threads"):
            surface.distance(points, threads=threads)  # type: ignore[arg-type]
    assert len(tf.complete_field(surface, 4, memory=2**70).distance(points)) == 20
    cube = tf.shapes.cube()
    for vertices in (cube.vertices + 1j, np.ma.masked_array(cube.vertices, cube.vertices > 1.0)):
        with pytest.raises(tf.TruefieldError, match="vertices"):
            tf.TriangleMesh(vertices, cube.triangles)
