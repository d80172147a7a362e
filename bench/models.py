"""What is measured: your own models, or the shapes truefield makes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import truefield as tf

SUFFIXES = {".stl", ".obj", ".ply", ".off", ".glb", ".gltf", ".3mf"}


def models(folder: Path | None, only: list[str]) -> Iterator[tf.TriangleMesh]:
    """Meshes of the folder whose names contain one of `only` (all if empty), or shapes if there is no folder."""
    if folder is None:
        for name in ("brevi", "housing", "cylinder_head"):
            if not only or any(word in name for word in only):
                yield getattr(tf.shapes, name)()
        return
    for path in sorted(folder.iterdir()):
        if path.suffix.lower() in SUFFIXES and (not only or any(word in path.name.lower() for word in only)):
            part = tf.read(path)
            yield welded(part) if path.suffix.lower() == ".stl" else part


def welded(part: tf.TriangleMesh) -> tf.TriangleMesh:
    """The part with corners joined that differ by less than single precision resolves: an STL file keeps no indices.

    Some tools join such corners themselves and some refuse a mesh whose corners are apart, so that only joining
    them for all lets all do the same work.
    """
    return part.weld(float(np.abs(part.vertices).max()) * float(np.finfo(np.float32).eps))
