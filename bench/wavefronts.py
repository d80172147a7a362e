"""The hybrid marching wavefront at the sizes of Table 1 of the paper on bounded distance transforms.

Their volumes are boundary voxels of three models; ours are those of a ball stretched to the same numbers of voxels.
SciPy's brute force (`distance_transform_bf`), which the paper calls SciPy, runs on the same volume where it takes
less than about a minute. Its work is voxels times boundary voxels: its time for one of those tells this machine from
theirs.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench import paper

# Voxels times boundary voxels beyond which SciPy would take minutes.
MOST_WORK = 8e9

Volume = NDArray[np.bool_]


def wavefront(threads: int, repeats: int) -> dict[str, Any]:
    """Table 1, voxels: the wavefront beside the exact transform, SciPy and the paper's own CPU."""
    import truefield as tf

    rows, machine = [], dict[str, float]()
    for fact in paper.WAVEFRONTS:
        volume = boundary(fact.shape)
        sites = volume.size - int(np.count_nonzero(volume))
        march, found = _least(repeats, tf.distance_transform, volume, method="wavefront", threads=threads)
        exact, judge = _least(repeats, tf.distance_transform, volume, threads=threads)
        if not np.array_equal(np.asarray(found), judge):
            raise RuntimeError("the wavefront is not the exact transform")
        scipy = _scipy(volume) if volume.size * sites < MOST_WORK else None
        if scipy is not None:
            machine.setdefault(fact.model, scipy * 1e3 / sites / (fact.scipy / fact.boundary))
        factor = machine.get(fact.model)
        rows.append([
            f"{fact.model} {' x '.join(map(str, fact.shape))}", f"{sites:,}", f"{march * 1e3:.1f}",
            f"{march / volume.size * 1e9:.0f}", str(found.passes), f"{exact * 1e3:.1f}",
            "-" if scipy is None else f"{scipy * 1e3:.0f}", f"{fact.scipy:.0f}", f"{fact.processor:.0f}",
            "-" if factor is None else f"{fact.processor * factor / march / 1e3:.0f}",
        ])  # fmt: skip
    head = [
        "as large as", "boundary", "wavefront ms", "ns/voxel", "passes", "exact ms",
        "SciPy ms", "paper: SciPy", "paper: CPU", "CPU / ours",
    ]  # fmt: skip
    title = f"Table 1: wavefronts, {threads} threads, best of rounds; the last column is normalised by SciPy"
    return {"title": title, "head": head, "rows": rows}


def boundary(shape: tuple[int, int, int]) -> Volume:
    """False in the voxels that the surface of a stretched ball touches."""
    import truefield as tf

    part = tf.shapes.sphere(subdivisions=6)
    low, high = part.extent
    stretched = tf.TriangleMesh((part.vertices - low) / (high - low) * (np.array(shape) - 1), part.triangles)
    marks = tf.voxelize(stretched, spacing=1.0)
    if marks.shape != shape:
        raise RuntimeError(f"{marks.shape} voxels instead of {shape}")
    return ~np.asarray(marks)


def _least(repeats: int, work: Callable[..., Any], *arguments: Any, **options: Any) -> tuple[float, Any]:
    """The shortest of some rounds, at least five where they are short, and the last result."""
    times: list[float] = []
    while len(times) < repeats or (sum(times) < 0.5 and len(times) < 5):
        start = time.perf_counter()
        result = work(*arguments, **options)
        times.append(time.perf_counter() - start)
    return min(times), result


def _scipy(volume: Volume) -> float | None:
    try:
        from scipy import ndimage
    except ImportError:
        return None
    start = time.perf_counter()
    ndimage.distance_transform_bf(volume)
    return time.perf_counter() - start
