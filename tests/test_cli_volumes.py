"""`truefield sample`, `transform` and `surface`: volumes in and out."""

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
    values = np.zeros((20, 15, 10), np.uint8)
    values[4:9, 3:12, 2:8] = 200
    values[12:18, 5:9, 3:6] = 100
    turned = np.array([[0.0, 0.5, 0.0], [-0.25, 0.0, 0.0], [0.0, 0.0, 2.0]])
    tf.Volume(values, (1, 2, 3), directions=turned, space="LPS").write(tmp_path / "scan.nrrd")
    tf.Volume(values[:, :, 5], spacing=(0.5, 2.0)).write(tmp_path / "slice.png")
    return tmp_path


def test_samples_are_the_library_s(truefield: Command, folder: Path) -> None:
    words = ("--resolution", 17, "--margin", 0.1, "--band", 0.2, "--threads", 2)
    lower, upper = folder / "lower.npz", folder / "upper.npz"
    said = truefield.done(
        "sample", folder / "blob.ply", *words, "-o", folder / "a.vti", "--lower", lower, "--upper", upper
    )
    assert "17 x " in said
    assert "sign rule: pseudonormal" in said
    field = tf.Surface(tf.read(folder / "blob.ply")).sample(resolution=17, margin=0.1, band=0.2)
    made = tf.read_volume(folder / "a.vti")
    np.testing.assert_array_equal(made.values, field.values)
    np.testing.assert_array_equal(made.origin, field.origin)
    np.testing.assert_array_equal(made.spacing, field.spacing)
    np.testing.assert_array_equal(tf.read_volume(lower).values, field.lower)
    np.testing.assert_array_equal(tf.read_volume(upper).values, field.upper)


def test_a_wavefront_has_its_bounds(truefield: Command, folder: Path) -> None:
    lower, upper = folder / "lower.npz", folder / "upper.npz"
    words = ("--resolution", 17, "--method", "wavefront", "--lower", lower, "--upper", upper)
    truefield.done("sample", folder / "blob.ply", *words, "-o", folder / "a.vti")
    field = tf.sampled_field(tf.read(folder / "blob.ply"), 17, method="wavefront")
    for file, array in (("a.vti", field.values), ("lower.npz", field.lower), ("upper.npz", field.upper)):
        np.testing.assert_array_equal(tf.read_volume(folder / file).values, array)


def test_a_part_becomes_samples_and_a_mesh_again(truefield: Command, folder: Path) -> None:
    truefield.done("sample", folder / "blob.ply", "--spacing", 0.02, "--margin", 0.1, "-o", folder / "a.nrrd")
    said = truefield.done("surface", folder / "a.nrrd", "-o", folder / "a.stl")
    assert "triangles" in said
    part, mesh = tf.read(folder / "blob.ply"), tf.read(folder / "a.stl")
    assert mesh.check().watertight
    assert np.abs(tf.Surface(part).distance(mesh.vertices)).max() < 0.02
    assert "border" not in said
    assert "border" in truefield.done("surface", folder / "a.nrrd", "--distance", 9, "-o", folder / "c.ply")
    truefield.done("surface", folder / "a.nrrd", "--distance", 0.15, "--border", "open", "-o", folder / "b.ply")
    assert not tf.read(folder / "b.ply").check().watertight


def test_transforms_are_the_library_s(truefield: Command, folder: Path) -> None:
    scan = tf.read_volume(folder / "scan.nrrd")
    lower, upper = folder / "lower.nrrd", folder / "upper.nrrd"
    words = ("--signed", "--lower", lower, "--upper", upper, "--border", "background")
    said = truefield.done("transform", folder / "scan.nrrd", *words, "-o", folder / "a.nrrd")
    assert "20 x 15 x 10" in said
    expected = tf.distance_transform(
        scan.values, sampling=(0.5, 0.25, 2.0), signed=True, border="background", return_bounds=True
    )
    for file, array in (("a.nrrd", expected.distance), ("lower.nrrd", expected.lower), ("upper.nrrd", expected.upper)):
        made = tf.read_volume(folder / file)
        np.testing.assert_array_equal(made.values, array)
        np.testing.assert_array_equal(made.directions, scan.directions)
        np.testing.assert_array_equal(made.origin, scan.origin)
        assert made.space == "LPS"


def test_threshold_labels_and_faces(truefield: Command, folder: Path) -> None:
    scan = tf.read_volume(folder / "scan.nrrd")
    for words, values, options in [
        (("--threshold", 150), scan.values > 150, {}),
        (("--labels", "--periodic"), scan.values, {"target": "other_label", "periodic": True}),
        (("--surface", "between"), scan.values, {"surface": "between"}),
        (("--method", "marching"), scan.values, {"method": "marching"}),
    ]:
        truefield.done("transform", folder / "scan.nrrd", *words, "-o", folder / "a.npz")
        expected = tf.distance_transform(values, sampling=(0.5, 0.25, 2.0), **options)  # type: ignore[arg-type]
        np.testing.assert_array_equal(tf.read_volume(folder / "a.npz").values, expected)


def test_a_wavefront_says_how_many_passes_it_took(truefield: Command, folder: Path) -> None:
    said = truefield.done("transform", folder / "scan.nrrd", "--method", "wavefront", "-o", folder / "a.npz")
    scan = tf.read_volume(folder / "scan.nrrd")
    expected = tf.distance_transform(scan.values, sampling=(0.5, 0.25, 2.0), method="wavefront")
    assert f"{expected.passes} passes" in said
    np.testing.assert_array_equal(tf.read_volume(folder / "a.npz").values, expected.distance)


def test_an_image_becomes_a_picture_of_floats(truefield: Command, folder: Path) -> None:
    truefield.done("transform", folder / "slice.png", "-o", folder / "a.tif")
    made = tf.read_volume(folder / "a.tif")
    image = tf.read_volume(folder / "slice.png")
    np.testing.assert_array_equal(made.values, tf.distance_transform(image.values, sampling=(0.5, 2.0)))
    assert made.spacing.tolist() == [0.5, 2.0]


def test_nothing_to_be_near_to_is_said(truefield: Command, folder: Path) -> None:
    tf.Volume(np.ones((3, 4, 5), np.uint8)).write(folder / "full.npy")
    assert "infinite" in truefield.done("transform", folder / "full.npy", "-o", folder / "a.npy")
    assert np.isinf(tf.read_volume(folder / "a.npy").values).all()


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("sample", "blob.ply", "-o", "a.stl"), "suffix"),
        (("sample", "blob.ply", "-o", "a.png"), "a.png"),
        (("sample", "blob.ply", "-o", "a.npy"), "npz"),
        (("sample", "blob.ply", "-o", "none/a.vti"), "none"),
        (("sample", "blob.ply", "-o", "a.vti", "--resolution", 1), "resolution"),
        (("sample", "blob.ply", "-o", "a.vti", "--resolution", 5, "--spacing", 1), "not both"),
        (("sample", "blob.ply", "-o", "a.vti", "--band", -1), "band"),
        (("sample", "blob.ply", "-o", "a.vti", "--lower", "b.stl"), "suffix"),
        (("sample", "blob.ply", "-o", "a.vti", "--lower", "a.vti"), "a file of its own"),
        (("sample", "blob.ply", "-o", "a.vti", "--lower", "b.vti", "--upper", "./b.vti"), "a file of its own"),
        (("transform", "scan.nrrd", "-o", "a.vti", "--upper", "a.vti"), "a file of its own"),
        (("transform", "scan.nrrd", "-o", "a.vti", "--threshold", "nan"), "threshold"),
        (("transform", "blob.ply", "-o", "a.vti"), "nrrd"),
        (("transform", "none.nrrd", "-o", "a.vti"), "none.nrrd"),
        (("transform", "scan.nrrd", "-o", "a.npy"), "npz"),
        (("transform", "slice.png", "-o", "b.png"), "float32"),
        (("transform", "slice.png", "-o", "a.vti"), "image"),
        (("transform", "scan.nrrd", "-o", "a.nrrd", "--signed", "--labels"), "labels"),
        (("transform", "scan.nrrd", "-o", "a.nrrd", "--surface", "nowhere"), "--surface"),
        (("surface", "scan.nrrd", "-o", "a.stl"), "turned"),
        (("surface", "slice.png", "-o", "a.stl"), "image"),
        (("surface", "scan.nrrd", "-o", "a.vti"), "mesh"),
    ],
)
def test_bad_input_is_one_sentence(
    truefield: Command, folder: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[object, ...], named: str
) -> None:
    monkeypatch.chdir(folder)
    before = sorted(folder.iterdir())
    assert named in truefield.refused(*words)
    assert sorted(folder.iterdir()) == before
