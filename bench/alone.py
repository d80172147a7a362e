"""What no peer does: complete fields, their contours and heavy sections; the papers' numbers stand beside ours."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench import adaptive, paper, wavefronts
from bench.clock import Peak
from bench.judge import Judge

# Contour points of which brute force checks the distance.
CHECKED = 500

Table = dict[str, Any]


def engine(threads: int, repeats: int) -> Table:
    """The engine-like part: field of resolution 300, contours at 8.5 and 10 mm depth and 0.1 mm tolerance."""
    import truefield as tf

    part = tf.shapes.cylinder_head()
    judge = Judge(np.asarray(part.vertices), np.asarray(part.triangles, dtype=np.int64))
    peak = Peak()
    build, field = _median(repeats, tf.complete_field, part, resolution=300, threads=threads)
    shells = {depth: _median(repeats, field.contour, -depth, tolerance=0.1, threads=threads) for depth in (8.5, 10.0)}
    rise = peak.mebibytes()
    rows = [["complete field, resolution 300", _s(build), "", "", "", ""]]
    for depth, (seconds, shell) in shells.items():
        error = _contour_error(judge, np.asarray(shell.points), depth)
        papers = f"{paper.ENGINE_SECONDS:.0f} s" if depth == 10.0 else ""
        rows.append(
            [f"contour at {depth} mm", _s(seconds), _n(len(shell.points)), _rate(shell, seconds), error, papers]
        )
    rows.append(["together", _s(build + sum(seconds for seconds, _ in shells.values())), "", "", "", ""])
    rows.append(["peak memory", f"{rise:.0f} MiB", "", "", "", ""])
    return {
        "title": f"engine-like part ({len(part.triangles)} triangles), tolerance 0.1 mm",
        "head": ["step", "time", "points", "points/s", "worst |d - depth| (mm)", "paper"],
        "rows": rows,
    }


def contours(threads: int, repeats: int, vertices: NDArray[np.float64], triangles: NDArray[np.int64]) -> Table:
    """Contours a fiftieth and a hundredth of the longest side outside and inside, tolerance a thousandth of it."""
    import truefield as tf

    part = tf.TriangleMesh(vertices, triangles)
    judge, longest = Judge(vertices, triangles), float(np.ptp(vertices[triangles], axis=(0, 1)).max())
    build, field = _median(repeats, tf.complete_field, part, resolution=128, threads=threads)
    rows = [["complete field, resolution 128", _s(build), "", "", ""]]
    for level in (0.02, -0.01):
        d = level * longest
        seconds, shell = _median(repeats, field.contour, d, tolerance=longest / 1000, threads=threads)
        error = _contour_error(judge, np.asarray(shell.points), abs(d))
        rows.append(
            [
                f"contour at {level:+.0%} of the longest side",
                _s(seconds),
                _n(len(shell.points)),
                _rate(shell, seconds),
                error,
            ]
        )
    return {"title": "contours", "head": ["step", "time", "points", "points/s", "worst error (units)"], "rows": rows}


def memory(threads: int, repeats: int, vertices: NDArray[np.float64], triangles: NDArray[np.int64]) -> Table:
    """Size of complete fields against the paper's layout of 4 n + 5 bytes for a cell of n triangles."""
    import truefield as tf

    del repeats  # Sizes do not vary.
    part, rows = tf.TriangleMesh(vertices, triangles), []
    for resolution in (64, 128, 256):
        peak = Peak()
        start = time.perf_counter()
        field = tf.complete_field(part, resolution=resolution, threads=threads)
        seconds, rise, facts = time.perf_counter() - start, peak.mebibytes(), field.statistics()
        cells = facts["inside"] + facts["surface"] + facts["outside"]
        size = facts["bytes"] / 2**20
        per_cell, of_paper = facts["bytes"] / cells, facts["bytes"] / facts["paper_bytes"]
        rows.append([
            str(resolution), _s(seconds), _n(int(cells)), f"{facts['long'] / cells:.1%}", f"{size:.1f}",
            f"{per_cell:.2f}", f"{of_paper:.2f}", f"{rise:.0f}", f"{rise / size:.1f}",
        ])  # fmt: skip
        del field
    head = ["resolution", "time", "cells", "ask the tree", "MiB", "bytes/cell", "of 4n+5", "peak MiB", "peak / size"]
    return {"title": "memory of complete fields", "head": head, "rows": rows}


def fields(threads: int, repeats: int) -> Table:
    """Tables 2 to 4: fields of the papers' models, inside and on the surface as there."""
    import truefield as tf

    rows = []
    for row in paper.FIELDS:
        part = getattr(tf.shapes, row.shape)()
        options = {"resolution": row.resolution, "region": "inside", "threads": threads}
        seconds, field = _median(repeats, tf.complete_field, part, **options)
        facts = field.statistics()
        cells = "/".join(f"{facts[name] / 1e3:.1f}" for name in ("inside", "surface", "outside"))
        rows.append([
            f"{row.table}: {row.shape} {row.resolution}", f"{len(part.triangles)}", _s(seconds), _s(row.seconds),
            f"{facts['bytes'] / 1e3:.0f}", str(row.kilobytes), cells, f"{row.inside}/{row.surface}/{row.outside}",
            f"{facts['surface_mean']:.2f}", str(row.surface_mean), f"{facts['inside_mean']:.2f}", str(row.inside_mean),
        ])  # fmt: skip
    head = [
        "table",
        "triangles",
        "time",
        "paper",
        "KB",
        "paper",
        "in/sur/out (thousand)",
        "paper",
        "n/sur",
        "paper",
        "n/in",
        "paper",
    ]
    return {"title": "Tables 2 to 4: complete fields", "head": head, "rows": rows}


def shells(threads: int, repeats: int) -> Table:
    """Tables 5 to 7: contours of the papers' models."""
    import truefield as tf

    rows, made = [], dict[tuple[str, int], Any]()
    for row in paper.CONTOURS:
        key = row.shape, row.resolution
        if key not in made:
            part = getattr(tf.shapes, row.shape)()
            made[key] = part, tf.complete_field(part, resolution=row.resolution, region="inside", threads=threads)
        part, field = made[key]
        tolerance = float(np.ptp(np.asarray(part.vertices), axis=0).max()) / row.accuracy
        seconds, shell = _median(repeats, field.contour, -row.depth, tolerance=tolerance, threads=threads)
        count = len(shell.points)
        rows.append([
            f"{row.shape} {row.resolution}", str(row.depth), str(row.accuracy), _s(seconds), _s(row.seconds), _n(count),
            f"{seconds / count * 1e6:.3f}" if count else "-", str(row.microseconds_per_point),
        ])  # fmt: skip
    head = ["field", "depth", "accuracy", "time", "paper", "points", "us/point", "paper"]
    return {"title": "Tables 5 to 7: contours (tolerance: longest side / accuracy)", "head": head, "rows": rows}


def heavy(threads: int, repeats: int) -> Table:
    """Heavy sections: the housing's above 10, the engine-like part's above 17 (depth 8.5, as in the paper)."""
    import truefield as tf

    rows = []
    for name, above, tolerance in (("housing", 10.0, 0.05), ("cylinder_head", 17.0, 0.1)):
        part = getattr(tf.shapes, name)()
        peak = Peak()
        seconds, report = _median(repeats, tf.thickness, part, above=above, tolerance=tolerance, threads=threads)
        depth, sections = report.greatest_depth.depth, report.heavy_sections
        volume = sum(s.volume.lower for s in sections), sum(s.volume.upper for s in sections)
        rows.append([
            name, _n(len(part.triangles)), f"{above:g}", f"{tolerance:g}", _s(seconds), str(len(sections)),
            f"{depth.lower:.3f} to {depth.upper:.3f}", f"{volume[0]:.0f} to {volume[1]:.0f}", f"{peak.mebibytes():.0f}",
        ])  # fmt: skip
    head = ["part", "triangles", "above", "tolerance", "time", "sections", "greatest depth", "their volume", "peak MiB"]
    return {"title": "heavy sections", "head": head, "rows": rows}


JOBS: dict[str, Callable[..., Table]] = {
    "contours": contours, "memory": memory, "engine": engine, "fields": fields, "shells": shells, "heavy": heavy,
    "wavefront": wavefronts.wavefront, "adaptive": adaptive.parts, "sphere": adaptive.sphere, "trees": adaptive.trees,
    "carving": adaptive.carving,
}  # fmt: skip
# These take each model; the others bring their own.
WITH_MODEL = ("contours", "memory", "adaptive")


def _median(repeats: int, work: Callable[..., Any], *arguments: Any, **options: Any) -> tuple[float, Any]:
    """Median time of some rounds, and the last result; small jobs get at least five rounds."""
    times: list[float] = []
    result = None
    while len(times) < repeats or (sum(times) < 0.5 and len(times) < 5):
        del result
        start = time.perf_counter()
        result = work(*arguments, **options)
        times.append(time.perf_counter() - start)
    return float(np.median(times)), result


def _contour_error(judge: Judge, points: NDArray[np.float64], distance: float) -> str:
    """Furthest that a random part of the points is from its distance."""
    if not len(points):
        return "no points"
    rows = np.random.default_rng(11).choice(len(points), min(CHECKED, len(points)), replace=False)
    return f"{np.abs(judge.distance(points[rows].astype(np.float64)) - distance).max():.1e}"


def _s(seconds: float) -> str:
    return f"{seconds:.2f} s" if seconds >= 1 else f"{seconds * 1e3:.1f} ms"


def _n(count: int) -> str:
    return f"{count:,}"


def _rate(shell: Any, seconds: float) -> str:
    return f"{len(shell.points) / seconds / 1e6:.2f} M"
