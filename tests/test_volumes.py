"""Volumes and their files: what goes in comes out, and what is wrong is one sentence."""

from __future__ import annotations

import base64
import gzip
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import truefield as tf
from numpy.typing import NDArray

ANYWHERE = (".nrrd", ".nii", ".nii.gz", ".npz", ".vti", ".zarr")
KINDS = {
    ".nrrd": "u1 i1 u2 i2 u4 i4 u8 i8 f4 f8 ?",
    ".nii": "u1 i1 u2 i2 u4 i4 u8 i8 f4 f8 ?",
    ".nii.gz": "i2 f4",
    ".vti": "u1 i1 u2 i2 u4 i4 u8 i8 f4 f8 ?",
    ".npz": "u1 i2 f4 f8 ? f2",
    ".npy": "u1 i2 f4 f8 ? f2",
    ".zarr": "u1 i2 f4 f8 ?",
    ".tif": "u1 u2 i4 f4 ?",
    ".png": "u1 u2 ?",
}
ODD = {"origin": (0.1, -1e3 / 3, 1e-7), "spacing": (0.1, 1 / 3, 12.5)}
TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]]) * np.array([[0.1], [1 / 3], [2.0]])


def samples(kind: str, shape: tuple[int, ...] = (5, 4, 3)) -> NDArray[Any]:
    random = np.random.default_rng(7)
    dtype = np.dtype(kind)
    if dtype.kind == "f":
        return random.normal(size=shape).astype(dtype)
    if dtype.kind == "b":
        return random.random(shape) < 0.5
    limits = np.iinfo(dtype)
    return random.integers(limits.min, limits.max, shape, dtype, endpoint=True)


def same(a: tf.Volume, b: tf.Volume) -> None:
    assert (a.shape, a.space) == (b.shape, b.space)
    np.testing.assert_array_equal(a.values, b.values)
    np.testing.assert_array_equal(a.origin, b.origin)
    np.testing.assert_array_equal(a.directions, b.directions)


def written(volume: tf.Volume, folder: Path, suffix: str) -> tf.Volume:
    if suffix == ".zarr":
        pytest.importorskip("zarr")
    volume.write(folder / f"a{suffix}")
    return tf.read_volume(folder / f"a{suffix}")


@pytest.mark.parametrize(("suffix", "kind"), [(s, k) for s, kinds in KINDS.items() for k in kinds.split()])
def test_every_type_comes_back(tmp_path: Path, suffix: str, kind: str) -> None:
    shape = (5, 4) if suffix == ".png" else (5, 4, 3)
    volume = tf.Volume(samples(kind, shape))
    back = written(volume, tmp_path, suffix)
    same(volume, back)
    # Formats without booleans give 0 and 1.
    assert back.values.dtype == (volume.values.dtype if kind != "?" or suffix in (".npz", ".npy", ".zarr") else "u1")
    if suffix != ".zarr":
        back.write(tmp_path / f"b{suffix}")
        assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()


@pytest.mark.parametrize("space", ["", "RAS", "LPS"])
@pytest.mark.parametrize("suffix", [*ANYWHERE, ".tif"])
def test_every_place_comes_back(tmp_path: Path, suffix: str, space: str) -> None:
    where: dict[str, Any]
    for number, where in enumerate(
        ({}, ODD, {"origin": (1, 2, 3), "directions": TURN}, {"directions": -TURN[[1, 2, 0]]})
    ):
        folder = tmp_path / str(number)
        folder.mkdir()
        volume = tf.Volume(samples("f4"), space=space, **where)
        same(volume, written(volume, folder, suffix))


@pytest.mark.parametrize("suffix", [".nrrd", ".nii", ".npz", ".tif", ".zarr"])
def test_images_come_back(tmp_path: Path, suffix: str) -> None:
    volume = tf.Volume(samples("u2", (7, 3)), (0.1, 5), (1 / 3, 2))
    same(volume, written(volume, tmp_path, suffix))


def test_a_png_keeps_its_place_beside_its_picture(tmp_path: Path) -> None:
    volume = tf.Volume(samples("u1", (7, 3)), (0.1, 5), (1 / 3, 2))
    same(volume, written(volume, tmp_path, ".png"))


@pytest.mark.parametrize("suffix", [*ANYWHERE, ".tif", ".npy"])
@pytest.mark.parametrize("shape", [(1, 1, 1), (1, 70, 1), (65, 1, 2), (3, 1, 130)])
def test_thin_and_turned_arrays_come_back(tmp_path: Path, suffix: str, shape: tuple[int, int, int]) -> None:
    values = samples("f4", shape)
    backwards = samples("f4", shape[::-1]).T[:, ::-1]
    volume = tf.Volume(values)
    if suffix == ".tif" and shape[2] == 1:
        # One picture is an image.
        assert written(volume, tmp_path, suffix).shape == shape[:2]
        return
    same(volume, written(volume, tmp_path, suffix))
    (tmp_path / "b").mkdir()
    same(tf.Volume(backwards), written(tf.Volume(backwards), tmp_path / "b", suffix))


def test_nrrd_of_others(tmp_path: Path) -> None:
    values = np.arange(24, dtype=np.int16).reshape(2, 3, 4)
    flat = values.ravel(order="F")
    head = "NRRD0005\n# a comment\ntype: short\ndimension: 3\nsizes: 2 3 4\nkey:=value\n"
    raw = flat.astype(">i2").tobytes()
    cases = {
        "big": (f"{head}endian: big\nencoding: raw\n\n", raw),
        "gzip": (f"{head}endian: big\nencoding: gzip\n\n", gzip.compress(raw)),
        "text": (f"{head}encoding: ascii\n\n", " ".join(map(str, flat)).encode()),
        "skip": (f"{head}endian: big\nencoding: raw\nbyte skip: -1\n\n", b"something before" + raw),
        "crlf": (f"{head}endian: big\nencoding: raw\n\n".replace("\n", "\r\n"), raw),
    }
    for name, (header, data) in cases.items():
        (tmp_path / f"{name}.nrrd").write_bytes(header.encode() + data)
        np.testing.assert_array_equal(tf.read_volume(tmp_path / f"{name}.nrrd").values, values)
    (tmp_path / "samples.raw").write_bytes(raw)
    (tmp_path / "apart.nrrd").write_text(f"{head}endian: big\nencoding: raw\ndata file: samples.raw\n")
    np.testing.assert_array_equal(tf.read_volume(tmp_path / "apart.nrrd").values, values)
    placed = "space: left-posterior-superior\nspace directions: (0,2,0) (-1,0,0) (0,0,3)\nspace origin: (1,2,3)\n"
    (tmp_path / "placed.nrrd").write_bytes(f"{head}endian: big\nencoding: raw\n{placed}\n".encode() + raw)
    volume = tf.read_volume(tmp_path / "placed.nrrd")
    assert (volume.space, volume.origin.tolist(), volume.spacing.tolist()) == ("LPS", [1, 2, 3], [2, 1, 3])
    assert volume.axes.tolist() == [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]
    spaced = "spacings: 0.5 2 NaN\naxis mins: 1 NaN 3\n"
    (tmp_path / "spaced.nrrd").write_bytes(f"{head}endian: big\nencoding: raw\n{spaced}\n".encode() + raw)
    volume = tf.read_volume(tmp_path / "spaced.nrrd")
    assert (volume.origin.tolist(), volume.spacing.tolist()) == ([1, 0, 3], [0.5, 2, 1])


def nifti(order: str, **fields: tuple[int, str, tuple[float, ...]]) -> bytes:
    header = bytearray(352)
    struct.pack_into(order + "i", header, 0, 348)
    header[344:348] = b"n+1\0"
    struct.pack_into(order + "8h", header, 40, 4, 2, 3, 4, 1, 1, 1, 1)
    struct.pack_into(order + "2h", header, 70, 4, 16)
    struct.pack_into(order + "8f", header, 76, 1, 0.5, 2, 3, 0, 0, 0, 0)
    struct.pack_into(order + "f", header, 108, 352)
    for at, form, values in fields.values():
        struct.pack_into(order + form, header, at, *values)
    return bytes(header) + np.arange(24, dtype=order + "i2").tobytes()


@pytest.mark.parametrize("order", ["<", ">"])
def test_nifti_of_others(tmp_path: Path, order: str) -> None:
    file = tmp_path / "a.nii"
    values = np.arange(24).reshape(4, 3, 2).T
    file.write_bytes(nifti(order))
    plain = tf.read_volume(file)
    np.testing.assert_array_equal(plain.values, values)
    assert plain.values.dtype == np.int16
    assert (plain.spacing.tolist(), plain.space) == ([0.5, 2, 3], "")
    # Half a turn about z, with the third axis against it.
    turned = {"codes": (252, "2h", (1, 0)), "quatern": (256, "6f", (0, 0, 1, 7, 8, 9)), "pixdim": (76, "f", (-1,))}
    file.write_bytes(nifti(order, **turned))
    volume = tf.read_volume(file)
    assert volume.directions.tolist() == [[-0.5, 0, 0], [0, -2, 0], [0, 0, -3]]
    assert (volume.origin.tolist(), volume.space) == ([7, 8, 9], "RAS")
    placed = {"codes": (252, "2h", (1, 2)), "srow": (280, "12f", (0, 2, 0, 7, -1, 0, 0, 8, 0, 0, 3, 9))}
    file.write_bytes(gzip.compress(nifti(order, **placed, slope=(112, "2f", (2, 10)))))
    volume = tf.read_volume(file)
    assert volume.directions.tolist() == [[0, -1, 0], [2, 0, 0], [0, 0, 3]]
    np.testing.assert_array_equal(volume.values, values * 2.0 + 10)


def test_a_nifti_moved_by_others_is_where_they_put_it(tmp_path: Path) -> None:
    volume = tf.Volume(samples("f4"), **ODD)  # type: ignore[arg-type]
    volume.write(tmp_path / "a.nii")
    data = bytearray((tmp_path / "a.nii").read_bytes())
    struct.pack_into("<f", data, 280 + 12, 55.0)
    (tmp_path / "a.nii").write_bytes(data)
    assert tf.read_volume(tmp_path / "a.nii").origin[0] == 55.0


@pytest.mark.parametrize("word", ["UInt32", "UInt64"])
@pytest.mark.parametrize("order", ["<", ">"])
def test_vti_of_others(tmp_path: Path, word: str, order: str) -> None:
    values = np.arange(24, dtype="f4").reshape(4, 3, 2).T
    flat = np.arange(24, dtype=order + "f4").tobytes()
    count = np.dtype(order + ("u4" if word == "UInt32" else "u8"))
    plain = base64.b64encode(np.array([len(flat)], count).tobytes() + flat).decode()
    parts = [zlib.compress(flat[:64]), zlib.compress(flat[64:])]
    head = np.array([2, 64, 32, *map(len, parts)], count).tobytes()
    packed = (base64.b64encode(head) + base64.b64encode(b"".join(parts))).decode()
    endian = "LittleEndian" if order == "<" else "BigEndian"

    def file(array: str, compressor: str = "", appended: bytes = b"") -> bytes:
        start = f'<VTKFile type="ImageData" byte_order="{endian}" header_type="{word}"{compressor}>'
        grid = 'WholeExtent="1 2 0 2 0 3" Origin="10 20 30" Spacing="0.5 2 3"'
        inner = f'<Piece Extent="1 2 0 2 0 3"><PointData>{array}</PointData></Piece>'
        return f"{start}<ImageData {grid}>{inner}</ImageData>".encode() + appended + b"</VTKFile>"

    zlibbed = ' compressor="vtkZLibDataCompressor"'
    ascii_ = " ".join(map(str, range(24)))
    array = '<DataArray type="Float32" Name="d" format="{}"{}>{}</DataArray>'
    raw = b'<AppendedData encoding="raw">\n_' + b"1234" + np.array([96], count).tobytes() + flat + b"</AppendedData>"
    cases = {
        "ascii": file(array.format("ascii", "", ascii_)),
        "binary": file(array.format("binary", "", f"\n  {plain}\n ")),
        "packed": file(array.format("binary", "", packed), zlibbed),
        "raw": file(array.format("appended", ' offset="4"', ""), "", raw),
        "raw packed": file(
            array.format("appended", ' offset="0"', ""),
            zlibbed,
            b'<AppendedData encoding="raw">_' + head + b"".join(parts) + b"</AppendedData>",
        ),
        "base64": file(
            array.format("appended", ' offset="0"', ""),
            "",
            b'<AppendedData encoding="base64">_' + plain.encode() + b"</AppendedData>",
        ),
    }
    for name, data in cases.items():
        (tmp_path / "a.vti").write_bytes(data)
        volume = tf.read_volume(tmp_path / "a.vti")
        np.testing.assert_array_equal(volume.values, values, err_msg=name)
        # The first point is number 1 along x.
        assert (volume.origin.tolist(), volume.spacing.tolist()) == ([10.5, 20, 30], [0.5, 2, 3])


def test_compression_that_is_not_known_is_named(tmp_path: Path) -> None:
    test_vti_of_others(tmp_path, "UInt64", "<")
    data = (tmp_path / "a.vti").read_bytes().replace(b"<VTKFile ", b'<VTKFile compressor="vtkLZ4DataCompressor" ')
    (tmp_path / "a.vti").write_bytes(data)
    with pytest.raises(tf.FileError, match=r"a\.vti': it is compressed by vtkLZ4"):
        tf.read_volume(tmp_path / "a.vti")


def test_imagej_stacks_have_their_spacing(tmp_path: Path) -> None:
    from PIL import Image

    pages = [Image.fromarray(np.full((4, 5), i, np.uint16)) for i in range(3)]
    tags = {270: "ImageJ=1.53t\nimages=3\nslices=3\nunit=mm\nspacing=2.5\n", 282: 2.0, 283: 4.0}
    pages[0].save(tmp_path / "a.tif", save_all=True, append_images=pages[1:], tiffinfo=tags)
    volume = tf.read_volume(tmp_path / "a.tif")
    assert volume.shape == (5, 4, 3)
    assert volume.spacing.tolist() == [0.5, 0.25, 2.5]
    assert volume.values[0, 0].tolist() == [0, 1, 2]


def test_other_programs_read_what_is_written(tmp_path: Path) -> None:
    """Where VTK is installed, it says the same of a .vti."""
    vtk = pytest.importorskip("vtk")
    volume = tf.Volume(samples("f4"), (1, 2, 3), directions=TURN, name="a & <b>")
    volume.write(tmp_path / "a.vti")
    reader = vtk.vtkXMLImageDataReader()
    reader.SetFileName(str(tmp_path / "a.vti"))
    reader.Update()
    image = reader.GetOutput()
    assert image.GetDimensions() == (5, 4, 3)
    assert image.GetPointData().GetScalars().GetName() == "a & <b>"
    for index in np.ndindex(5, 4, 3):
        number = image.ComputePointId(index)
        assert image.GetPointData().GetScalars().GetValue(number) == volume.values[index]
        np.testing.assert_allclose(image.GetPoint(number), volume.origin + index @ TURN, atol=1e-12)


@pytest.mark.parametrize("suffix", [".nrrd", ".nii", ".nii.gz", ".vti", ".npz", ".npy", ".tif", ".png"])
def test_damaged_files_are_one_sentence(tmp_path: Path, suffix: str) -> None:
    place = {} if suffix in (".npy", ".png") else ODD
    volume = tf.Volume(samples("u2", (9, 8) if suffix == ".png" else (9, 8, 7)), **place)  # type: ignore[arg-type]
    volume.write(tmp_path / f"a{suffix}")
    good = (tmp_path / f"a{suffix}").read_bytes()
    file = tmp_path / f"b{suffix}"
    random = np.random.default_rng(3)
    said: list[str] = []
    for n in range(300):
        bad = bytearray(good)
        if n % 3 == 0:
            del bad[int(random.integers(len(bad))) :]
        else:
            at = int(random.integers(len(bad) if n % 3 == 1 else min(len(bad), 400)))
            bad[at] = int(random.integers(256))
        file.write_bytes(bad)
        try:
            tf.read_volume(file)
        except tf.FileError as error:
            said.append(str(error))
    assert len(said) > 80
    assert all(str(file) in sentence and "\n" not in sentence for sentence in said)


HEAD = "NRRD0004\ntype: float\ndimension: 3\nsizes: 2 2 2\nencoding: raw\nendian: little\n"


@pytest.mark.parametrize(
    ("content", "named"),
    [
        ("NRRD9\n\n", "begin"),
        (HEAD.replace("type: float\n", "") + "\n", "'type'"),
        (HEAD.replace("float", "block") + "\n", "block"),
        (HEAD.replace("dimension: 3", "dimension: 4") + "\n", "4"),
        (HEAD.replace("dimension: 3", "dimension: three") + "\n", "three"),
        (HEAD.replace("2 2 2", "2 2 0") + "\n", "positive"),
        (HEAD.replace("2 2 2", "2 2 inf") + "\n", "sizes"),
        (HEAD.replace("2 2 2", "2 2 1.5") + "\n", "sizes"),
        (HEAD.replace("2 2 2", "99999 99999 99999999") + "\n", "truncated|memory"),
        (HEAD.replace("endian: little\n", "") + "\n", "endian"),
        (HEAD.replace("raw", "hex") + "\n", "hex"),
        (HEAD + "nonsense\n\n", "nonsense"),
        (HEAD + "type: float\n\n", "two fields"),
        (HEAD + "spacings: 1 2\n\n", "spacings"),
        (HEAD + "spacings: 1 0 1\n\n" + "\0" * 32, "spacing"),
        (HEAD + "space directions: (1,0,0) (0,1,0)\n\n", "directions"),
        (HEAD + "space directions: none (0,1,0) (0,0,1)\n\n", "vector"),
        (HEAD + "space directions: (1,0,0) (0,1,0) (1,1,0)\n\n" + "\0" * 32, "independent"),
        (HEAD + "space origin: (1,2)\n\n", "origin"),
        (HEAD + "data file: ../b.raw\n\n", "outside"),
        (HEAD + "data file: /etc/passwd\n\n", "outside"),
        (HEAD + "data file: b.raw\n\n", "b.raw"),
        (HEAD + "data file: LIST\n\n", "several"),
        (HEAD + "\n" + "\0" * 31, "truncated"),
        (HEAD + "\n" + "\0" * 33, "more"),
    ],
)
def test_wrong_headers_say_what_is_wrong(tmp_path: Path, content: str, named: str) -> None:
    file = tmp_path / "a.nrrd"
    file.write_bytes(content.encode())
    with pytest.raises(tf.FileError, match=named):
        tf.read_volume(file)


def test_what_a_format_cannot_hold_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    flat, solid = samples("u1", (4, 3)), samples("u1")
    for volume, name, named in [
        (tf.Volume(solid, (1, 0, 0)), "a.npy", "npz"),
        (tf.Volume(flat), "a.vti", "image"),
        (tf.Volume(solid), "a.png", "one image"),
        (tf.Volume(samples("f8")), "a.tif", "float64"),
        (tf.Volume(samples("f4", (4, 3))), "a.png", "float32"),
        (tf.Volume(samples("f2")), "a.nrrd", "float16"),
        (tf.Volume(samples("f2")), "a.nii", "float16"),
        (tf.Volume(solid, space="somewhere"), "a.nii", "somewhere"),
        (tf.Volume(flat, space="RAS"), "a.nrrd", "RAS"),
        (tf.Volume(solid), "a.stl", "suffix"),
        (tf.Volume(solid), "none/a.nrrd", "none"),
    ]:
        with pytest.raises(tf.FileError, match=named):
            volume.write(tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_files_that_are_none(tmp_path: Path) -> None:
    for name, named in [("a.nrrd", "no such file"), ("a.stl", "no such file")]:
        with pytest.raises(tf.FileError, match=named):
            tf.read_volume(tmp_path / name)
    (tmp_path / "a.stl").write_text("solid")
    with pytest.raises(tf.FileError, match="nrrd"):
        tf.read_volume(tmp_path / "a.stl")
    (tmp_path / "b.nii").mkdir()
    with pytest.raises(tf.FileError, match="folder"):
        tf.read_volume(tmp_path / "b.nii")


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"values": np.zeros(3)}, "shape"),
        ({"values": np.zeros((2, 0))}, "shape"),
        ({"values": np.zeros((2, 2), complex)}, "complex"),
        ({"values": [["a", "b"]]}, "type"),
        ({"origin": (1, 2, 3)}, "origin"),
        ({"origin": (np.nan, 0)}, "origin"),
        ({"spacing": (1, 0)}, "spacing"),
        ({"spacing": (1, -1)}, "spacing"),
        ({"spacing": 1, "directions": np.eye(2)}, "not both"),
        ({"directions": np.eye(3)}, "directions"),
        ({"directions": np.ones((2, 2))}, "independent"),
        ({"directions": np.zeros((2, 2))}, "independent"),
    ],
)
def test_bad_volumes_are_one_sentence(arguments: dict[str, Any], named: str) -> None:
    with pytest.raises(tf.TruefieldError, match=named) as caught:
        tf.Volume(**({"values": np.zeros((2, 2))} | arguments))
    assert "\n" not in str(caught.value)


def test_fields_go_to_files_and_come_back(tmp_path: Path) -> None:
    field = tf.Surface(tf.shapes.sphere()).sample(resolution=20)
    for suffix in (".nrrd", ".vti", ".nii"):
        field.volume().write(tmp_path / f"a{suffix}")
        volume = tf.read_volume(tmp_path / f"a{suffix}")
        again = tf.SampledField.from_volume(volume, error=1e-6)
        np.testing.assert_array_equal(again.values, field.values)
        np.testing.assert_array_equal(again.origin, field.origin)
        np.testing.assert_array_equal(again.spacing, field.spacing)
    with pytest.raises(tf.TruefieldError, match="turned"):
        tf.SampledField.from_volume(tf.Volume(samples("f4"), directions=TURN))
    with pytest.raises(tf.TruefieldError, match="image"):
        tf.SampledField.from_volume(tf.Volume(samples("f4", (4, 3))))


def test_a_volume_holds_other_values_at_its_places() -> None:
    volume = tf.Volume(samples("u1"), (1, 2, 3), directions=TURN, space="LPS", name="scan")
    other = volume.holding(samples("f4"))
    assert other.directions.tolist() == volume.directions.tolist()
    assert (other.space, other.name, other.values.dtype.name) == ("LPS", "scan", "float32")
    with pytest.raises(tf.TruefieldError, match="shape"):
        volume.holding(samples("f4", (3, 4, 5)))
    assert not volume.values.flags.writeable
    assert "5 x 4 x 3" in repr(volume)


def test_a_tiff_beyond_four_gigabytes_has_far_offsets(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from truefield.formats.volumes import tiff

    volume = tf.Volume(samples("u2", (9, 8, 7)), **ODD)  # type: ignore[arg-type]
    monkeypatch.setattr(tiff, "_FAR", 100)
    same(volume, written(volume, tmp_path, ".tif"))
    assert (tmp_path / "a.tif").read_bytes()[:4] == b"II+\0"
