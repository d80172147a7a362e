"""truefield itself: the surface with each sign rule, and the complete field."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bench.clock import Clock
from bench.lattice import Floats, Lattice
from bench.peers.base import Peer, Solver

if TYPE_CHECKING:
    import truefield as tf
    from truefield.fields import Sign


class _Surface(Solver):
    def __init__(self, surface: tf.Surface, threads: int) -> None:
        self.surface, self.threads = surface, threads

    def ask(self, native: Any) -> Any:
        return self.surface.distance(native, threads=self.threads)

    def grid(self, lattice: Lattice, clock: Clock, values: NDArray[Any] | None) -> None:
        self._sample(lattice, None, clock, values)

    def band(self, lattice: Lattice, cells: int, clock: Clock, values: NDArray[Any] | None) -> None:
        self._sample(lattice, cells * lattice.spacing, clock, values)

    def _sample(self, lattice: Lattice, band: float | None, clock: Clock, values: NDArray[Any] | None) -> None:
        with clock:
            sampled = self.surface.sample(resolution=max(lattice.shape), band=band, threads=self.threads)
        here, there = [*sampled.origin, *sampled.spacing], [*lattice.first, *[lattice.spacing] * 3]
        if tuple(sampled.shape) != lattice.shape or not np.allclose(
            here, there, rtol=1e-12, atol=1e-12 * lattice.spacing
        ):
            raise ValueError(f"samples {sampled.shape} from {sampled.origin}, expected {lattice}")
        if values is not None:
            values[:] = np.where(np.isfinite(sampled.values), sampled.values, np.nan).reshape(-1)
            if band is not None:
                values[np.abs(values) > band] = np.nan


class OnSurface(Peer):
    """`Surface` with one sign rule."""

    package = "truefield"
    module = "truefield"
    precision = "float64"

    def __init__(self, name: str, sign: Sign, jobs: tuple[str, ...]) -> None:
        self.name, self.sign, self.jobs = name, sign, jobs

    def prepare(self, vertices: Floats, triangles: NDArray[np.int64], threads: int) -> Solver:
        import truefield as tf

        return _Surface(tf.Surface(tf.TriangleMesh(vertices, triangles), sign=self.sign, threads=threads), threads)


class _Field(Solver):
    def __init__(self, field: tf.CompleteField, threads: int) -> None:
        self.field, self.threads = field, threads

    def ask(self, native: Any) -> Any:
        return self.field.distance(native, threads=self.threads)


class OnField(Peer):
    """`CompleteField`; its build is the field's, which queries repay."""

    name = "truefield-field"
    package = "truefield"
    module = "truefield"
    precision = "float64"
    jobs = ("queries",)

    def prepare(self, vertices: Floats, triangles: NDArray[np.int64], threads: int) -> Solver:
        import truefield as tf

        part = tf.TriangleMesh(vertices, triangles)
        return _Field(tf.complete_field(part, resolution=128, threads=threads), threads)


PEERS: list[Peer] = [
    OnSurface("truefield", "auto", ("dense", "band", "queries")),
    OnSurface("truefield-winding", "winding", ("winding",)),
    OnField(),
]
