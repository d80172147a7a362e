"""Every input that cannot be used: one sentence on stderr, exit status 2, nothing written."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import truefield as tf
from commands import Command
from solids import cube
from test_io import BAD_FILES

LINES = {
    "thickness": ["thickness", "{part}", "--above", "0.5", "--tolerance", "0.1", "--output", "{folder}/report"],
    "contour": ["contour", "{part}", "--depth", "0.2", "--tolerance", "0.1", "-o", "{folder}/out.ply"],
    "field": ["field", "{part}", "--resolution", "4", "-o", "{folder}/out.tfield"],
    "info": ["info", "{part}"],
    "distance": ["distance", "{part}", "--points", "{points}", "-o", "{folder}/out.csv"],
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "points.csv").write_text("x,y,z\n0.5,0.5,0.5\n")
    cube().write(tmp_path / "cube.stl")
    (tmp_path / "out").mkdir()
    return tmp_path


def line(command: str, folder: Path, part: Path | None = None, /, **changed: str) -> list[str]:
    """The command's line, with options replaced or added: `tolerance="-1"`."""
    places = {"part": part or folder / "cube.stl", "points": folder / "points.csv", "folder": folder / "out"}
    words = [word.format(**places) for word in LINES[command]]
    for name, value in changed.items():
        option = next((o for o in (f"--{name}", f"-{name[0]}") if o in words), None)
        if option is None:
            words += [f"--{name}", value]
        else:
            words[words.index(option) + 1] = value
    return words


@pytest.mark.parametrize("command", LINES)
@pytest.mark.parametrize(
    "bad", [case for case in BAD_FILES if case[0].split(".")[0] in ("empty", "cut", "nan", "range", "flat")]
)
def test_bad_parts(truefield: Command, folder: Path, command: str, bad: tuple[str, str | bytes, str]) -> None:
    name, content, _ = bad
    part = folder / name
    part.write_bytes(content.encode() if isinstance(content, str) else content)
    assert str(part) in truefield.refused(*line(command, folder, part))
    assert not list((folder / "out").iterdir())


@pytest.mark.parametrize("command", [command for command in LINES if command != "info"])
def test_empty_names(truefield: Command, folder: Path, monkeypatch: pytest.MonkeyPatch, command: str) -> None:
    monkeypatch.chdir(folder / "out")
    assert "the name is empty" in truefield.refused(*line(command, folder, output=""))
    assert "the name is empty" in truefield.refused(*line(command, folder)[:1], "", *line(command, folder)[2:])
    assert not list((folder / "out").iterdir())


@pytest.mark.parametrize("command", LINES)
@pytest.mark.parametrize("missing", ["none.stl", "none.step", "."])
def test_missing_parts(truefield: Command, folder: Path, command: str, missing: str) -> None:
    assert str(folder / missing) in truefield.refused(*line(command, folder, folder / missing))
    assert not list((folder / "out").iterdir())


@pytest.mark.parametrize(
    ("command", "option", "value", "named"),
    [
        ("contour", "tolerance", "0", "tolerance"),
        ("contour", "tolerance", "-1", "tolerance"),
        ("contour", "tolerance", "nan", "tolerance"),
        ("contour", "tolerance", "1e-30", "tolerance"),
        ("contour", "tolerance", "fine", "--tolerance"),
        ("contour", "depth", "nan", "NaN"),
        ("contour", "depth", "inf", "inf"),
        ("contour", "depth", "0.6", "0.6"),
        ("contour", "depth", "1e6", "depth"),
        ("contour", "threads", "0", "--threads"),
        ("contour", "sign", "guess", "--sign"),
        ("contour", "placement", "anywhere", "--placement"),
        ("thickness", "tolerance", "0", "tolerance"),
        ("thickness", "tolerance", "-0.1", "tolerance"),
        ("thickness", "tolerance", "nan", "tolerance"),
        ("thickness", "tolerance", "1e-30", "tolerance"),
        ("thickness", "above", "-1", "above"),
        ("thickness", "above", "nan", "above"),
        ("thickness", "above", "1000", "above"),
        ("thickness", "below", "0", "below"),
        ("thickness", "threads", "-1", "--threads"),
        ("distance", "threads", "0", "--threads"),
        ("distance", "sign", "guess", "--sign"),
        ("info", "sign", "guess", "--sign"),
        ("info", "weld", "-1", "within"),
        ("distance", "weld", "nan", "within"),
        ("distance", "weld", "50", "box"),
    ],
)
def test_bad_numbers(truefield: Command, folder: Path, *, command: str, option: str, value: str, named: str) -> None:
    assert named in truefield.refused(*line(command, folder, **{option: value}))
    assert not list((folder / "out").iterdir())


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("none.csv", None),
        ("empty.csv", b""),
        ("short.csv", b"1,2\n"),
        ("words.csv", b"one,two,three\n1,2,3\n"),
        ("nan.csv", b"0,0,nan\n"),
        ("points.docx", b"PK"),
        ("flat.npy", "npy"),
    ],
)
def test_bad_points(truefield: Command, folder: Path, name: str, content: bytes | str | None) -> None:
    points = folder / name
    if content == "npy":
        np.save(points, np.zeros((5, 2)))
    elif isinstance(content, bytes):
        points.write_bytes(content)
    assert str(points) in truefield.refused(*line("distance", folder, points=str(points)))
    assert not list((folder / "out").iterdir())


@pytest.mark.parametrize("command", ["distance", "contour", "thickness"])
@pytest.mark.parametrize("place", ["none/out.ply", "cube.stl/out.ply", "/proc/self/out.ply"])
def test_unwritable_places(truefield: Command, folder: Path, command: str, place: str) -> None:
    if place.startswith("/") and not Path(place).parent.is_dir():
        pytest.skip("no place that refuses every user")
    before = sorted(folder.rglob("*"))
    assert "out.ply" in truefield.refused(*line(command, folder, output=str(folder / place)))
    assert sorted(folder.rglob("*")) == before


@pytest.mark.parametrize(("command", "place"), [("distance", "out"), ("contour", "out"), ("thickness", "cube.stl")])
def test_a_file_for_a_folder_and_a_folder_for_a_file(
    truefield: Command, folder: Path, command: str, place: str
) -> None:
    sentence = truefield.refused(*line(command, folder, output=str(folder / place)))
    assert str(folder / place) in sentence
    assert len(tf.read(folder / "cube.stl").triangles) == 12


@pytest.mark.parametrize("command", ["distance", "contour"])
def test_unknown_kinds_of_output(truefield: Command, folder: Path, command: str) -> None:
    assert ".csv" in truefield.refused(*line(command, folder, output=str(folder / "out" / "out.xlsx")))


@pytest.mark.parametrize(
    "words",
    [
        ["frobnicate"],
        ["--frobnicate"],
        ["info"],
        ["info", "a.stl", "b.stl"],
        ["contour", "a.stl"],
        ["contour", "a.stl", "--depth"],
        ["distance"],
        ["distance", "a.stl", "--points"],
        ["distance", "a.stl", "-o", "x.csv"],
    ],
)
def test_wrong_usage(truefield: Command, words: list[str]) -> None:
    assert "--help" in truefield.refused(*words)


def test_version_and_help(truefield: Command) -> None:
    assert truefield.done("--version") == f"truefield {tf.__version__}\n"
    overview = truefield.done("--help")
    assert truefield.done() == overview
    for command in LINES:
        assert command in overview
        assert "--help" in truefield.done(command, "--help")


def test_as_a_program_of_its_own(folder: Path) -> None:
    words = [sys.executable, "-m", "truefield", *line("distance", folder, folder / "none.stl")]
    ended = subprocess.run(words, capture_output=True, text=True, check=False)
    assert ended.returncode == 2
    assert ended.stdout == ""
    assert ended.stderr == f"truefield: cannot read '{folder / 'none.stl'}': there is no such file; check the name\n"


def test_a_reader_that_goes_away_is_no_error(folder: Path) -> None:
    words = f"'{sys.executable}' -m truefield info '{folder / 'cube.stl'}' --json | true"
    ended = subprocess.run(words, shell=True, capture_output=True, text=True, check=False)
    assert ended.stderr == ""


def test_starting_loads_nothing_heavy() -> None:
    heavy = ("trimesh", "rich", "typer", "PIL")
    code = f"import sys, truefield, truefield.cli; print([name for name in {heavy} if name in sys.modules])"
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ended.stdout == "[]\n"
