"""The lattice of sample points that every tool fills."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Lattice:
    """Samples at `first + (i, j, k) * spacing`, in model units."""

    first: tuple[float, float, float]
    spacing: float
    shape: tuple[int, int, int]

    @staticmethod
    def over(vertices: Floats, resolution: int) -> Lattice:
        """Centred on the box of the vertices, `resolution` samples from end to end of its longest side."""
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        spacing = float((high - low).max()) / (resolution - 1)
        shape = np.ceil((high - low) / spacing + 1 - 1e-9).astype(int)
        first = (low + high) / 2 - (shape - 1) * spacing / 2
        x, y, z = (float(value) for value in first)
        return Lattice((x, y, z), spacing, (int(shape[0]), int(shape[1]), int(shape[2])))

    def __len__(self) -> int:
        """Number of samples."""
        nx, ny, nz = self.shape
        return nx * ny * nz

    def points(self, rows: NDArray[np.int64]) -> Floats:
        """Positions of samples named by their index in C order, (n, 3)."""
        index = np.stack(np.unravel_index(rows, self.shape), axis=1)
        return np.asarray(np.asarray(self.first) + index * self.spacing)

    def slabs(self, count: int) -> Iterator[tuple[slice, Floats]]:
        """All samples in C order, some `count` points at a time, as the range of rows and the points."""
        _, ny, nz = self.shape
        layers = max(1, count // (ny * nz))
        y = self.first[1] + np.arange(ny) * self.spacing
        z = self.first[2] + np.arange(nz) * self.spacing
        for start in range(0, self.shape[0], layers):
            stop = min(start + layers, self.shape[0])
            x = self.first[0] + np.arange(start, stop) * self.spacing
            points = np.empty((stop - start, ny, nz, 3))
            points[..., 0] = x[:, None, None]
            points[..., 1] = y[:, None]
            points[..., 2] = z
            yield slice(start * ny * nz, stop * ny * nz), points.reshape(-1, 3)
