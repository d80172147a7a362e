"""What the harness asks of a tool. Each tool has one file beside this one."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.clock import Clock
from bench.lattice import Floats, Lattice

# Points are handed over in slabs of this size, so that no tool's memory is that of its arguments.
SLAB = 1 << 20


class Solver(ABC):
    """A tool that has taken a mesh in. Arguments are converted before the clock starts, answers read after it stops."""

    def native(self, points: Floats) -> Any:
        """The points in the tool's own type."""
        return points

    @abstractmethod
    def ask(self, native: Any) -> Any:
        """The tool's work: signed distances of all points, in the tool's own type."""

    def values(self, answer: Any, native: Any) -> NDArray[Any]:  # noqa: ARG002
        """The answer as an array (n,), negative inside; `native` are the points it is about."""
        return np.asarray(answer)

    def grid(self, lattice: Lattice, clock: Clock, values: NDArray[Any] | None) -> None:
        """Fills the lattice; `values` (C order, flat) takes the answers if given."""
        for rows, points in lattice.slabs(SLAB):
            native = self.native(points)
            with clock:
                answer = self.ask(native)
            if values is not None:
                values[rows] = self.values(answer, native)

    def band(self, lattice: Lattice, cells: int, clock: Clock, values: NDArray[Any] | None) -> None:  # noqa: ARG002
        """Fills the lattice within `cells` cells of the surface; the rest of `values` stays NaN."""
        raise ValueError(f"asked for a band of {cells} cells by a tool that makes none; see `Peer.jobs`")


class Peer(ABC):
    """A tool. Its file imports it only inside methods, so that a missing one costs nothing."""

    name: str
    package: str
    module: str
    precision: str = "float32"
    jobs: tuple[str, ...] = ("dense", "queries")
    # Most points it is asked in one job; slow tools get fewer.
    limit: int | None = None

    @abstractmethod
    def prepare(self, vertices: Floats, triangles: NDArray[np.int64], threads: int) -> Solver:
        """Takes a mesh in and builds what queries need; this is timed as the build."""
