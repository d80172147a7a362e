from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest
import truefield as tf
from numpy.typing import ArrayLike
from solids import CORNERS, blob, cube

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
