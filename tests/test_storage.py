"""Saved and loaded: the same field bit for bit, and one sentence for every file that is none."""

from __future__ import annotations

import copy
import hashlib
import json
import os
import pickle
import stat
import struct
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import truefield as tf
from solids import blob, cube
from truefield import container, csg, storage

START = struct.Struct("<8sIIQ")


def open_blob() -> tf.TriangleMesh:
    part = blob()
    return tf.TriangleMesh(part.vertices, part.triangles[:-40], "blob with a hole")


def loaded(path: Path, threads: int | None = None) -> tf.CompleteField:
    field = tf.load(path, threads=threads)
    assert isinstance(field, tf.CompleteField)
    return field


def field_of(part: tf.TriangleMesh, **changed: Any) -> tf.CompleteField:
    return tf.complete_field(part, **{"resolution": 20, **changed})


def least_memory(part: tf.TriangleMesh) -> int:
    """A budget so small that many lists had to be cut."""
    return int(field_of(part).statistics()["bytes"] * 0.7)


FIELDS: dict[str, Callable[[], tf.CompleteField]] = {
    "cube": lambda: field_of(cube(), resolution=9),
    "one cell": lambda: field_of(cube(), resolution=1),
    "everywhere": lambda: field_of(blob()),
    "inside": lambda: field_of(blob(), region="inside"),
    "cut lists": lambda: field_of(blob(), memory=least_memory(blob())),
    "open": lambda: field_of(open_blob()),
    "open, inside": lambda: field_of(open_blob(), region="inside"),
    "winding": lambda: field_of(blob(), sign="winding"),
    "unsigned": lambda: field_of(blob(), sign="unsigned"),
    "cells given": lambda: field_of(blob(), resolution=None, cell_size=0.031),
    "far away": lambda: field_of(tf.TriangleMesh(blob().vertices + 1e6, blob().triangles)),
    "tiny": lambda: field_of(tf.TriangleMesh(blob().vertices * 1e-100, blob().triangles)),
    "another alphabet": lambda: field_of(
        tf.TriangleMesh(cube().vertices, cube().triangles, "Gehäuse 外壳 \udcff\n\"'")
    ),
}


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A small good file."""
    path = tmp_path_factory.mktemp("saved") / "blob.tfield"
    field_of(blob(5), resolution=5).save(path)
    return path.read_bytes()


def parts(data: bytes) -> tuple[dict[str, Any], bytes]:
    """Header and arrays."""
    length = START.unpack_from(data)[2]
    return json.loads(data[START.size : START.size + length]), data[START.size + length + 32 : -32]


def forged(header: Any, arrays: bytes) -> bytes:
    """A file whose lengths and checksums are right, whatever it holds."""
    text = header if isinstance(header, bytes) else json.dumps(header).encode()
    text += b" " * (-len(text) % 8)
    data = START.pack(container.MARK, container.VERSION, len(text), START.size + len(text) + 64 + len(arrays)) + text
    data += hashlib.blake2b(data, digest_size=32).digest() + arrays
    return data + hashlib.blake2b(data, digest_size=32).digest()


def refused(path: Path, data: bytes, named: str = "") -> str:
    """The sentence with which a file is refused."""
    path.write_bytes(data)
    with pytest.raises(tf.FileError) as caught:
        tf.load(path)
    sentence = str(caught.value)
    assert str(path) in sentence
    assert named in sentence
    assert "\n" not in sentence
    return sentence


@pytest.mark.parametrize("name", FIELDS)
def test_loaded_equals_saved_bit_for_bit(tmp_path: Path, name: str) -> None:
    field = FIELDS[name]()
    field.save(tmp_path / "a.tfield", threads=1)
    again = loaded(tmp_path / "a.tfield", threads=2)
    assert np.array_equal(again.mesh.vertices, field.mesh.vertices)
    assert np.array_equal(again.mesh.triangles, field.mesh.triangles)
    assert again.mesh.name == field.mesh.name
    assert again.surface.sign == field.surface.sign
    assert again.sign_rule == field.sign_rule
    assert np.array_equal(again.origin, field.origin)
    assert (again.cell_size, again.shape, again.region) == (field.cell_size, field.shape, field.region)
    assert again.statistics() == field.statistics()
    low, high = field.mesh.extent
    points = np.random.default_rng(7).uniform(low - 0.1 * (high - low), high + 0.1 * (high - low), (3000, 3))
    points = np.vstack([points, field.mesh.vertices])
    assert again.distance(points).tobytes() == field.distance(points).tobytes()
    assert np.array(again.bounds(points)).tobytes() == np.array(field.bounds(points)).tobytes()
    ours, theirs = again.nearest(points), field.nearest(points)
    for column in ("distance", "point", "triangle", "feature", "normal"):
        assert getattr(ours, column).tobytes() == getattr(theirs, column).tobytes(), column
    again.save(tmp_path / "b.tfield", threads=2)
    assert (tmp_path / "a.tfield").read_bytes() == (tmp_path / "b.tfield").read_bytes()


def test_the_fields_of_these_tests_cover_what_they_claim() -> None:
    assert FIELDS["cut lists"]().statistics()["long"] > FIELDS["everywhere"]().statistics()["long"]
    assert FIELDS["open"]().sign_rule.name == "winding"
    assert FIELDS["everywhere"]().sign_rule.name == "pseudonormal"
    assert FIELDS["inside"]().statistics()["listed"] < FIELDS["everywhere"]().statistics()["listed"]


def test_the_layout_is_the_one_described(saved: bytes, tmp_path: Path) -> None:
    mark, version, length, size = START.unpack_from(saved)
    assert (mark, version, length % 8, size) == (b"\x89TFIELD\n", 1, 0, len(saved))
    header, arrays = parts(saved)
    assert header["name"] == "blob"
    assert (header["sign"], header["sign_rule"], header["region"]) == ("auto", "pseudonormal", "everywhere")
    assert forged(header, arrays) == saved
    (tmp_path / "again.tfield").write_bytes(forged(header, arrays))
    field = loaded(tmp_path / "again.tfield")
    offset = 0
    for name, dtype, shape in header["arrays"]:
        assert offset % np.dtype(dtype).itemsize == 0
        array = np.frombuffer(arrays, dtype, int(np.prod(shape)), offset).reshape(shape)
        offset += array.nbytes
        if name == "vertices":
            assert np.array_equal(array, field.mesh.vertices)
    assert offset == len(arrays)


def test_progress_goes_from_phase_to_phase(tmp_path: Path) -> None:
    told: list[tuple[str, float]] = []
    field = field_of(blob())
    field.save(tmp_path / "blob.tfield", progress=lambda phase, fraction: told.append((phase, fraction)))
    assert told[-1] == ("write field", 1.0)
    told.clear()
    tf.load(tmp_path / "blob.tfield", progress=lambda phase, fraction: told.append((phase, fraction)))
    assert ("read field", 1.0) in told
    assert all(0.0 <= fraction <= 1.0 for _, fraction in told)


def test_a_wrong_argument_is_not_blamed_on_the_file(saved: bytes, tmp_path: Path) -> None:
    (tmp_path / "good.tfield").write_bytes(saved)
    with pytest.raises(tf.TruefieldError, match="threads must be at least 1") as caught:
        tf.load(tmp_path / "good.tfield", threads=0)
    assert not isinstance(caught.value, tf.FileError)


def test_every_damaged_byte_is_noticed(saved: bytes, tmp_path: Path) -> None:
    generator = np.random.default_rng(11)
    header_end = START.size + START.unpack_from(saved)[2] + 32
    places = [*range(START.size), *generator.integers(0, header_end, 150), *generator.integers(0, len(saved), 450)]
    for place in places:
        bad = bytearray(saved)
        bad[place] ^= 1 << generator.integers(8)
        refused(tmp_path / "bad.tfield", bytes(bad))


def test_every_length_is_noticed(saved: bytes, tmp_path: Path) -> None:
    lengths = [
        *range(200),
        *np.random.default_rng(12).integers(0, len(saved), 150),
        *range(len(saved) - 40, len(saved)),
    ]
    for length in lengths:
        sentence = refused(tmp_path / "cut.tfield", saved[:length])
        assert "is truncated" in sentence or length == 0
    assert "damaged" in refused(tmp_path / "long.tfield", saved + b"\0")
    assert "damaged" in refused(tmp_path / "long.tfield", saved + saved)


def test_noise_is_refused(saved: bytes, tmp_path: Path) -> None:
    generator = np.random.default_rng(13)
    for size in (1, 7, 8, 9, 23, 24, 25, 100, 1000):
        refused(tmp_path / "noise.tfield", generator.bytes(size))
        refused(tmp_path / "noise.tfield", container.MARK + generator.bytes(size))
        refused(tmp_path / "noise.tfield", saved[:12] + generator.bytes(size))
        refused(tmp_path / "noise.tfield", saved[:24] + generator.bytes(len(saved) - 24))


def test_a_newer_version_says_to_upgrade(saved: bytes, tmp_path: Path) -> None:
    newer = bytearray(saved)
    newer[8:12] = struct.pack("<I", container.VERSION + 1)
    sentence = refused(tmp_path / "newer.tfield", bytes(newer), "written by a newer truefield")
    assert "upgrade" in sentence


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("empty.tfield", b""),
        ("text.tfield", b"hello"),
        ("part.stl", b"solid x\nendsolid x\n"),
        ("zip.tfield", b"PK\3\4"),
    ],
)
def test_other_files_are_no_fields(tmp_path: Path, name: str, content: bytes) -> None:
    refused(tmp_path / name, content, "is not a truefield field")


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    for path, named in [(tmp_path, "it is a folder"), (tmp_path / "none.tfield", "no such file")]:
        with pytest.raises(tf.FileError, match=named):
            tf.load(path)
    os.mkfifo(tmp_path / "pipe.tfield")
    writer = os.open(tmp_path / "pipe.tfield", os.O_RDWR)
    with pytest.raises(tf.FileError, match="no ordinary file"):
        tf.load(tmp_path / "pipe.tfield")
    os.close(writer)


HEADERS: list[tuple[str, Any]] = [
    ("name", 5),
    ("name", None),
    ("sign", "guess"),
    ("sign", []),
    ("sign_rule", 1),
    ("region", "outside"),
    ("region", {}),
    ("origin", [0.0, 0.0]),
    ("origin", [0.0, 0.0, float("nan")]),
    ("origin", [0.0, 0.0, float("inf")]),
    ("origin", ["0", "0", "0"]),
    ("cell_size", 0.0),
    ("cell_size", -1.0),
    ("cell_size", True),
    ("cell_size", float("inf")),
    ("cell_size", 1e308),
    ("first", [0, 0]),
    ("first", [0, 0, 2**70]),
    ("first", [2**61, 0, 0]),
    ("first", [4, 0, 0]),
    ("shape", [5, 5, 0]),
    ("shape", [5, 5, -5]),
    ("shape", [5, 5, 2**32]),
    ("shape", [2**32 - 1] * 3),
    ("shape", [9, 5, 5]),
    ("shape", 5),
    ("arrays", None),
    ("arrays", []),
    ("arrays", {}),
    ("arrays", [1] * 10),
    ("arrays", [["vertices", "<f8", [3]]] * 10),
]


@pytest.mark.parametrize(("key", "value"), HEADERS)
def test_headers_with_good_checksums_are_not_trusted(saved: bytes, tmp_path: Path, key: str, value: Any) -> None:
    header, arrays = parts(saved)
    refused(tmp_path / "bad.tfield", forged(header | {key: value}, arrays), "is no valid field")
    del header[key]
    refused(tmp_path / "bad.tfield", forged(header, arrays), f"it has no {key}")


@pytest.mark.parametrize(
    "text", [b"", b"{", b"[]", b"null", b"\xff\xfe", b"[" * 100_000, b'{"name": ' + b"9" * 10_000 + b"}", b"NaN"]
)
def test_headers_that_are_no_objects(saved: bytes, tmp_path: Path, text: bytes) -> None:
    refused(tmp_path / "bad.tfield", forged(text, parts(saved)[1]), "is no valid field")


def test_lengths_of_arrays_with_good_checksums_are_not_trusted(saved: bytes, tmp_path: Path) -> None:
    header, arrays = parts(saved)
    for index in range(len(header["arrays"])):
        for change in (1, -1, 10**6, 2**40, 10**30, -(10**9)):
            bad = json.loads(json.dumps(header))
            bad["arrays"][index][2][0] += change
            refused(tmp_path / "bad.tfield", forged(bad, arrays), "is no valid field")
    # One array takes from another: the sum is right, each count is wrong.
    names = [name for name, _, _ in header["arrays"]]
    for one, other in [("list_counts", "triangle_counts"), ("ends", "cells"), ("entries", "varied")]:
        bad = json.loads(json.dumps(header))
        bad["arrays"][names.index(one)][2][0] += 1
        bad["arrays"][names.index(other)][2][0] -= 1
        refused(tmp_path / "bad.tfield", forged(bad, arrays), "is no valid field")


def test_arrays_with_good_checksums_never_crash(saved: bytes, tmp_path: Path) -> None:
    """A forger can make another field, but none that leaves its arrays."""
    header, arrays = parts(saved)
    generator = np.random.default_rng(17)
    points = generator.normal(size=(500, 3))
    path, refusals = tmp_path / "forged.tfield", 0
    for _ in range(400):
        bad = bytearray(arrays)
        for place in generator.integers(0, len(bad), generator.integers(1, 4)):
            bad[place] = generator.integers(256)
        path.write_bytes(forged(header, bytes(bad)))
        try:
            field = loaded(path)
        except tf.FileError:
            refusals += 1
        else:
            field.bounds(points)
            field.nearest(points)
            field.statistics()
    assert refusals > 40


def test_a_mesh_that_is_none_is_refused(saved: bytes, tmp_path: Path) -> None:
    header, arrays = parts(saved)
    refused(tmp_path / "bad.tfield", forged(header, struct.pack("<d", np.nan) + arrays[8:]), "vertex 0")
    triangles = 8 * 3 * header["arrays"][0][2][0]
    bad = arrays[:triangles] + struct.pack("<I", 2**32 - 1) + arrays[triangles + 4 :]
    refused(tmp_path / "bad.tfield", forged(header, bad), "triangle 0")


def test_another_sign_rule_is_not_taken_silently(saved: bytes, tmp_path: Path) -> None:
    header, arrays = parts(saved)
    sentence = refused(tmp_path / "old.tfield", forged(header | {"sign_rule": "winding"}, arrays), "'winding'")
    assert "build the field again" in sentence


@pytest.mark.parametrize("place", ["none/a.tfield", "file/a.tfield", "folder"])
def test_places_that_cannot_be_written(tmp_path: Path, place: str) -> None:
    (tmp_path / "file").write_text("here first")
    (tmp_path / "folder").mkdir()
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(tf.FileError, match="cannot write"):
        field_of(cube(), resolution=2).save(tmp_path / place)
    assert sorted(tmp_path.rglob("*")) == before


def test_a_folder_without_the_right_to_write(tmp_path: Path) -> None:
    tmp_path.chmod(stat.S_IRUSR | stat.S_IXUSR)
    try:
        if os.access(tmp_path, os.W_OK):
            pytest.skip("this user may write everywhere")
        with pytest.raises(tf.FileError, match="not writable"):
            field_of(cube(), resolution=2).save(tmp_path / "a.tfield")
    finally:
        tmp_path.chmod(stat.S_IRWXU)


def test_half_a_file_never_appears(tmp_path: Path) -> None:
    """The writer is stopped in the middle: what was there stays, and nothing else."""
    path = tmp_path / "a.tfield"
    field_of(cube(), resolution=2).save(path)
    good = path.read_bytes()

    def stop(phase: str, fraction: float) -> None:
        if phase == "write field" and fraction > 0.01:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        field_of(blob()).save(path, progress=stop)
    assert [file.name for file in tmp_path.iterdir()] == ["a.tfield"]
    assert path.read_bytes() == good


@pytest.mark.skipif(sys.platform == "win32", reason="limits are of another kind there")
def test_a_full_disk_is_one_sentence_and_leaves_nothing(tmp_path: Path) -> None:
    path = tmp_path / "a.tfield"
    code = f"""
import resource, truefield as tf
field = tf.complete_field(tf.shapes.sphere(1.0, 3), resolution=20)
resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))
try:
    field.save({str(path)!r})
except tf.FileError as error:
    print(error)
"""
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ended.stdout.startswith(f"cannot write '{path}': ")
    assert ended.stdout.endswith("; choose another place\n")
    assert not list(tmp_path.iterdir())


SAMPLED: dict[str, Callable[[], tf.SampledField]] = {
    "exact": lambda: tf.Surface(blob()).sample(resolution=15),
    "band": lambda: tf.Surface(blob()).sample(resolution=15, band=0.05),
    "doubtful": lambda: tf.Surface(tf.TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 1]], [[0, 1, 2]])).sample(
        resolution=9
    ),
    "open": lambda: tf.Surface(open_blob()).sample(resolution=15, margin=0.1),
    "error": lambda: tf.SampledField.from_array(
        np.arange(24.0).reshape(2, 3, 4), (1, 2, 3), (0.1, 0.2, 0.3), error=0.5
    ),
    "nothing known": lambda: tf.SampledField.from_array(np.full((1, 2, 1), -np.inf)),
    "bounds": lambda: tf.Surface(blob()).sample(resolution=15).offset(0.1),
}


@pytest.mark.parametrize("name", SAMPLED)
def test_samples_come_back_with_all_that_is_known(tmp_path: Path, name: str) -> None:
    field = SAMPLED[name]()
    field.save(tmp_path / "a.tfield")
    again = tf.load(tmp_path / "a.tfield")
    assert isinstance(again, tf.SampledField)
    for key in ("values", "lower", "upper", "origin", "spacing"):
        assert getattr(again, key).tobytes() == getattr(field, key).tobytes()
    points = np.random.default_rng(7).uniform(field.origin - 1, field.origin + 1, (3000, 3))
    assert np.array(again.bounds(points)).tobytes() == np.array(field.bounds(points)).tobytes()
    assert np.array(again.distance(points)).tobytes() == np.array(field.distance(points)).tobytes()
    again.save(tmp_path / "b.tfield")
    assert (tmp_path / "a.tfield").read_bytes() == (tmp_path / "b.tfield").read_bytes()


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("kind", "adaptive"),
        ("kind", 3),
        ("origin", [0.0, 0.0]),
        ("origin", [0, 0, 0]),
        ("spacing", [0.1, 0.1, "a"]),
        ("spacing", [0.1, 0.1, 0.0]),
        ("spacing", [0.1, 0.1, float("nan")]),
        ("shape", [14, 15, 15]),
        ("shape", [0, 1, 1]),
        ("known", "maybe"),
        ("known", "bounds"),
        ("length", "far"),
        ("length", -1.0),
        ("continuous", 1),
    ],
)
def test_headers_of_samples_are_not_trusted(tmp_path: Path, key: str, value: Any) -> None:
    SAMPLED["band"]().save(tmp_path / "a.tfield")
    header, arrays = parts((tmp_path / "a.tfield").read_bytes())
    refused(tmp_path / "bad.tfield", forged(header | {key: value}, arrays), "is no valid field")


def test_samples_that_are_no_numbers_are_refused(tmp_path: Path) -> None:
    SAMPLED["bounds"]().save(tmp_path / "a.tfield")
    header, arrays = parts((tmp_path / "a.tfield").read_bytes())
    refused(tmp_path / "bad.tfield", forged(header, struct.pack("<f", np.nan) + arrays[4:]), "not a number")
    refused(tmp_path / "bad.tfield", forged(header, arrays[:-4] + struct.pack("<f", -9.0)), "between its bounds")


def test_fields_without_a_kind_are_complete(saved: bytes, tmp_path: Path) -> None:
    header, arrays = parts(saved)
    del header["kind"]
    (tmp_path / "old.tfield").write_bytes(forged(header, arrays))
    assert loaded(tmp_path / "old.tfield").mesh.name == "blob"


def test_damaged_samples_are_one_sentence(tmp_path: Path) -> None:
    SAMPLED["error"]().save(tmp_path / "a.tfield")
    good = (tmp_path / "a.tfield").read_bytes()
    for at in range(0, len(good), 3):
        refused(tmp_path / "bad.tfield", good[:at])
        refused(tmp_path / "bad.tfield", good[:at] + bytes([good[at] ^ 1]) + good[at + 1 :])


def test_what_answers_can_be_pickled_and_is_its_own_copy() -> None:
    part = cube()
    surface = tf.Surface(part, sign="winding")
    shape = csg.sphere(1.0)
    carved = tf.adaptive_field(part, 0.1).carve(csg.sphere(0.4))
    points = np.random.default_rng(2).uniform(-0.5, 1.5, (200, 3))
    report = tf.thickness(part, tolerance=0.1)
    for one in (surface, tf.complete_field(surface, 6), carved, tf.sampled_field(part, 9), shape, part, report):
        if not isinstance(one, tf.TriangleMesh | tf.ThicknessReport):
            assert copy.copy(one) is one
            assert copy.deepcopy(one) is one
        if one is shape:
            with pytest.raises(TypeError, match="pickle or save an adaptive field"):
                pickle.dumps(one)
            continue
        again = pickle.loads(pickle.dumps(one))
        if isinstance(one, tf.Surface | tf.CompleteField | tf.AdaptiveField | tf.SampledField):
            assert np.array_equal(again.distance(points), one.distance(points), equal_nan=True)
            assert np.array_equal(again.bounds(points), one.bounds(points), equal_nan=True)
    assert pickle.loads(pickle.dumps(surface)).sign_rule == surface.sign_rule
    with pytest.raises(tf.FileError, match="a packed field"):
        storage.unpacked(storage.packed(carved)[:-1])
