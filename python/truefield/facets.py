"""Splitting the facets of a mesh into smaller ones, for values that change across a facet."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from truefield.mesh import TriangleMesh


def refined(mesh: TriangleMesh, longest: float, most: int = 1_000_000) -> tuple[TriangleMesh, NDArray[np.int64]]:
    """The same surface with no edge longer than `longest`, and for each triangle the one that it is a part of.

    Edges are halved again and again, the same way for all triangles that share one, so no cracks appear. Stops
    early where it would take more than `most` triangles.
    """
    vertices, triangles = mesh.vertices, mesh.triangles.astype(np.int64)
    parents = np.arange(len(triangles), dtype=np.int64)
    while True:
        ends = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1), axis=-1)
        lengths = np.linalg.norm(vertices[ends[..., 0]] - vertices[ends[..., 1]], axis=-1)
        marked = lengths > longest
        if not marked.any() or len(triangles) + int(marked.sum()) > most:
            return TriangleMesh(vertices, triangles, name=mesh.name), parents
        edges, inverse = np.unique(ends[marked], axis=0, return_inverse=True)
        middles = np.full(triangles.shape, -1, dtype=np.int64)
        middles[marked] = len(vertices) + inverse.reshape(-1)
        vertices = np.concatenate([vertices, vertices[edges].mean(axis=1)])
        triangles, kept = _split(triangles, middles, np.where(marked, lengths, -1.0))
        parents = parents[kept]


def _split(
    triangles: NDArray[np.int64], middles: NDArray[np.int64], lengths: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Cuts triangles at the middles of their marked sides; also which triangle each piece comes from."""
    # Turned so that the longest marked side comes first.
    order = (np.argmax(lengths, axis=1)[:, None] + np.arange(3)) % 3
    (a, b, c) = np.take_along_axis(triangles, order, axis=1).T
    (p, q, r) = np.take_along_axis(middles, order, axis=1).T
    which = np.arange(len(triangles))
    first, second, third = p >= 0, q >= 0, r >= 0
    pieces: list[tuple[NDArray[np.int64], NDArray[np.int64]]] = []

    def cut(where: NDArray[np.bool_], *corners: tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]) -> None:
        pieces.extend((np.stack([x[where] for x in three], axis=1), which[where]) for three in corners)

    cut(~first, (a, b, c))
    # The longest side is halved and its middle joined to the far corner; the halves may be cut once more.
    cut(first & ~second, (p, b, c))
    cut(first & second, (p, b, q), (p, q, c))
    cut(first & ~third, (a, p, c))
    cut(first & third, (a, p, r), (p, c, r))
    return np.concatenate([part for part, _ in pieces]), np.concatenate([index for _, index in pieces])
