from __future__ import annotations

import json
import os
import resource
import struct
import zipfile
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import truefield as tf
from solids import CORNERS, QUADS, blob, cube, volume
from truefield import files

trimesh: Any = import_module("trimesh")  # its types are loose

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"


def wrote(path: Path, content: str | bytes) -> Path:
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def stl_text(mesh: tf.TriangleMesh) -> str:
    facets = []
    for corners in mesh.corners.tolist():
        loop = "".join(f"      vertex {x!r} {y!r} {z!r}\n" for x, y, z in corners)
        facets.append(f"  facet normal 0 0 0\n    outer loop\n{loop}    endloop\n  endfacet\n")
    return "solid a vertex of solid parts\n" + "".join(facets) + "endsolid\n"


def ply_text(kind: str = "double") -> str:
    rows = "".join(f"{x} {y} {z} 255\n" for x, y, z in CORNERS.tolist())
    faces = "".join(f"4 {a} {b} {c} {d} 7\n" for a, b, c, d in QUADS[1:])
    split = "3 0 2 3 7\n3 0 3 1 7\n"
    return (
        "ply\nformat ascii 1.0\ncomment a cube of quads and triangles\n"
        f"element vertex 8\nproperty {kind} x\nproperty {kind} y\nproperty {kind} z\nproperty uchar red\n"
        "element face 7\nproperty list uchar int vertex_index\nproperty int group\n"
        f"end_header\n{rows}{split}{faces}"
    )


def ply_binary(order: str) -> bytes:
    """The same cube of quads and triangles: rows of differing lengths."""
    name = {"<": "binary_little_endian", ">": "binary_big_endian"}[order]
    header, _, _ = ply_text("float").partition("end_header\n")
    body = b"".join(struct.pack(f"{order}3fB", *corner, 255) for corner in CORNERS.tolist())
    for face in [(0, 2, 3), (0, 3, 1), *QUADS[1:]]:
        body += struct.pack(f"{order}B{len(face)}ii", len(face), *face, 7)
    return header.replace("ascii", name).encode() + b"end_header\n" + body


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".off"])
def test_what_is_written_is_read_back_bit_by_bit(tmp_path: Path, suffix: str) -> None:
    part = blob()
    part.write(tmp_path / f"blob{suffix}")
    again = tf.read(tmp_path / f"blob{suffix}")
    assert np.array_equal(again.vertices, part.vertices)
    assert np.array_equal(again.triangles, part.triangles)
    assert again.name == "blob"


def test_binary_stl_rounds_to_single_precision_and_keeps_the_mesh_closed(tmp_path: Path) -> None:
    part = blob()
    part.write(tmp_path / "blob.stl")
    again = tf.read(tmp_path / "blob.stl")
    assert len(again.vertices) == len(part.vertices)
    assert np.array_equal(again.corners, part.corners.astype(np.float32))


@pytest.mark.parametrize("suffix", ["stl", "ply", "obj", "off", "glb", "3mf"])
def test_what_another_tool_writes_is_read_whole(tmp_path: Path, suffix: str) -> None:
    part = blob()
    path = tmp_path / f"blob.{suffix}"
    trimesh.Trimesh(part.vertices, part.triangles, process=False).export(path)
    again = tf.read(path)
    assert len(again.vertices) == len(part.vertices)
    assert np.allclose(again.corners, part.corners, rtol=0, atol=1e-7)


@pytest.mark.parametrize("suffix", ["stl", "ply", "obj", "off"])
def test_what_is_written_is_read_by_another_tool(tmp_path: Path, suffix: str) -> None:
    part = blob()
    path = tmp_path / f"blob.{suffix}"
    part.write(path)
    other = trimesh.load_mesh(path, process=False)
    assert np.allclose(other.triangles, part.corners, rtol=0, atol=1e-7)


@pytest.mark.parametrize(("scale", "shift"), [(1e40, 0.0), (1e-50, 0.0), (1e-44, 0.0), (1.0, 1e7)])
def test_an_stl_that_single_precision_would_spoil_is_refused(tmp_path: Path, scale: float, shift: float) -> None:
    mesh = tf.TriangleMesh(blob().vertices * scale + shift, blob().triangles)
    with pytest.raises(tf.FileError, match="single precision"):
        mesh.write(tmp_path / "a.stl")
    assert not list(tmp_path.iterdir())
    mesh.write(tmp_path / "a.ply")
    np.testing.assert_array_equal(tf.read(tmp_path / "a.ply").vertices, mesh.vertices)


@pytest.mark.parametrize("suffix", [".stl", ".ply", ".obj", ".off"])
def test_files_are_read_and_written_piece_by_piece(tmp_path: Path, suffix: str) -> None:
    import tracemalloc

    count = 160
    turns = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    u, v = (angle.reshape(-1) for angle in np.meshgrid(turns, turns, indexing="ij"))
    vertices = np.stack(((2 + np.cos(v)) * np.cos(u), (2 + np.cos(v)) * np.sin(u), np.sin(v)), axis=1)
    corner = np.arange(count * count).reshape(count, count)
    right, above = np.roll(corner, -1, axis=0), np.roll(corner, -1, axis=1)
    over = np.roll(right, -1, axis=1)
    halves = [np.stack(half, axis=-1).reshape(-1, 3) for half in ((corner, right, over), (corner, over, above))]
    torus = tf.TriangleMesh(vertices, np.concatenate(halves))
    path = tmp_path / f"torus{suffix}"
    result = torus.vertices.nbytes + torus.triangles.nbytes
    # The words of a piece of text, whatever the length of the file.
    piece = 8 << 20
    tracemalloc.start()
    try:
        torus.write(path)
        assert tracemalloc.get_traced_memory()[1] < piece
        tracemalloc.reset_peak()
        read = tf.read(path)
        assert tracemalloc.get_traced_memory()[1] < 2 * result + piece
    finally:
        tracemalloc.stop()
    assert len(read.triangles) == len(torus.triangles)
    if suffix != ".stl":
        assert np.array_equal(read.vertices, torus.vertices)
        assert np.array_equal(read.triangles, torus.triangles)


def test_pieces_end_anywhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from truefield.formats import ply, polygons

    continued = "v 0 0 0\nv 1 \\\n 0 0\nv 0 \\\r\n1 0\n# end \\\nof it\nf 1 \\\n2 3\n"
    contents: dict[str, str | bytes] = {
        "part.stl": stl_text(cube()), "part.obj": continued, "part.ply": ply_text(), "mixed.ply": ply_binary("<"),
        "part.off": "OFF # of\n\n# nothing\n3 1 0\n0 0 0\n1 0 0\n\n0 1 0\n3 0 1 2\n",
    }  # fmt: skip
    whole = {name: tf.read(wrote(tmp_path / name, content)) for name, content in contents.items()}
    monkeypatch.setattr(polygons, "_PIECE", 1)
    monkeypatch.setattr(ply, "_START", 16)
    for rows in (1, 3):
        monkeypatch.setattr(ply, "_ROWS", rows)
        for name, mesh in whole.items():
            parts = tf.read(tmp_path / name)
            assert np.array_equal(parts.vertices, mesh.vertices)
            assert np.array_equal(parts.triangles, mesh.triangles)
    assert whole["part.obj"].triangles.tolist() == [[0, 1, 2]]


@pytest.mark.parametrize("line_end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("beyond", [-2, -1, 0, 1])
def test_ply_headers_may_end_anywhere(tmp_path: Path, line_end: str, beyond: int) -> None:
    cube().write(path := tmp_path / "cube.ply")
    header, _, body = path.read_bytes().partition(b"end_header\n")
    first, _, rest = header.partition(b"\n")
    lines = line_end.encode().join([first, b"comment %s", *rest.split(b"\n")])
    # The first piece that is read ends next to the line break, before which is the header's last word.
    room = 65536 + beyond - len(lines + b"end_header") + 2
    wrote(path, lines.replace(b"%s", b"x" * room) + b"end_header" + line_end.encode() + body)
    assert np.array_equal(tf.read(path).triangles, cube().triangles)
    assert np.array_equal(tf.read(path).vertices, cube().vertices)


def test_ply_of_a_large_polygon_and_many_small_ones_takes_no_more_than_itself(tmp_path: Path) -> None:
    corners = 300_000
    angle = np.linspace(0, 2 * np.pi, corners, endpoint=False)
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {corners}\nproperty double x\nproperty double y\n"
    header += "property double z\nelement face 60000\nproperty list uint uint vertex_indices\nend_header\n"
    disk = np.stack((np.cos(angle), np.sin(angle), 0 * angle), axis=1).astype("<f8")
    large = np.concatenate(([corners], np.arange(corners))).astype("<u4")
    small = np.tile(np.array([3, 0, 1, 2], dtype="<u4"), 59_999)
    path = wrote(tmp_path / "disk.ply", header.encode() + disk.tobytes() + large.tobytes() + small.tobytes())
    limits = resource.getrlimit(resource.RLIMIT_AS)
    # 60 000 rows as long as the first would take 72 GB.
    resource.setrlimit(resource.RLIMIT_AS, (32 << 30, limits[1]))
    try:
        mesh = tf.read(path)
    finally:
        resource.setrlimit(resource.RLIMIT_AS, limits)
    assert len(mesh.triangles) == corners - 2 + 59_999


def test_elements_of_ply_without_properties_are_passed_over(tmp_path: Path) -> None:
    cube().write(path := tmp_path / "cube.ply")
    wrote(path, path.read_bytes().replace(b"element vertex", b"element nothing 3\nelement vertex", 1))
    assert np.array_equal(tf.read(path).triangles, cube().triangles)


def test_a_pipe_is_read_like_a_file(tmp_path: Path) -> None:
    import threading

    pipe = tmp_path / "part.stl"
    os.mkfifo(pipe)
    cube().write(tmp_path / "cube.stl")
    data = (tmp_path / "cube.stl").read_bytes()
    writer = threading.Thread(target=lambda: pipe.write_bytes(data))
    writer.start()
    assert len(tf.read(pipe).triangles) == 12
    writer.join()


def test_text_stl_is_read_in_full_precision(tmp_path: Path) -> None:
    part = blob()
    again = tf.read(wrote(tmp_path / "blob.stl", stl_text(part)))
    assert np.array_equal(again.corners, part.corners)
    assert len(again.vertices) == len(part.vertices)


def test_a_binary_stl_that_begins_with_solid_is_binary(tmp_path: Path) -> None:
    cube(name="solid").write(tmp_path / "cube.stl")
    data = (tmp_path / "cube.stl").read_bytes()
    again = tf.read(wrote(tmp_path / "solid.stl", b"solid facet vertex".ljust(80) + data[80:]))
    assert np.array_equal(again.corners, cube().corners)


def test_several_solids_of_a_text_stl_are_one_mesh_and_zeros_of_both_signs_one_vertex(tmp_path: Path) -> None:
    text = stl_text(cube())
    again = tf.read(
        wrote(tmp_path / "two.stl", text + text.replace(" 0.0", " -0.0").replace("vertex 1.0", "vertex 2.0"))
    )
    assert len(again.triangles) == 24
    assert len(again.vertices) == 12


@pytest.mark.parametrize(
    "separator",
    [pytest.param("\t", id="tabs"), pytest.param("   ", id="blanks"), pytest.param(" \\\n ", id="continued lines")],
)
def test_obj_fields_may_be_parted_by_any_blanks(tmp_path: Path, separator: str) -> None:
    lines = [separator.join(["v", *map(str, corner)]) for corner in CORNERS.tolist()]
    lines += [separator.join(["f", *(str(i + 1) for i in quad)]) for quad in QUADS]
    again = tf.read(wrote(tmp_path / "cube.obj", "\n".join(lines)))
    assert np.array_equal(again.corners, cube().corners)


def test_obj_decoration_negative_indices_polygons_and_groups(tmp_path: Path) -> None:
    text = (
        "# a comment\r\nmtllib none.mtl\r\no first\r\nv 0 0 0 1 0 0\r\nv 2 0 0\r\nv 2 2 0\r\nv 0 2 0\r\nv 1 3 0\r\n"
        "vt 0 0\r\nvn 0 0 1\r\nusemtl steel\r\ns 1\r\nf 1/1/1 2//1 3/1 5 4\r\n"
        "g second\r\nv 0 0 1\r\nf -1 -6 -5\r\nl 1 2\r\n"
    )
    again = tf.read(wrote(tmp_path / "odd.obj", text))
    assert again.triangles.tolist() == [[0, 1, 2], [0, 2, 4], [0, 4, 3], [5, 0, 1]]
    assert again.vertices[0].tolist() == [0.0, 0.0, 0.0]


def test_obj_keeps_duplicate_degenerate_and_unused_elements(tmp_path: Path) -> None:
    again = tf.read(wrote(tmp_path / "odd.obj", TRIANGLE + "v 9 9 9\nv 0 0 0\nf 1 2 3\nf 1 2 3\nf 1 1 2\nf 5 2 3\n"))
    assert again.triangles.tolist() == [[0, 1, 2], [0, 1, 2], [0, 0, 1], [4, 1, 2]]
    assert len(again.vertices) == 5


@pytest.mark.parametrize("content", [ply_text(), ply_text("float32"), ply_binary("<"), ply_binary(">")])
def test_ply_of_every_kind_with_faces_of_differing_sizes(tmp_path: Path, content: str | bytes) -> None:
    again = tf.read(wrote(tmp_path / "cube.ply", content))
    assert np.array_equal(again.vertices, CORNERS)
    assert np.array_equal(again.triangles, cube().triangles)


def test_ply_with_lines_of_carriage_return_and_line_feed(tmp_path: Path) -> None:
    again = tf.read(wrote(tmp_path / "cube.ply", ply_text().replace("\n", "\r\n")))
    assert np.array_equal(again.triangles, cube().triangles)


def test_ply_with_other_lists_beside_the_corners(tmp_path: Path) -> None:
    header, end, body = ply_text().replace("int group", "list uchar float texcoord").partition("end_header")
    again = tf.read(wrote(tmp_path / "cube.ply", header + end + body.replace(" 7\n", " 2 0.25 nan\n")))
    assert np.array_equal(again.triangles, cube().triangles)


def test_off_with_counts_beside_the_keyword_comments_colours_and_polygons(tmp_path: Path) -> None:
    rows = "".join(f"{x} {y} {z} 0.5 0.5 0.5 1 # corner\n" for x, y, z in CORNERS.tolist())
    faces = "".join(f"4 {a} {b} {c} {d} 255 0 0\n" for a, b, c, d in QUADS)
    again = tf.read(wrote(tmp_path / "cube.off", f"COFF 8 6 12\n# comment\n\n{rows}{faces}"))
    assert np.array_equal(again.corners, cube().corners)


@pytest.mark.parametrize("suffix", ["glb", "gltf", "3mf"])
def test_objects_of_a_scene_are_placed_and_put_in_one_mesh(tmp_path: Path, suffix: str) -> None:
    shape = trimesh.Trimesh(cube().vertices, cube().triangles, process=False)
    scene = trimesh.Scene()
    scene.add_geometry(shape, geom_name="cube", node_name="here")
    moved = np.diag([2.0, 2.0, 2.0, 1.0])
    moved[:3, 3] = 10, 20, 30
    scene.graph.update(frame_to="there", matrix=moved, geometry="cube")
    path = tmp_path / f"scene.{suffix}"
    if suffix == "gltf":
        for name, content in trimesh.exchange.gltf.export_gltf(scene).items():
            wrote(tmp_path / name, content)
        path = tmp_path / "model.gltf"
    else:
        scene.export(path)
    again = tf.read(path)
    assert len(again.triangles) == 24
    assert len(again.vertices) == 16
    assert again.extent[0].tolist() == [0.0, 0.0, 0.0]
    assert again.extent[1].tolist() == [12.0, 22.0, 32.0]
    assert volume(again) == pytest.approx(9.0)


def test_a_mirrored_object_stays_outside_out(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    scene.add_geometry(
        trimesh.Trimesh(cube().vertices, cube().triangles, process=False), transform=np.diag([-1.0, 1, 1, 1])
    )
    scene.export(tmp_path / "mirror.glb")
    assert volume(tf.read(tmp_path / "mirror.glb")) == pytest.approx(1.0)


def binary_stl() -> bytes:
    return struct.pack("<80sI", b"", 2) + b"\0" * 100


def binary_ply(name: Path) -> bytes:
    cube().write(name)
    return name.read_bytes()


def glb() -> bytes:
    return bytes(trimesh.Trimesh(cube().vertices, cube().triangles, process=False).export(file_type="glb"))


def edited_glb(edit: Callable[[Any], None]) -> bytes:
    data = glb()
    size = struct.unpack_from("<I", data, 12)[0]
    document = json.loads(data[20 : 20 + size])
    edit(document)
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<II", len(text), 0x4E4F534A) + text + data[20 + size :]
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


BAD_FILES = [
    ("none.xyzzy", b"what", "suffix '.xyzzy' is not known"),
    ("bare", b"what", "it has no suffix"),
    *((f"empty.{suffix}", b"", "the file is empty") for suffix in ("stl", "obj", "ply", "off", "glb", "gltf", "3mf")),
    ("short.stl", b"sol", "too short for a binary STL"),
    ("cut.stl", binary_stl()[:-1], "truncated.*2 triangles.*184 bytes, this file 183"),
    ("long.stl", binary_stl() + b"\0", "holds more than it says"),
    ("noise.stl", bytes(range(256)) * 3, "truncated"),
    ("page.stl", b"<html>not found</html>" * 9, "STL"),
    ("header.stl", struct.pack("<80sI", b"", 0), "no triangles"),
    ("none.stl", b"solid\nendsolid\n", "no triangles"),
    ("degenerate.stl", binary_stl(), "diagonal of 0.0"),
    ("minus.stl", b"\xff" * 84, "truncated"),
    ("cut-text.stl", stl_text(cube())[:-200], "truncated"),
    ("cut-end.stl", stl_text(cube())[:-10], "truncated"),
    ("word.stl", stl_text(cube()).replace("vertex 1.0", "vertex one"), "no number"),
    ("two.stl", stl_text(cube()).replace("vertex 1.0 1.0", "vertex 1.0"), "2 coordinates"),
    ("quad.stl", stl_text(cube()).replace("endloop", "vertex 0 0 0\nendloop", 1), "exactly 3 vertices"),
    ("nan.stl", stl_text(cube()).replace("1.0 1.0 1.0", "1.0 nan 1.0"), r"vertex \d is \(1.0, nan, 1.0\)"),
    ("inf.stl", stl_text(cube()).replace("1.0 1.0 1.0", "1.0 -inf 1.0"), r"-inf"),
    ("words.obj", b"this is no mesh at all\n", "no 'v' and no 'f' lines"),
    ("binary.obj", bytes(range(256)), "zero bytes"),
    ("points.obj", TRIANGLE, "no triangles"),
    ("curved.obj", TRIANGLE + "cstype bspline\nsurf 0 1 0 1 1 2 3\n", "curved surfaces"),
    ("range.obj", TRIANGLE + "f 1 2 4\n", "triangle 0 refers to vertices .* only 3"),
    ("beyond.obj", TRIANGLE + "f 1 2 99999999999999999999\n", "line 4 refers to a vertex beyond"),
    ("zero.obj", TRIANGLE + "f 0 1 2\n", "line 4 refers to vertex 0"),
    ("back.obj", TRIANGLE + "f -1 -2 -4\n", "line 4 counts back"),
    ("cut-face.obj", TRIANGLE + "f 1 2", "line 4 has 2 corners"),
    ("cut-vertex.obj", TRIANGLE + "f 1 2 3\nv 0 1", r"vertex 3 \(line 5\) has 2 coordinates"),
    ("word.obj", TRIANGLE + "f 1 two 3\n", "line 4 holds something that is no index"),
    ("number.obj", TRIANGLE.replace("v 1", "v one") + "f 1 2 3\n", "no number"),
    ("nan.obj", TRIANGLE.replace("v 1", "v nan") + "f 1 2 3\n", "vertex 1 is"),
    ("flat.obj", TRIANGLE + "f 1 2 2\nf 3 3 3\n", "all 2 triangles of the mesh have zero area"),
    ("other.ply", b"solid\n", "does not begin with 'ply'"),
    ("header.ply", ply_text()[:60], "no 'end_header'"),
    ("type.ply", ply_text().replace("uchar red", "colour red"), "'property colour red' makes no sense"),
    ("format.ply", ply_text().replace("format ascii 1.0\n", ""), "no 'format' line"),
    ("cut.ply", ply_text()[:-8], "truncated.*7 elements 'face'"),
    ("cut-vertices.ply", ply_text()[:260], "truncated.*8 elements 'vertex'"),
    ("cut-little.ply", ply_binary("<")[:-1], "truncated"),
    ("cut-big.ply", ply_binary(">")[:-60], "truncated"),
    ("huge.ply", ply_binary("<").replace(b"vertex 8", b"vertex 4000000000"), "truncated"),
    ("long.ply", ply_text().replace("face 7", "face 6"), r"goes on after the last element it declares \(6 numbers"),
    ("long-binary.ply", ply_binary("<") + b"more", r"goes on after the last element it declares \(4 bytes"),
    ("header-words.ply", ply_text().replace("face 7", "face 7 7"), "'element face 7 7' makes no sense"),
    ("length.ply", ply_text().replace("4 4 5 7 6", "-4 4 5 7 6"), "length of a list"),
    ("range.ply", ply_text().replace("4 4 5 7 6", "4 4 5 7 8"), "only 8 vertices"),
    ("half.ply", ply_text().replace("4 4 5 7 6", "4 4 5 7.5 6"), "no whole number"),
    ("two.ply", ply_text().replace("3 0 2 3 7", "2 0 2 7"), "face 0 has 2 corners"),
    ("nan.ply", ply_text().replace("1.0 1.0 1.0", "1.0 nan 1.0"), "vertex 7 is"),
    ("points.ply", ply_text().replace("vertex_index", "something"), "no triangles"),
    ("axes.ply", ply_text().replace("double z", "double w"), "no element 'vertex' with x, y and z"),
    ("strips.ply", ply_text().replace("element face", "element tristrips"), "strips"),
    ("other.off", b"ply\n", "does not begin with 'OFF'"),
    ("binary.off", b"OFF BINARY\n\0\0", "binary OFF"),
    ("counts.off", b"OFF\n", "count line"),
    ("negative.off", b"OFF\n-3 1 0\n", "count line"),
    ("cut.off", b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n", "truncated.*3 vertices and 1 faces, and 3 lines"),
    ("long.off", b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 2\n", "goes on after its last face"),
    ("face.off", b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1", "face 0 declares 3 corners and lists 2"),
    ("vertex.off", b"OFF\n3 1 0\n0 0\n1 0 0\n0 1 0\n3 0 1 2", "vertex 0 has 2 coordinates"),
    ("range.off", b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 -1", "only 3 vertices"),
    ("none.off", b"OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n", "no triangles"),
    ("noise.glb", b"what is this, then?", "does not begin with 'glTF'"),
    ("cut.glb", glb()[:-4], "truncated"),
    ("cut-header.glb", glb()[:10], "truncated or no GLB"),
    ("count.glb", edited_glb(lambda d: d["accessors"][0].update(count=39)), "GLB|triangles"),
    ("fan.glb", edited_glb(lambda d: d["meshes"][0]["primitives"][0].update(mode=6)), "could be read|GLB"),
    ("noise.gltf", b"{", "no GLTF"),
    ("list.gltf", b"[]", "no GLTF"),
    ("empty-scene.gltf", b'{"asset": {"version": "2.0"}}', "no triangles|no GLTF"),
    ("noise.3mf", b"PK no zip", "no 3MF"),
]


@pytest.mark.parametrize(("name", "content", "sentence"), BAD_FILES, ids=[case[0] for case in BAD_FILES])
def test_a_bad_file_is_refused_in_one_sentence_that_names_it(
    tmp_path: Path, name: str, content: str | bytes, sentence: str
) -> None:
    path = wrote(tmp_path / name, content)
    with pytest.raises(tf.FileError, match=sentence) as caught:
        tf.read(path)
    message = str(caught.value)
    assert str(path) in message
    assert "\n" not in message
    assert isinstance(caught.value, ValueError | OSError)


def three_mf(model: str) -> dict[str, str]:
    rels = '<?xml version="1.0"?><Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"/>'
    return {"_rels/.rels": rels, "3D/3dmodel.model": model}


MODEL = """<?xml version="1.0"?><model unit="millimeter" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">
<resources><object id="1" type="model"><mesh><vertices>
<vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/><vertex x="0" y="1" z="0"/></vertices>
<triangles><triangle v1="0" v2="1" v3="2"/></triangles></mesh></object></resources>
<build><item objectid="1"/></build></model>"""


@pytest.mark.parametrize(
    ("model", "sentence"),
    [
        (MODEL, None),
        (MODEL.replace('x="1"', 'x="nan"'), "vertex 1 is"),
        (MODEL.replace('x="1"', 'x="one"'), "damaged"),
        (MODEL.replace('v3="2"', 'v3="3"'), "triangles that refer to vertices|damaged"),
        (MODEL.replace('<item objectid="1"/>', '<item objectid="5"/>'), "does not hold|no triangles|damaged"),
        (MODEL[:-30], "no 3MF"),
        (MODEL.replace('<triangle v1="0" v2="1" v3="2"/>', ""), "no triangles"),
    ],
)
def test_3mf_good_and_bad(tmp_path: Path, model: str, sentence: str | None) -> None:
    path = tmp_path / "part.3mf"
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in three_mf(model).items():
            archive.writestr(name, content)
    if sentence is None:
        assert tf.read(path).triangles.tolist() == [[0, 1, 2]]
        return
    with pytest.raises(tf.FileError, match=sentence):
        tf.read(path)


def test_gltf_without_its_buffer_says_so_and_nothing_is_fetched(tmp_path: Path) -> None:
    scene = trimesh.Scene(trimesh.Trimesh(cube().vertices, cube().triangles, process=False))
    text = trimesh.exchange.gltf.export_gltf(scene)["model.gltf"]
    with pytest.raises(tf.FileError, match="damaged or no GLTF"):
        tf.read(wrote(tmp_path / "model.gltf", text))


def test_missing_file_and_folder(tmp_path: Path) -> None:
    with pytest.raises(tf.FileError, match=r"^cannot read '.*none.stl': there is no such file; check the name$"):
        tf.read(tmp_path / "none.stl")
    with pytest.raises(OSError, match="it is a folder"):
        tf.read(tmp_path)


POINTS = [[0.1, 2.0, -3.5], [1e-7, 5.0, 6.25]]


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("plain.csv", "0.1,2,-3.5\n1e-7,5,6.25\n"),
        ("names.csv", "\ufeffid, Z, Y, X\r\na, -3.5, 2, 0.1\r\nb, 6.25, 5, 1e-7\r\n"),
        ("semicolons.csv", '"x";"y";"z";"note"\n0.1;2;-3.5;hm\n1e-7;5;6.25;\n'),
        ("blanks.xyz", "# two points\n0.1 2 -3.5 0 0 1\n\n1e-7\t5   6.25 0 0 1"),
        ("plain.txt", "x y z\n0.1 2 -3.5\n1e-7 5 6.25\n"),
    ],
)
def test_points_from_text(tmp_path: Path, name: str, content: str) -> None:
    points = tf.read_points(wrote(tmp_path / name, content))
    assert points.dtype == np.float64
    assert points.tolist() == POINTS


@pytest.mark.parametrize("suffix", [".ply", ".csv", ".xyz"])
def test_a_point_cloud_is_written_and_its_points_read_back(tmp_path: Path, suffix: str) -> None:
    generator = np.random.default_rng(3)
    points, normals = generator.normal(size=(2, 100, 3))
    cloud = tf.PointCloud(points, normals, np.arange(100), {"thickness": points[:, 0] ** 2})
    cloud.write(tmp_path / f"cloud{suffix}")
    assert np.array_equal(tf.read_points(tmp_path / f"cloud{suffix}"), points)
    assert [file.name for file in tmp_path.iterdir()] == [f"cloud{suffix}"]


def test_a_point_cloud_as_ply_is_read_by_another_tool(tmp_path: Path) -> None:
    points = np.array(POINTS)
    tf.PointCloud(points, -points, [7, 2**31], {"depth": np.array([1.5, 2.5], np.float32)}).write(
        tmp_path / "cloud.ply"
    )
    other = trimesh.load(tmp_path / "cloud.ply")
    assert np.array_equal(other.vertices, points)
    raw = other.metadata["_ply_raw"]["vertex"]["data"]
    assert raw["nx"].tolist() == (-points[:, 0]).tolist()
    assert raw["triangle"].tolist() == [7, 2**31]
    assert raw["depth"].tolist() == [1.5, 2.5]


def test_points_from_numpy(tmp_path: Path) -> None:
    np.save(tmp_path / "points.npy", np.array(POINTS, dtype=np.float32))
    assert np.array_equal(tf.read_points(tmp_path / "points.npy"), np.array(POINTS, dtype=np.float32))


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        ("points.dat", b"1 2 3", "suffix must be one of"),
        ("empty.csv", b"", "the file is empty"),
        ("names.csv", b"x,y,z\n", "holds no points"),
        ("other.csv", b"a,b,c\n1,2,3\n", "not x, y and z"),
        ("short.csv", b"1,2,3\n4,5\n", "line 2 has 2 columns"),
        ("word.csv", b"x,y,z\n1,2,3\n4,five,6\n", "line 3 holds something that is no number"),
        ("nan.csv", b"1,2,3\n4,nan,6\n", r"point 1 of '.*' is \(4.0, nan, 6.0\)"),
        ("inf.xyz", b"1 2 inf\n", "point 0"),
        ("binary.csv", b"\x93NUMPY\0\0\0", "zero bytes"),
        ("header.npy", b"\x93NUMPY\x01\0\x10\0{'descr': '<f8',", "no numpy array"),
        ("cut.npy", b"\x93NUMPY\x01\0", "no numpy array"),
        ("mesh.ply", b"ply\nformat ascii 1.0\nend_header\n", "no element 'vertex'"),
    ],
)
def test_bad_points_are_refused_in_one_sentence(tmp_path: Path, name: str, content: bytes, sentence: str) -> None:
    with pytest.raises(tf.FileError, match=sentence) as caught:
        tf.read_points(wrote(tmp_path / name, content))
    assert name in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "array", [np.zeros((4, 2)), np.zeros(3), np.zeros((2, 3), complex), np.array([["a", "b", "c"]])]
)
def test_bad_numpy_points_are_refused(tmp_path: Path, array: np.ndarray[tuple[int, ...], np.dtype[np.generic]]) -> None:
    np.save(tmp_path / "points.npy", array)
    with pytest.raises(tf.FileError, match="give real numbers"):
        tf.read_points(tmp_path / "points.npy")


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (([[0.0, 0.0]],), "points has shape"),
        ((POINTS, [[0.0, 0.0, 1.0]]), "normals has shape"),
        ((POINTS, None, [1, 2, 3]), "triangle has shape"),
        ((POINTS, None, None, {"depth": [1.0]}), "depth has shape"),
        ((POINTS, None, None, {"nx": [1.0, 2.0]}), "called 'nx'"),
        ((POINTS, None, None, {"depth": ["a", "b"]}), "depth has dtype"),
    ],
)
def test_bad_point_clouds_are_refused(arguments: tuple[object, ...], sentence: str) -> None:
    with pytest.raises(tf.TruefieldError, match=sentence):
        tf.PointCloud(*arguments)  # type: ignore[arg-type]


class Stop(BaseException):
    """Stands for Ctrl-C."""


@pytest.mark.parametrize("error", [Stop, ValueError])
def test_what_breaks_off_leaves_the_old_file_and_no_other(tmp_path: Path, error: type[BaseException]) -> None:
    path = wrote(tmp_path / "out.ply", "old")

    def half() -> None:
        with files.replacing(path) as stream:
            stream.write(b"half")
            stream.flush()
            raise error

    with pytest.raises(error):
        half()
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_folder_appears_whole_or_not_at_all(tmp_path: Path) -> None:
    def half() -> None:
        with files.replacing_folder(tmp_path / "report") as folder:
            (folder / "a.txt").write_text("half")
            raise Stop

    with pytest.raises(Stop):
        half()
    assert not list(tmp_path.iterdir())
    with files.replacing_folder(tmp_path / "report") as folder:
        (folder / "a.txt").write_text("one")
    with files.replacing_folder(tmp_path / "report") as folder:
        (folder / "b.txt").write_text("two")
    assert sorted(file.name for file in (tmp_path / "report").iterdir()) == ["a.txt", "b.txt"]
    assert list(tmp_path.iterdir()) == [tmp_path / "report"]


def test_unwritable_places_are_named(tmp_path: Path) -> None:
    file = wrote(tmp_path / "file", "x")
    for path, sentence in (
        (tmp_path, "it is a folder"),
        (tmp_path / "no" / "out.ply", "does not exist"),
        (file / "out", "not exist"),
    ):
        with pytest.raises(tf.FileError, match=sentence), files.replacing(path):
            pytest.fail("nothing may be written")
    with pytest.raises(tf.FileError, match="it is a file"), files.replacing_folder(file):
        pytest.fail("nothing may be written")
    assert list(tmp_path.iterdir()) == [file]


def test_a_link_keeps_pointing_at_the_file_that_is_replaced(tmp_path: Path) -> None:
    real, link = wrote(tmp_path / "real.off", "old"), tmp_path / "link.off"
    link.symlink_to(real)
    cube().write(link)
    assert link.is_symlink()
    assert len(tf.read(real).triangles) == 12
