"""Isosurfaces of volumes, by every tool that is installed."""

from __future__ import annotations

import importlib.util
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

# As the published comparisons of flying edges: 13.6 million samples.
SIDE = 239

Values = NDArray[np.float32]
Mesh = tuple[NDArray[Any], NDArray[Any]]
Work = Callable[[], Any]
# Of a volume on the unit cube and a number of threads: what is timed, and what turns its result into (z, y, x) arrays.
Make = Callable[[Values, int], tuple[Work, Callable[[Any], Mesh]]]


def surface(threads: int, repeats: int, volume: int) -> dict[str, Any]:
    """A ball, whose surface crosses few cells, and a gyroid, whose crosses many; `volume` is the transforms' own."""
    del volume
    rows = []
    for name, values, slope in volumes():
        chosen = {tool: make for tool, (module, make) in TOOLS.items() if importlib.util.find_spec(module)}
        works = {tool: make(values, threads) for tool, make in chosen.items()}
        times: dict[str, list[float]] = {tool: [] for tool in chosen}
        meshes: dict[str, Mesh] = {}
        # In turns, so that what else the machine does falls on all.
        for _ in range(2 * repeats + 1):
            for tool, (work, arrays) in works.items():
                start = time.perf_counter()
                made = work()
                times[tool].append(time.perf_counter() - start)
                if tool not in meshes:
                    meshes[tool] = arrays(made)
        ours = min(times["truefield"])
        for tool, spent in times.items():
            vertices, triangles = meshes[tool]
            rows.append([
                f"{name} {SIDE}^3", tool, f"{min(spent) * 1e3:.1f}", f"{min(spent) / ours:.1f}", str(len(triangles)),
                str(rims(vertices, triangles)), f"{off(values, vertices) / slope:.0e}",
            ])  # fmt: skip
    head = ["volume", "tool", "ms", "ratio", "triangles", "open inside", "off (spacings)"]
    return {"title": f"isosurfaces, {threads} threads, best of rounds", "head": head, "rows": rows}


def volumes() -> list[tuple[str, Values, float]]:
    """Name, values, and how much they change over a spacing at the surface."""
    along = np.linspace(-1.0, 1.0, SIDE, dtype=np.float32)
    x, y, z = np.meshgrid(along, along, along, indexing="ij")
    ball = np.sqrt(x * x + y * y + z * z) - np.float32(0.8)
    k = np.float32(14.0)
    gyroid = np.sin(k * x) * np.cos(k * y) + np.sin(k * y) * np.cos(k * z) + np.sin(k * z) * np.cos(k * x)
    return [("ball", ball, 2.0 / (SIDE - 1)), ("gyroid", gyroid / k, 2.0 / (SIDE - 1))]


def rims(vertices: NDArray[Any], triangles: NDArray[Any]) -> int:
    """Sides of triangles without a partner that runs the other way, those on the border of the volume left out."""
    sides = np.concatenate([triangles[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))]).astype(np.int64)
    count = len(vertices)
    forward, backward = sides[:, 0] * count + sides[:, 1], sides[:, 1] * count + sides[:, 0]
    alone = ~np.isin(forward, backward)
    on_border = np.asarray(((vertices <= 0) | (vertices >= SIDE - 1)).any(axis=1))
    return int(np.count_nonzero(alone & ~(on_border[sides].all(axis=1))))


def off(values: Values, vertices: NDArray[Any]) -> float:
    """How far the interpolation at a vertex, which lies on an edge between two samples, is from zero at most."""
    low = np.clip(np.floor(vertices).astype(np.int64), 0, SIDE - 2)
    part = vertices - low
    total = np.zeros(len(vertices))
    for corner in range(8):
        step = np.array([corner >> axis & 1 for axis in range(3)])
        weight = np.where(step == 1, part, 1.0 - part).prod(axis=1)
        total += weight * values[tuple((low + step).T)]
    return float(np.abs(total).max())


def _ours(values: Values, threads: int) -> tuple[Work, Callable[[Any], Mesh]]:
    import truefield as tf

    field = tf.SampledField.from_array(values)
    return lambda: field.surface(border="open", threads=threads), lambda mesh: (mesh.vertices, mesh.triangles)


def _vtk(values: Values, threads: int) -> tuple[Work, Callable[[Any], Mesh]]:
    import vtk
    from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

    vtk.vtkSMPTools.SetBackend("STDThread")
    vtk.vtkSMPTools.Initialize(threads)
    image = vtk.vtkImageData()
    image.SetDimensions(*values.shape)
    image.GetPointData().SetScalars(numpy_to_vtk(np.ascontiguousarray(values.T).reshape(-1), deep=True))

    def work() -> Any:
        # Nothing but points and triangles, as ours.
        edges = vtk.vtkFlyingEdges3D()
        edges.SetInputData(image)
        edges.SetValue(0, 0.0)
        edges.ComputeNormalsOff()
        edges.ComputeGradientsOff()
        edges.ComputeScalarsOff()
        edges.Update()
        return edges.GetOutput()

    def arrays(made: Any) -> Mesh:
        points = vtk_to_numpy(made.GetPoints().GetData()).astype(np.float64)
        return points, vtk_to_numpy(made.GetPolys().GetConnectivityArray()).reshape(-1, 3)

    return work, arrays


def _scikit(values: Values, threads: int) -> tuple[Work, Callable[[Any], Mesh]]:
    from skimage.measure import marching_cubes

    del threads
    return lambda: marching_cubes(values, 0.0), lambda made: (made[0].astype(np.float64), made[1])


TOOLS: dict[str, tuple[str, Make]] = {
    "truefield": ("truefield", _ours),
    "VTK flying edges": ("vtk", _vtk),
    "scikit-image": ("skimage", _scikit),
}

JOBS: dict[str, Callable[[int, int, int], dict[str, Any]]] = {"surface": surface}
