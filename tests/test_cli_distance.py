from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import truefield as tf
from commands import Command
from solids import cube

COLUMNS = "x,y,z,distance,lower,upper,nearest_x,nearest_y,nearest_z,triangle,feature"
POINTS = np.array([[0.5, 0.5, 0.9], [0.5, 0.25, 1.5], [2.0, 0.5, 1.0], [-1.0, -2.0, -2.0], [0.25, 0.5, 0.0]])
DISTANCES = [-0.1, 0.5, 1.0, 3.0, 0.0]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    cube().write(tmp_path / "cube.stl")
    np.savetxt(tmp_path / "probes.csv", POINTS, delimiter=",", header="x,y,z", comments="")
    return tmp_path


def test_distances_of_points(truefield: Command, folder: Path) -> None:
    said = truefield.done("distance", folder / "cube.stl", "--points", folder / "probes.csv", "-o", folder / "out.csv")
    assert "5 points, 1 inside" in said
    assert "sign rule: " in said
    names, *lines = (folder / "out.csv").read_text().splitlines()
    assert names == COLUMNS
    rows = np.array([[float(cell) for cell in line.split(",")] for line in lines])
    assert np.array_equal(rows[:, :3], POINTS)
    assert rows[:, 3] == pytest.approx(DISTANCES, abs=1e-15)
    assert (rows[:, 4] <= rows[:, 3]).all()
    assert (rows[:, 3] <= rows[:, 5]).all()
    assert np.linalg.norm(rows[:, :3] - rows[:, 6:9], axis=1) == pytest.approx(np.abs(DISTANCES), abs=1e-15)
    assert rows[2, 6:9].tolist() == [1.0, 0.5, 1.0]
    assert set(rows[:, 9]) <= set(range(12))
    assert rows[3, 10] >= 4
    assert lines[0].split(",")[9].isdigit()


def test_the_files_hold_the_very_numbers_of_the_library(truefield: Command, folder: Path) -> None:
    points = np.random.default_rng(5).normal(size=(200, 3))
    np.save(folder / "probes.npy", points)
    for suffix in ("csv", "ply"):
        out = folder / f"out.{suffix}"
        truefield.done("distance", folder / "cube.stl", "-p", folder / "probes.npy", "-o", out, "--threads", "2")
        assert np.array_equal(tf.read_points(out), points)
    distances = np.genfromtxt(folder / "out.csv", delimiter=",", names=True)["distance"]
    assert np.array_equal(distances, tf.Surface(tf.read(folder / "cube.stl")).distance(points))


def test_the_sign_can_be_left_out(truefield: Command, folder: Path) -> None:
    out = folder / "out.csv"
    said = truefield.done("distance", folder / "cube.stl", "-p", folder / "probes.csv", "-o", out, "--sign", "unsigned")
    assert "unsigned" in said
    assert (np.genfromtxt(out, delimiter=",", names=True)["distance"] >= 0).all()


def test_what_was_written_can_be_asked_again(truefield: Command, folder: Path) -> None:
    first, second = folder / "first.csv", folder / "second.csv"
    truefield.done("distance", folder / "cube.stl", "-p", folder / "probes.csv", "-o", first)
    truefield.done("distance", folder / "cube.stl", "-p", first, "-o", second)
    assert first.read_text() == second.read_text()
