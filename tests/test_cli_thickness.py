from __future__ import annotations

import json
from pathlib import Path

import pytest
import truefield as tf
from commands import Command


@pytest.fixture
def block(tmp_path: Path) -> Path:
    tf.shapes.box((40.0, 30.0, 20.0)).write(tmp_path / "block.stl")
    return tmp_path / "block.stl"


def test_the_report_of_a_block(truefield: Command, block: Path, tmp_path: Path) -> None:
    report = tmp_path / "report"
    said = truefield.done("thickness", block, "--above", 15, "--tolerance", 0.05, "--output", f"{report}/")
    document = json.loads((report / "report.json").read_text())
    depth = document["greatest_depth"]["depth"]
    assert depth["lower"] <= 10.0 <= depth["upper"] <= depth["lower"] + 0.05
    assert document["heavy_sections"]["count"] == 1
    assert document["limits"]["above"] == 15.0
    assert "1 section is heavy" in said
    assert " 1. " in said
    for file in report.iterdir():
        assert file.name in said
        assert file.stat().st_size > 0
    assert {"report.json", "samples.csv", "thickness.ply", "histogram.png"} <= {file.name for file in report.iterdir()}
    assert sorted(tmp_path.iterdir()) == [block, report]


def test_limits_are_limits_on_wall_thickness(truefield: Command, block: Path, tmp_path: Path) -> None:
    words = ("thickness", block, "--tolerance", 0.1, "-o", tmp_path / "report", "--threads", 2, "--spacing", 2)
    truefield.done(*words, "--above", 19.5, "--below", 19.5)
    document = json.loads((tmp_path / "report" / "report.json").read_text())
    assert document["heavy_sections"]["count"] == 1


def test_a_part_without_heavy_sections_is_good_news(truefield: Command, tmp_path: Path) -> None:
    part = tf.shapes.tetrahedron(10.0)
    side = float(min(part.extent[1] - part.extent[0]))
    part.write(tmp_path / "part.off")
    words = ("thickness", tmp_path / "part.off", "--tolerance", 0.1, "-o", tmp_path / "report", "--above", side * 0.9)
    assert "No section is heavy" in truefield.done(*words)
    assert json.loads((tmp_path / "report" / "report.json").read_text())["heavy_sections"]["count"] == 0


def test_a_limit_that_no_part_of_this_size_reaches_is_refused(truefield: Command, block: Path, tmp_path: Path) -> None:
    words = ("thickness", block, "--tolerance", 0.1, "-o", tmp_path / "report")
    assert "40 x 30 x 20" in truefield.refused(*words, "--above", 20.5)
    assert sorted(tmp_path.iterdir()) == [block]


def test_the_report_is_the_library_s_answer(truefield: Command, block: Path, tmp_path: Path) -> None:
    truefield.done("thickness", block, "--above", 15, "--tolerance", 0.2, "-o", tmp_path / "report", "--threads", 1)
    report = tf.thickness(tf.read(block), tolerance=0.2, above=15.0)
    assert (tmp_path / "report" / "report.json").read_text() == report.to_json()


def test_a_part_without_inside_has_no_thickness(truefield: Command, block: Path, tmp_path: Path) -> None:
    part = tf.shapes.box((40.0, 30.0, 20.0))
    part.write(tmp_path / "block.ply")
    words = ("thickness", tmp_path / "block.ply", "--tolerance", 0.1, "-o", tmp_path / "report", "--sign", "unsigned")
    truefield.refused(*words)
    assert sorted(tmp_path.iterdir()) == sorted([block, tmp_path / "block.ply"])
