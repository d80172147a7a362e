"""Rays against an adaptive field, and against the same surface as triangles in Open3D."""

from __future__ import annotations

import importlib.util
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

# Pixels a side of the picture whose rays are cast.
SIDE = 1024

Rows = NDArray[np.float64]


def rays(threads: int, repeats: int, volume: int) -> dict[str, Any]:
    """Primary rays of a picture of a casting; `volume` is the transforms' own."""
    import truefield as tf

    del volume
    part = tf.shapes.housing()
    field = tf.adaptive_field(part, 0.1, growth=np.inf, rule="samples", max_depth=8)
    mesh = field.surface(threads=threads)
    origins, directions = picture(*mesh.extent)
    works: dict[str, Callable[[], Rows]] = {
        f"truefield, {method}": lambda method=method: (  # type: ignore[misc]
            field.raycast(origins, directions, method=method, threads=threads).distance
        )
        for method in ("linear", "cubic")
    }
    if importlib.util.find_spec("open3d"):
        works["Open3D (Embree)"] = _open3d(mesh, origins, directions, threads)
    best, hits = dict.fromkeys(works, np.inf), {}
    # In turns, so that what else the machine does falls on all.
    for _ in range(2 * repeats + 1):
        for tool, work in works.items():
            start = time.perf_counter()
            hits[tool] = work()
            best[tool] = min(best[tool], time.perf_counter() - start)
    ours = hits["truefield, cubic"]
    rows = []
    for tool, spent in best.items():
        found = np.isfinite(hits[tool])
        both = found & np.isfinite(ours)
        apart = float(np.median(np.abs(hits[tool][both] - ours[both])))
        rows.append([tool, f"{len(origins) / spent / 1e6:.1f}", f"{found.mean():.1%}", f"{apart:.0e}"])
    counts = field.statistics()
    title = f"{len(origins)} rays, {threads} threads, {counts['leaves']} leaves or {len(mesh.triangles)} triangles"
    return {"title": title, "head": ["tool", "million a second", "hits", "median from cubic"], "rows": rows}


def picture(low: Rows, high: Rows) -> tuple[Rows, Rows]:
    """Parallel rays, row by row, that see the box along the diagonal of a cube."""
    forward = np.array([-1.0, 1.0, -1.0]) / np.sqrt(3.0)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    radius = 0.5 * float(np.linalg.norm(high - low))
    along = ((np.arange(SIDE) + 0.5) / SIDE * 2.0 - 1.0) * radius
    x, y = np.meshgrid(along, along)
    origins = 0.5 * (low + high) - 3.0 * radius * forward + x.reshape(-1, 1) * right + y.reshape(-1, 1) * up
    return origins, np.tile(forward, (len(origins), 1))


def _open3d(mesh: Any, origins: Rows, directions: Rows, threads: int) -> Callable[[], Rows]:
    import open3d

    scene = open3d.t.geometry.RaycastingScene(nthreads=threads)
    tensor = open3d.core.Tensor
    scene.add_triangles(tensor(mesh.vertices.astype(np.float32)), tensor(mesh.triangles.astype(np.uint32)))
    rays = tensor(np.concatenate([origins, directions], axis=1).astype(np.float32))
    return lambda: np.asarray(scene.cast_rays(rays)["t_hit"].numpy(), dtype=np.float64)


JOBS: dict[str, Callable[[int, int, int], dict[str, Any]]] = {"rays": rays}
