"""Exact distance transforms of images, by every tool that is installed."""

from __future__ import annotations

import importlib.util
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.clock import Peak

Image = NDArray[np.uint8]
Work = Callable[[Image], Any]

# Voxels whose distance is judged by brute force.
CHECKED = 200


@dataclass(frozen=True)
class Tool:
    """One way to transform an image."""

    name: str
    module: str
    make: Callable[[int], Work]
    axes: tuple[int, ...] = (2, 3)
    # With the nearest background voxel of each voxel.
    sites: bool = False
    # Too slow for more than one round.
    once: bool = False


def transform(threads: int, repeats: int, volume: int) -> dict[str, Any]:
    """A solid shell and 1% random sites, `volume` voxels a side in 3D and eight times that in 2D."""
    rows = []
    for name, image in images(volume):
        chosen = [t for t in TOOLS if image.ndim in t.axes and importlib.util.find_spec(t.module)]
        works = {tool.name: tool.make(threads) for tool in chosen}
        times: dict[str, list[float]] = {tool.name: [] for tool in chosen}
        errors, memory = dict[str, float](), dict[str, float]()
        judged = judge(image)
        for tool in chosen:
            works[tool.name](image[:8, ..., :8].copy())  # Imports, before memory is watched.
        # In turns, so that what else the machine does falls on all.
        for round_ in range(repeats):
            for tool in chosen:
                if round_ and tool.once:
                    continue
                peak, start = Peak(), time.perf_counter()
                result = works[tool.name](image)
                times[tool.name].append(time.perf_counter() - start)
                if not round_:
                    memory[tool.name] = peak.mebibytes()
                    found = np.abs(np.asarray(result)[judged[0]].astype(np.float64))
                    errors[tool.name] = float(np.abs(found - judged[1]).max())
                del result
        ours = {sites: min(times["truefield, indices" if sites else "truefield"]) for sites in (False, True)}
        for tool in chosen:
            least = min(times[tool.name])
            rows.append([
                f"{name} {' x '.join(map(str, image.shape))}", tool.name, f"{least / image.size * 1e9:.1f}",
                f"{least / ours[tool.sites]:.1f}", f"{errors[tool.name]:.0e}", f"{memory[tool.name]:.0f}",
            ])  # fmt: skip
    head = ["image", "tool", "ns/voxel", "ratio", "error (voxels)", "peak MiB"]
    return {"title": f"exact distance transforms, {threads} threads, best of rounds", "head": head, "rows": rows}


def images(volume: int) -> list[tuple[str, Image]]:
    """Zero is background: in the shell or ring distances are short, at random sites they are short everywhere."""
    made = []
    for axes, side in ((3, volume), (2, 8 * volume)):
        along = ((np.arange(side) + 0.5) / side - 0.5) ** 2
        square = sum(np.ix_(*[along.astype(np.float32)] * axes), np.float32(0))
        radius = np.sqrt(square)
        made.append(("shell", ((radius > 0.3) & (radius < 0.4)).astype(np.uint8)))
        random = np.random.default_rng(7).integers(0, 100, (side,) * axes, np.uint8)
        made.append(("random", (random > 0).astype(np.uint8)))
    return made


def judge(image: Image) -> tuple[tuple[NDArray[np.int64], ...], NDArray[np.float64]]:
    """Some foreground voxels, and their distances by brute force over all background voxels near them."""
    rng = np.random.default_rng(8)
    found: list[float] = []
    places: list[NDArray[np.int64]] = []
    while len(found) < CHECKED:
        place = rng.integers(0, image.shape)
        if not image[tuple(place)]:
            continue
        reach = 8
        while True:
            low, high = np.maximum(place - reach, 0), np.minimum(place + reach + 1, image.shape)
            window = image[tuple(slice(a, b) for a, b in zip(low, high, strict=True))]
            sites = np.argwhere(window == 0) + low - place
            if len(sites) and (least := (sites**2).sum(axis=1).min()) <= reach**2:
                break
            reach *= 2
        places.append(place)
        found.append(float(np.sqrt(least)))
    return tuple(np.transpose(places)), np.array(found)


def _ours(**options: Any) -> Callable[[int], Work]:
    def make(threads: int) -> Work:
        import truefield as tf

        return lambda image: tf.distance_transform(image, threads=threads, **options)

    return make


def _edt(threads: int) -> Work:
    import edt

    return lambda image: edt.edt(image, parallel=threads)


def _itk(threads: int) -> Work:
    import SimpleITK

    SimpleITK.ProcessObject.SetGlobalDefaultNumberOfThreads(threads)

    def work(image: Image) -> Any:
        # From the foreground's side: distances to the background are those of its complement's outside.
        given = SimpleITK.GetImageFromArray((image == 0).view(np.uint8))
        made = SimpleITK.SignedMaurerDistanceMap(given, squaredDistance=False, useImageSpacing=True)
        return SimpleITK.GetArrayViewFromImage(made).copy()

    return work


def _scipy(**options: Any) -> Callable[[int], Work]:
    def make(_: int) -> Work:
        from scipy import ndimage

        if "return_indices" in options:
            return lambda image: ndimage.distance_transform_edt(image, **options)[0]
        plain: Work = ndimage.distance_transform_edt
        return plain

    return make


def _opencv(threads: int) -> Work:
    import cv2

    cv2.setNumThreads(threads)
    return lambda image: cv2.distanceTransform(image, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)


TOOLS = (
    Tool("truefield", "truefield", _ours()),
    Tool("truefield, indices", "truefield", _ours(return_indices=True), sites=True),
    Tool("truefield, signed", "truefield", _ours(signed=True)),
    Tool("edt", "edt", _edt),
    Tool("SimpleITK", "SimpleITK", _itk),
    Tool("OpenCV", "cv2", _opencv, axes=(2,)),
    Tool("SciPy", "scipy", _scipy(), once=True),
    Tool("SciPy, indices", "scipy", _scipy(return_indices=True), sites=True, once=True),
)

JOBS: dict[str, Callable[[int, int, int], dict[str, Any]]] = {"transform": transform}
