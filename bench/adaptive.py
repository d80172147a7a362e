"""Adaptive fields: the experiments of Frisken et al. 2000, and what building, asking and carving take.

The published table lost its numbers; the experiment is rerun. "Region tree" is the tree that divides every cell the
boundary passes through, down to the finest cell of the adaptive one, as quadtrees and octrees of images do.
"""

from __future__ import annotations

import functools
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.clock import Peak

Table = dict[str, Any]

# Longest distance of a region tree's samples, in finest cells a side; more would not fit a table's minute.
FINEST_3D = 8
FINEST_2D = 11


def sphere(threads: int, repeats: int) -> Table:
    """The paper's Table 1: a unit sphere by tolerance, beside a mesh that is as good."""
    from truefield import csg

    rows = []
    for tolerance in (1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 3e-4):
        for rule in ("verified", "samples"):
            seconds, field = _least(repeats, _maker(
                csg.sphere(1.0), tolerance, growth=np.inf, rule=rule, threads=threads))  # fmt: skip
            counts = field.statistics()
            points = _shell(200_000)
            worst = float(np.abs(field.distance(points)).max())
            rows.append([
                f"{tolerance:g}", rule, f"{counts['cells']:,}", f"{counts['leaves']:,}", str(counts["depth"]),
                f"{worst:.1e}", f"{_triangles(tolerance):,}", f"{counts['bytes'] / 1024:.0f}", f"{seconds * 1e3:.1f}",
            ])  # fmt: skip
    head = [
        "tolerance", "rule", "cells", "leaves", "depth", "worst on the sphere", "triangles as good", "KiB", "ms",
    ]  # fmt: skip
    return {"title": "unit sphere, cells divided at the surface only", "head": head, "rows": rows}


def trees(threads: int, repeats: int) -> Table:
    """Adaptive trees beside region trees of equal finest cell: the paper's letter R, and solids."""
    from truefield import csg, polygons

    slab = csg.box((4, 4, 1)) - csg.sphere(1.2).translate((0, 0, 0.5))
    shapes = [
        ("letter R, quadtree", polygons.letter_r(), 2, FINEST_2D, 5e-4),
        ("ball", csg.sphere(1.0), 3, FINEST_3D, 1e-3),
        ("slab with a bowl", slab, 3, FINEST_3D, 1e-3),
        ("Menger sponge, level 3", csg.menger_sponge(3), 3, FINEST_3D, 1e-3),
    ]
    rows = []
    for name, shape, axes, finest, part in shapes:
        low, high = shape.extent or (np.zeros(3), np.ones(3))
        size = float(np.max((high - low)[:axes]))
        for rule in ("verified", "samples"):
            seconds, field = _least(repeats, _maker(
                shape, part * size, growth=np.inf, max_depth=finest, rule=rule, threads=threads))  # fmt: skip
            counts = field.statistics()
            region = _region(shape, field, axes, counts["depth"])
            rows.append([
                name, f"{part * size:.1e}", rule, str(counts["depth"]), f"{counts['cells']:,}", f"{region:,}",
                f"{region / counts['cells']:.1f}", f"{seconds * 1e3:.0f}",
            ])  # fmt: skip
    head = ["shape", "tolerance", "rule", "depth", "cells", "region tree", "ratio", "ms"]
    return {"title": "adaptive and region trees of equal finest cell", "head": head, "rows": rows}


def carving(threads: int, repeats: int) -> Table:
    """Strokes of a ball-ended chisel on a field of a million leaves."""
    import truefield as tf
    from truefield import csg

    del repeats
    field = tf.adaptive_field(csg.sphere(1.0), 4e-5, growth=np.inf, max_depth=9, rule="samples", threads=threads)
    before = field.statistics()
    random = np.random.default_rng(1)
    spent = []
    for _ in range(200):
        start, way = random.normal(size=(2, 3))
        start /= np.linalg.norm(start)
        end = start + 0.1 * way / np.linalg.norm(way)
        path = np.array([start, end / np.linalg.norm(end)])
        begin = time.perf_counter()
        field = field.carve(csg.sphere(0.04), path=path, threads=threads)
        spent.append(time.perf_counter() - begin)
    after = field.statistics()
    each = np.array(spent) * 1e3
    rows = [[
        f"{before['leaves']:,}", f"{after['leaves']:,}", f"{np.median(each):.1f}", f"{np.percentile(each, 95):.1f}",
        f"{each[-20:].mean():.1f}",
    ]]  # fmt: skip
    head = ["leaves before", "after 200 strokes", "median ms", "95 % ms", "last 20, mean ms"]
    return {
        "title": "carving: strokes 0.1 long with a ball of 0.04 on the unit sphere, tolerance 5e-5",
        "head": head,
        "rows": rows,
    }


def parts(threads: int, repeats: int, vertices: NDArray[np.float64], triangles: NDArray[np.int64]) -> Table:
    """A model at depth 8, tolerance a thousandth of its longest side, beside dense samples of the same finest cell."""
    import truefield as tf

    mesh = tf.TriangleMesh(vertices, triangles)
    low, high = mesh.extent
    longest = float(np.max(high - low))
    ready, surface = _least(repeats, lambda: tf.Surface(mesh, threads=threads))
    random = np.random.default_rng(2)
    points = random.uniform(low, high, (1_000_000, 3))
    truth = surface.distance(points, threads=threads)
    rows = [["surface: tree and sign rule", _ms(ready), "", "", "", "", ""]]
    cases: list[tuple[str, dict[str, Any]]] = [
        ("linear, verified", {"growth": 0.05}),
        ("linear, samples", {"growth": 0.05, "rule": "samples"}),
        ("linear, verified, surface only", {"growth": np.inf}),
        ("exact", {"method": "exact"}),
        ("mixed, verified", {"growth": 0.05, "method": "mixed"}),
    ]
    for name, how in cases:
        peak = Peak()
        seconds, field = _least(repeats, _maker(surface, longest / 1000, max_depth=8, threads=threads, **how))
        rise = peak.mebibytes()
        query, said = _least(repeats, functools.partial(field.distance, points, threads=threads))
        lower, upper = field.bounds(points, threads=threads)
        if not ((lower <= truth) & (truth <= upper)).all():
            raise RuntimeError("bounds that do not hold the truth")
        counts = field.statistics()
        worst = np.abs(said - truth).max() / longest
        rows.append([
            name, _ms(seconds), f"{counts['leaves']:,}", f"{counts['bytes'] / 2**20:.1f}", f"{rise:.0f}",
            f"{worst:.1e}", _ms(query),
        ])  # fmt: skip
    dense, samples = _least(repeats, lambda: surface.sample(257, margin=longest / 8, threads=threads))
    bytes_taken = np.asarray(samples.values).nbytes / 2**20
    rows.append(["dense samples, 257 a side", _ms(dense), "", f"{bytes_taken:.1f}", "", "", ""])
    head = ["field", "build ms", "leaves", "MiB", "peak MiB", "worst error / longest side", "million queries ms"]
    return {"title": f"adaptive fields of a model of {len(triangles)} triangles, depth 8", "head": head, "rows": rows}


def _triangles(tolerance: float) -> int:
    """How many triangles an icosphere needs to stay as near to the unit sphere, inside and out."""
    import truefield as tf

    mesh = tf.shapes.sphere(subdivisions=4)
    centers = np.asarray(mesh.vertices)[np.asarray(mesh.triangles)].mean(axis=1)
    radius = float(np.linalg.norm(np.asarray(mesh.vertices), axis=1).max())
    # Half the depth below the sphere when the mesh is centred on it; depth falls with one over their number.
    depth = 0.5 * (1.0 - float(np.linalg.norm(centers, axis=1).min()) / radius)
    return int(np.ceil(len(centers) * depth / tolerance))


def _region(shape: Any, field: Any, axes: int, depth: int) -> int:
    """Cells of the tree that divides all cells with corners on both sides."""
    low, high = field.extent
    n = 2**depth
    lines = [np.linspace(low[axis], high[axis], n + 1) for axis in range(axes)]
    mixed = np.zeros((n,) * axes, dtype=bool)
    before: NDArray[np.bool_] | None = None
    for i, x in enumerate(lines[0]):
        grid = np.meshgrid([x], *lines[1:], *([[0.0]] if axes == 2 else []), indexing="ij")
        inside = (shape.distance(np.stack([g.ravel() for g in grid], axis=1)) < 0).reshape((n + 1,) * (axes - 1))
        if before is not None:
            both = np.stack([before, inside])
            corners = [both]
            for axis in range(1, axes):
                corners = [np.take(c, range(k, n + k), axis=axis) for c in corners for k in (0, 1)]
            stacked = np.stack(corners)
            mixed[i - 1] = np.logical_and(stacked.any(axis=(0, 1)), ~stacked.all(axis=(0, 1)))
        before = inside
    cells, children = 1, 2**axes
    while mixed.size > 1:
        for axis in range(axes):
            pairs = mixed.reshape(*mixed.shape[:axis], -1, 2, *mixed.shape[axis + 1 :])
            mixed = np.logical_or.reduce(pairs, axis=axis + 1)
        cells += children * int(np.count_nonzero(mixed))
    return cells


def _shell(count: int) -> NDArray[np.float64]:
    directions = np.random.default_rng(3).normal(size=(count, 3))
    return np.asarray(directions / np.linalg.norm(directions, axis=1, keepdims=True))


def _least(repeats: int, work: Callable[[], Any]) -> tuple[float, Any]:
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        result = work()
        times.append(time.perf_counter() - start)
    return min(times), result


def _maker(shape: Any, tolerance: float, **how: Any) -> Callable[[], Any]:
    import truefield as tf

    return functools.partial(tf.adaptive_field, shape, tolerance, **how)


def _ms(seconds: float) -> str:
    return f"{seconds * 1e3:.0f}"
