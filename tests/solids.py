"""Small meshes for the tests of files and meshes, made here so that no test needs a model."""

from __future__ import annotations

import numpy as np
import truefield as tf
from numpy.typing import NDArray

CORNERS: NDArray[np.float64] = np.array([[x, y, z] for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)])
QUADS = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]


def cube(scale: float = 1.0, name: str = "cube") -> tf.TriangleMesh:
    triangles = [t for a, b, c, d in QUADS for t in ((a, b, c), (a, c, d))]
    return tf.TriangleMesh(CORNERS * scale, triangles, name)


def blob(count: int = 12, seed: int = 1) -> tf.TriangleMesh:
    """A closed surface with corners that no short decimal holds."""
    generator = np.random.default_rng(seed)
    ring = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    levels = np.linspace(0.3, 2.8, count)
    points = [[np.sin(v) * np.cos(u), np.sin(v) * np.sin(u), np.cos(v)] for v in levels for u in ring]
    vertices = np.array([*points, [0, 0, 1], [0, 0, -1]]) * generator.uniform(0.9, 1.1, (count * count + 2, 1)) / 3.0
    triangles = []
    for i in range(count):
        j = (i + 1) % count
        triangles.append((count * count, i, j))
        triangles.append((count * count + 1, count * (count - 1) + j, count * (count - 1) + i))
        for k in range(count - 1):
            a, b, c, d = k * count + i, k * count + j, (k + 1) * count + i, (k + 1) * count + j
            triangles += [(a, c, b), (b, c, d)]
    return tf.TriangleMesh(vertices, triangles, "blob")


def volume(mesh: tf.TriangleMesh) -> float:
    a, b, c = mesh.corners.transpose(1, 0, 2)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)
