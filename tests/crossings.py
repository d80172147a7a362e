"""Finds edges that pierce triangles: proof, by brute force over a grid of cells, that a mesh does not cut itself."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from truefield.mesh import TriangleMesh

Indices = NDArray[np.int64]
Array = NDArray[np.float64]


def piercings(mesh: TriangleMesh, cell: float) -> Indices:
    """(k, 3) rows of edge start, edge end, triangle: edges that properly pierce a triangle they share no vertex with.

    Both bodies are listed in the cells of size `cell` that they may touch; a common cell makes a pair. Contacts within
    rounding of a corner or an edge do not count. For up to some 200,000 triangles.
    """
    edges = np.unique(np.sort(mesh.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    edge_keys, edge_ids = _cells(mesh.vertices[edges], cell, mesh.extent[0])
    triangle_keys, triangle_ids = _cells(mesh.corners, cell, mesh.extent[0])
    order = np.argsort(triangle_keys, kind="stable")
    triangle_keys, triangle_ids = triangle_keys[order], triangle_ids[order]
    found = []
    for start in range(0, len(edge_keys), 200_000):
        keys, ids = edge_keys[start : start + 200_000], edge_ids[start : start + 200_000]
        low, high = np.searchsorted(triangle_keys, keys), np.searchsorted(triangle_keys, keys, side="right")
        count = high - low
        offset = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        e, t = np.repeat(ids, count), triangle_ids[np.repeat(low, count) + offset]
        apart = (edges[e][:, :, None] != mesh.triangles[t][:, None, :]).all(axis=(1, 2))
        e, t = e[apart], t[apart]
        hit = _pierce(mesh.vertices[edges[e]], mesh.corners[t])
        found.append(np.column_stack([edges[e[hit]], t[hit]]))
    return np.unique(np.concatenate(found), axis=0)


def _cells(bodies: Array, cell: float, origin: Array) -> tuple[Indices, Indices]:
    """Keys of the cells that segments (n, 2, 3) or triangles (n, 3, 3) may touch, and whose they are."""
    low = np.floor((bodies.min(axis=1) - origin) / cell).astype(np.int64)
    shape = np.floor((bodies.max(axis=1) - origin) / cell).astype(np.int64) - low + 1
    keys, owners = [], []
    size = shape.prod(axis=1)
    for part in np.array_split(np.arange(len(bodies)), 1 + int(size.sum()) // 4_000_000):
        count = size[part]
        owner = np.repeat(part, count)
        rank = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        extent = shape[owner]
        index = np.column_stack(
            [rank // (extent[:, 1] * extent[:, 2]), rank // extent[:, 2] % extent[:, 1], rank % extent[:, 2]]
        )
        index += low[owner]
        centre = origin + (index + 0.5) * cell
        a, b = bodies[owner, 0], bodies[owner, 1]
        reach = 0.8661 * cell
        if bodies.shape[1] == 2:
            along = (b - a) / np.linalg.norm(b - a, axis=1, keepdims=True)
            off = np.linalg.norm(np.cross(centre - a, along), axis=1)
        else:
            normal = np.cross(b - a, bodies[owner, 2] - a)
            normal /= np.linalg.norm(normal, axis=1, keepdims=True)
            off = np.abs(((centre - a) * normal).sum(axis=1))
        near = off <= reach
        keys.append(index[near] @ np.array([1 << 40, 1 << 20, 1]))
        owners.append(owner[near])
    return np.concatenate(keys), np.concatenate(owners)


def _pierce(segments: Array, triangles: Array) -> NDArray[np.bool_]:
    p, q = segments[:, 0], segments[:, 1]
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    scale = 1e-13 * (np.abs(segments).max(initial=0.0) + np.abs(triangles).max(initial=0.0)) ** 3

    def side(u: Array, v: Array, w: Array, x: Array) -> NDArray[np.int64]:
        volume = (np.cross(v - u, w - u) * (x - u)).sum(axis=1)
        return np.where(np.abs(volume) > scale, np.sign(volume), 0.0).astype(np.int64)

    through = side(a, b, c, p) * side(a, b, c, q) < 0
    turns = np.stack([side(p, q, a, b), side(p, q, b, c), side(p, q, c, a)])
    inside: NDArray[np.bool_] = (turns.min(axis=0) > 0) | (turns.max(axis=0) < 0)
    return through & inside
