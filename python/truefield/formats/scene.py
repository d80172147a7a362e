"""Containers of several objects, read by trimesh: glTF, GLB and 3MF; transforms are applied, all put in one mesh."""

from __future__ import annotations

import json
import logging
import struct
import warnings
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from xml.etree import ElementTree

import numpy as np

from truefield.formats.polygons import FormatError, Soup, merge_equal, reason

if TYPE_CHECKING:
    from trimesh import Scene

_GLB_MAGIC: Final = b"glTF"
_JSON_CHUNK: Final = 0x4E4F534A
_TRIANGLES: Final = 4


def decode(data: bytes, path: Path) -> Soup:
    """All objects of the scene in one mesh.

    glTF repeats a vertex for every normal and texture coordinate it has, so its equal vertices become one, as for STL.
    """
    kind = path.suffix.lower().lstrip(".")
    declared = _triangles_of_3mf(data) if kind == "3mf" else _triangles_of_gltf(data, kind)
    scene = _load(data, kind, path)
    found = sum(len(shape.faces) for shape in scene.geometry.values() if hasattr(shape, "faces"))
    if found != declared:
        raise FormatError(f"it declares {declared} triangles but {found} could be read; export it as plain triangles")
    soup = _joined(scene)
    return soup if kind == "3mf" else merge_equal(soup)


def _load(data: bytes, kind: str, path: Path) -> Scene:
    import trimesh

    resolver = trimesh.resolvers.FilePathResolver(str(path.resolve()))
    try:
        with warnings.catch_warnings(), _complaints() as complaints:
            # Older numpy only warns where text stops being numbers.
            warnings.filterwarnings("error", message="string or file could not be read to its end")
            scene = trimesh.load_scene(
                BytesIO(data), file_type=kind, resolver=resolver, allow_remote=False, process=False
            )
    except Exception as error:
        raise FormatError(f"it is damaged or no {kind.upper()} ({reason(error)})") from None
    if any("not defined" in complaint for complaint in complaints):
        raise FormatError("it places an object that it does not hold; export it again")
    return scene


@contextmanager
def _complaints() -> Iterator[list[str]]:
    """What trimesh only logs, so that nothing it passes over is passed over silently."""
    heard: list[str] = []

    class Ear(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            heard.append(record.getMessage())

    log, ear = logging.getLogger("trimesh"), Ear(logging.WARNING)
    log.addHandler(ear)
    try:
        yield heard
    finally:
        log.removeHandler(ear)


def _joined(scene: Scene) -> Soup:
    vertices = [np.empty((0, 3))]
    triangles = [np.empty((0, 3), dtype=np.int64)]
    known = 0
    for node in scene.graph.nodes_geometry:
        transform, name = scene.graph[node]
        shape = scene.geometry[name]
        if not hasattr(shape, "faces"):
            continue  # loose points and lines are no surface
        placed = np.asarray(shape.vertices, dtype=np.float64)
        faces = np.asarray(shape.faces, dtype=np.int64)
        if not np.array_equal(transform, np.eye(4)):
            placed = placed @ transform[:3, :3].T + transform[:3, 3]
            if np.linalg.det(transform[:3, :3]) < 0:
                faces = faces[:, ::-1]  # a mirror turns every triangle; both formats say outside stays outside
        if len(faces) and (faces.min() < 0 or faces.max() >= len(placed)):
            raise FormatError(f"object {name!r} has triangles that refer to vertices it does not have")
        vertices.append(placed)
        triangles.append(faces + known)
        known += len(placed)
    return Soup(np.concatenate(vertices), np.concatenate(triangles))


def _triangles_of_gltf(data: bytes, kind: str) -> int:
    try:
        document = json.loads(_gltf_json(data) if kind == "glb" else data)
        accessors = document.get("accessors", [])
        total = 0
        for primitive in (p for mesh in document.get("meshes", []) for p in mesh["primitives"]):
            mode = primitive.get("mode", _TRIANGLES)
            corners = accessors[
                primitive["indices"] if "indices" in primitive else primitive["attributes"]["POSITION"]
            ]["count"]
            total += corners // 3 if mode == _TRIANGLES else max(0, corners - 2) if mode > _TRIANGLES else 0
    except (ValueError, KeyError, IndexError, TypeError, AttributeError, struct.error) as error:
        raise FormatError(f"it is truncated or no {kind.upper()} ({reason(error)})") from None
    return total


def _gltf_json(data: bytes) -> bytes:
    magic, _, length = struct.unpack_from("<4sII", data)
    if magic != _GLB_MAGIC:
        raise FormatError("it does not begin with 'glTF', so it is no GLB")
    if len(data) < length:
        raise FormatError(f"it is truncated: it declares {length} bytes and has {len(data)}")
    size, chunk = struct.unpack_from("<II", data, 12)
    if chunk != _JSON_CHUNK:
        raise FormatError("its first chunk is no JSON, so it is no GLB")
    return data[20 : 20 + size]


def _triangles_of_3mf(data: bytes) -> int:
    try:
        with zipfile.ZipFile(BytesIO(data)) as archive:
            models = [name for name in archive.namelist() if name.lower().endswith(".model")]
            if not models:
                raise FormatError("it holds no 3D model, so it is no 3MF")
            return sum(_count(archive.read(name)) for name in models)
    except FormatError:
        raise
    except Exception as error:  # zipfile lets out whatever a damaged archive leads it to
        raise FormatError(f"it is truncated or no 3MF ({reason(error)})") from None


def _count(model: bytes) -> int:
    events: Any = ElementTree.iterparse(BytesIO(model), events=("end",))
    total = 0
    for _, element in events:
        if element.tag.rpartition("}")[2] == "triangle":
            total += 1
        element.clear()
    return total
