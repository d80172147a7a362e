from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import truefield as tf
from commands import Command
from solids import QUADS, cube
from truefield.cli.info import guess_units


def facts(truefield: Command, mesh: tf.TriangleMesh, folder: Path) -> dict[str, Any]:
    mesh.write(folder / "part.ply")
    found = json.loads(truefield.done("info", folder / "part.ply", "--json"))
    assert isinstance(found, dict)
    return found


def test_a_good_cube(truefield: Command, tmp_path: Path) -> None:
    found = facts(truefield, cube(20.0), tmp_path)
    assert found["triangles"] == 12
    assert found["vertices"] == 8
    assert found["lower"] == [0.0, 0.0, 0.0]
    assert found["upper"] == found["size"] == [20.0, 20.0, 20.0]
    assert found["units_guess"] == "millimetres"
    assert found["sign_rule"]["name"] == "pseudonormal"
    assert found["check"]["watertight"] is True
    assert found["check"]["shells"] == 1
    assert found["check"]["volume"] == pytest.approx(8000.0)
    assert found["check"]["area"] == pytest.approx(2400.0)
    assert found["problems"] == []
    text = truefield.done("info", tmp_path / "part.ply")
    for piece in (
        "part.ply",
        "12 on 8 vertices",
        "20 x 20 x 20",
        "millimetres?",
        "guess",
        "pseudonormal",
        "none found",
    ):
        assert piece.lower() in text.lower()


def test_everything_wrong_is_counted_and_said(truefield: Command, tmp_path: Path) -> None:
    base = cube(20.0)
    flipped = base.triangles.copy()
    flipped[4] = flipped[4, ::-1]
    triangles = np.concatenate((np.delete(flipped, 0, axis=0), flipped[-1:], [[1, 1, 3]]))
    vertices = np.concatenate((base.vertices, [[5.0, 5.0, 5.0]]))
    found = facts(truefield, tf.TriangleMesh(vertices, triangles), tmp_path)
    check = found["check"]
    assert check["open_edges"]["count"] > 0
    assert check["inconsistent_edges"]["count"] > 0
    assert check["non_manifold_edges"]["count"] > 0
    assert check["duplicate_triangles"] == {"count": 1, "first": [[10, 11]]}
    assert check["zero_area_triangles"] == {"count": 1, "first": [[12]]}
    assert check["unreferenced_vertices"] == {"count": 1, "first": [[8]]}
    assert check["watertight"] is False
    assert found["sign_rule"]["name"] == "winding"
    text = truefield.done("info", tmp_path / "part.ply")
    for sentence in found["problems"]:
        assert sentence in text
    assert "1 unused vertex, that no triangle refers to (vertex 8)" in text
    assert "not watertight" in text


def test_shells_inside_out_and_crossing(truefield: Command, tmp_path: Path) -> None:
    one = cube(20.0)
    shift = np.array([50.0, 0.0, 0.0])
    vertices = np.concatenate((one.vertices, one.vertices + shift, one.vertices + 10.0))
    triangles = np.concatenate((one.triangles, one.triangles[:, ::-1] + 8, one.triangles + 16))
    found = facts(truefield, tf.TriangleMesh(vertices, triangles), tmp_path)
    assert found["check"]["shells"] == 3
    assert found["check"]["inside_out_shells"] == {"count": 1, "first": [[12]]}
    assert found["check"]["self_intersections"]["count"] > 0
    assert len(found["problems"]) == 2


def test_the_check_of_a_good_part_finds_nothing() -> None:
    check = tf.shapes.sphere(2.0, 3).check()
    assert check.problems() == []
    assert check.watertight
    assert check.consistent
    assert check.volume == pytest.approx(4.0 / 3.0 * np.pi * 8.0, rel=0.03)
    assert check.open_edges.count == 0
    assert check.open_edges.first == ()


def test_cracks_below_single_precision_get_a_hint_that_works(truefield: Command, tmp_path: Path) -> None:
    part = tf.shapes.sphere(20.0, 2)
    corners = part.corners.reshape(-1, 3)
    corners[::7] += 1e-9
    cracked = tf.TriangleMesh(corners, np.arange(len(corners)).reshape(-1, 3))
    found = facts(truefield, cracked, tmp_path)
    assert found["check"]["open_edges"]["count"] > 0
    assert 1e-7 < found["weld_hint"] < 1e-5
    assert "--weld" in truefield.done("info", tmp_path / "part.ply")
    whole = json.loads(truefield.done("info", tmp_path / "part.ply", "--json", "--weld", found["weld_hint"]))
    assert whole["problems"] == []
    assert whole["weld_hint"] is None
    assert whole["sign_rule"]["name"] == "pseudonormal"
    half = tf.TriangleMesh(part.vertices, part.triangles[: len(part.triangles) // 2])
    assert facts(truefield, half, tmp_path)["weld_hint"] is None


def test_the_check_is_the_same_for_any_number_of_threads() -> None:
    mesh = tf.shapes.housing()
    assert mesh.check(threads=1) == mesh.check(threads=2) == mesh.check()


def test_the_sign_rule_can_be_chosen(truefield: Command, tmp_path: Path) -> None:
    cube().write(tmp_path / "cube.off")
    for sign in ("pseudonormal", "winding", "unsigned"):
        found = json.loads(truefield.done("info", tmp_path / "cube.off", "--json", "--sign", sign))
        assert found["sign_rule"]["name"] == sign
        assert found["sign_rule"]["reason"]


def test_polygons_of_a_file_are_counted_as_triangles(truefield: Command, tmp_path: Path) -> None:
    lines = [f"v {x} {y} {z}" for x, y, z in cube(3.0).vertices.tolist()]
    lines += ["f " + " ".join(str(i + 1) for i in quad) for quad in QUADS]
    (tmp_path / "quads.obj").write_text("\n".join(lines))
    assert json.loads(truefield.done("info", tmp_path / "quads.obj", "--json"))["triangles"] == 12


@pytest.mark.parametrize(
    ("longest", "unit"),
    [
        (1e-4, "no unit"),
        (0.3, "metres"),
        (2.0, "inches"),
        (160.0, "millimetres"),
        (9000.0, "millimetres"),
        (5e4, "micro"),
    ],
)
def test_the_guess_of_units(longest: float, unit: str) -> None:
    assert unit in guess_units(longest)
