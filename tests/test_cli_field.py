from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import truefield as tf
from commands import Command
from solids import blob


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    blob().write(tmp_path / "blob.ply")
    np.save(tmp_path / "probes.npy", np.random.default_rng(3).uniform(-0.4, 0.4, (300, 3)))
    return tmp_path


def test_a_field_is_the_library_s(truefield: Command, folder: Path) -> None:
    said = truefield.done("field", folder / "blob.ply", "--resolution", 17, "-o", folder / "a.tfield", "--threads", 2)
    assert "17 x " in said
    assert "sign rule: pseudonormal" in said
    tf.complete_field(tf.read(folder / "blob.ply"), resolution=17).save(folder / "b.tfield")
    assert (folder / "a.tfield").read_bytes() == (folder / "b.tfield").read_bytes()


def test_cell_size_region_and_sign_are_kept(truefield: Command, folder: Path) -> None:
    words = ("--cell-size", 0.05, "--region", "inside", "--sign", "winding", "-o", folder / "a.tfield")
    truefield.done("field", folder / "blob.ply", *words)
    field = tf.load(folder / "a.tfield")
    assert isinstance(field, tf.CompleteField)
    assert (field.cell_size, field.region, field.surface.sign) == (0.05, "inside", "winding")
    assert field.mesh.name == "blob"


def test_a_field_is_asked_in_place_of_its_mesh(truefield: Command, folder: Path) -> None:
    truefield.done("field", folder / "blob.ply", "--resolution", 12, "-o", folder / "blob.tfield")
    for part in ("ply", "tfield"):
        file = folder / f"blob.{part}"
        truefield.done("distance", file, "-p", folder / "probes.npy", "-o", folder / f"distances-{part}.csv")
        truefield.done("contour", file, "--depth", 0.1, "--tolerance", 0.02, "-o", folder / f"shell-{part}.ply")
    assert (folder / "distances-ply.csv").read_text() == (folder / "distances-tfield.csv").read_text()
    assert (folder / "shell-ply.ply").read_bytes() == (folder / "shell-tfield.ply").read_bytes()


@pytest.mark.parametrize("option", [("--sign", "winding"), ("--weld", "0.1")])
def test_a_field_keeps_its_mesh_and_sign_rule(truefield: Command, folder: Path, option: tuple[str, str]) -> None:
    tf.complete_field(tf.read(folder / "blob.ply"), resolution=5).save(folder / "blob.tfield")
    words = ("distance", folder / "blob.tfield", "-p", folder / "probes.npy", "-o", folder / "out.csv", *option)
    assert option[0] in truefield.refused(*words)
    assert not (folder / "out.csv").exists()


def test_samples_are_no_part(truefield: Command, folder: Path) -> None:
    tf.Surface(tf.read(folder / "blob.ply")).sample(resolution=5).save(folder / "samples.tfield")
    words = ("distance", folder / "samples.tfield", "-p", folder / "probes.npy", "-o", folder / "out.csv")
    assert "samples" in truefield.refused(*words)


def test_a_damaged_field_is_one_sentence(truefield: Command, folder: Path) -> None:
    tf.complete_field(tf.read(folder / "blob.ply"), resolution=5).save(folder / "blob.tfield")
    data = (folder / "blob.tfield").read_bytes()
    words = ("distance", folder / "blob.tfield", "-p", folder / "probes.npy", "-o", folder / "out.csv")
    for bad, named in [(data[:-9], "truncated"), (data[:-1] + b"\0", "damaged"), (b"solid", "not a truefield field")]:
        (folder / "blob.tfield").write_bytes(bad)
        assert named in truefield.refused(*words)
        assert not (folder / "out.csv").exists()


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (("--resolution", 0), "resolution"),
        (("--resolution", 10**9), "cells"),
        (("--cell-size", -1), "cell_size"),
        (("--cell-size", "nan"), "cell_size"),
        (("--resolution", 5, "--cell-size", 1), "not both"),
        (("--region", "nowhere"), "--region"),
        (("-o", "out.stl"), ".tfield"),
        (("-o", "none/out.tfield"), "none"),
    ],
)
def test_bad_options(truefield: Command, folder: Path, options: tuple[object, ...], named: str) -> None:
    out = () if "-o" in options else ("-o", folder / "out.tfield")
    assert named in truefield.refused("field", folder / "blob.ply", *out, *options)
    assert not list(folder.glob("*.tfield"))
