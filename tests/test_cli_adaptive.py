"""`truefield adaptive`, and what other commands make of its files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import truefield as tf
from commands import Command
from PIL import Image
from solids import blob


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    blob().write(tmp_path / "blob.ply")
    return tmp_path


@pytest.mark.parametrize("how", [{}, {"rule": "samples"}, {"method": "exact"}, {"growth": float("inf")}])
def test_a_tree_is_the_library_s(truefield: Command, folder: Path, how: dict[str, Any]) -> None:
    words = [word for name, value in how.items() for word in (f"--{name}", value)]
    said = truefield.done("adaptive", folder / "blob.ply", "--tolerance", 0.01, "-o", folder / "a.tfield", *words)
    assert "leaves" in said
    assert "sign rule: pseudonormal" in said
    tf.adaptive_field(tf.read(folder / "blob.ply"), 0.01, **how).save(folder / "b.tfield")
    assert (folder / "a.tfield").read_bytes() == (folder / "b.tfield").read_bytes()


def test_a_tree_becomes_a_surface_and_a_picture(truefield: Command, folder: Path) -> None:
    truefield.done("adaptive", folder / "blob.ply", "--tolerance", 0.01, "-o", folder / "a.tfield")
    truefield.done("surface", folder / "a.tfield", "--offset", 0.05, "-o", folder / "grown.stl")
    part, grown = tf.read(folder / "blob.ply"), tf.read(folder / "grown.stl")
    assert grown.check().watertight
    assert (grown.extent[1] > part.extent[1]).all()
    truefield.done("render", folder / "a.tfield", "--size", "80x64", "-o", folder / "a.png")
    with Image.open(folder / "a.png") as image:
        assert image.size == (80, 64)


def test_a_surface_is_grown_as_far_as_the_margin(truefield: Command, folder: Path) -> None:
    part = tf.read(folder / "blob.ply")
    size = float((part.extent[1] - part.extent[0]).max())
    truefield.done("adaptive", folder / "blob.ply", "--tolerance", 0.02 * size, "-o", folder / "a.tfield")
    words = ("surface", folder / "a.tfield", "--offset", 0.4 * size, "-o", folder / "grown.stl")
    status, _, said = truefield(*words)
    assert status == 2
    assert "domain" in said
    assert not (folder / "grown.stl").exists()
    more = ("--margin", 0.5 * size)
    truefield.done("adaptive", folder / "blob.ply", "--tolerance", 0.02 * size, "-o", folder / "a.tfield", *more)
    truefield.done(*words)
    grown = tf.read(folder / "grown.stl")
    away = tf.Surface(part).distance(grown.vertices)
    assert abs(away - 0.4 * size).max() < 0.06 * size


def test_what_cannot_be_done_is_a_sentence(truefield: Command, folder: Path) -> None:
    truefield.done("adaptive", folder / "blob.ply", "--tolerance", 0.05, "-o", folder / "a.tfield")
    (folder / "cut.tfield").write_bytes((folder / "a.tfield").read_bytes()[:3000])
    for words in (
        ("adaptive", folder / "blob.ply", "--tolerance", -1, "-o", folder / "b.tfield"),
        ("adaptive", folder / "blob.ply", "--tolerance", 1, "-o", folder / "b.stl"),
        ("adaptive", folder / "blob.ply", "--tolerance", 1, "--margin", -1, "-o", folder / "b.tfield"),
        ("adaptive", folder / "none.ply", "--tolerance", 1, "-o", folder / "b.tfield"),
        ("surface", folder / "a.tfield", "--offset", -999, "-o", folder / "b.stl"),
        ("render", folder / "cut.tfield", "-o", folder / "b.png"),
        ("thickness", folder / "a.tfield", "--above", 1, "--tolerance", 0.1, "-o", folder / "b"),
    ):
        status, _, said = truefield(*words)
        assert status == 2, words
        assert said.startswith("truefield: ")
        assert said.count("\n") == 1
    for words in (
        ("surface", folder / "blob.ply", "-o", folder / "b.stl"),
        ("render", folder / "blob.ply", "-o", folder / "b.png"),
    ):
        assert "blob.ply' is a mesh; make a field of it first" in truefield.refused(*words)
    assert not list(folder.glob("b.*"))
