from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import truefield as tf
from commands import Command


@pytest.fixture
def ball(tmp_path: Path) -> Path:
    tf.shapes.sphere(10.0, 3).write(tmp_path / "ball.off")
    return tmp_path / "ball.off"


@pytest.mark.parametrize("depth", [4.0, -2.5])
def test_a_contour_lies_at_its_depth(truefield: Command, ball: Path, tmp_path: Path, depth: float) -> None:
    shell = tmp_path / "shell.ply"
    said = truefield.done("contour", ball, "--depth", depth, "--tolerance", "0.5", "-o", shell)
    points = tf.read_points(shell)
    assert f"{len(points)} points" in said
    assert np.abs(tf.Surface(tf.read(ball)).distance(points) + depth).max() <= 0.25
    area = 4.0 * np.pi * (10.0 - depth) ** 2
    assert len(points) > area / 0.5**2 / 4.0


def test_projected_points_lie_on_the_contour(truefield: Command, ball: Path, tmp_path: Path) -> None:
    shell = tmp_path / "shell.csv"
    words = ("contour", ball, "--depth", 4, "--tolerance", 0.5, "-o", shell, "--placement", "projected", "--threads", 2)
    truefield.done(*words, "--sign", "winding")
    distances = tf.Surface(tf.read(ball)).distance(tf.read_points(shell))
    assert np.abs(distances + 4.0).max() <= 0.25
    assert np.median(np.abs(distances + 4.0)) < 1e-9


def test_the_file_is_the_library_s_answer(truefield: Command, ball: Path, tmp_path: Path) -> None:
    truefield.done("contour", ball, "--depth", 4, "--tolerance", 0.5, "-o", tmp_path / "a.ply")
    tf.complete_field(tf.read(ball), resolution=20).contour(-4.0, tolerance=0.5).write(tmp_path / "b.ply")
    assert (tmp_path / "a.ply").read_bytes() == (tmp_path / "b.ply").read_bytes()
