"""trimesh's proximity queries (numpy and rtree): float64, slow, asked only a few points."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.lattice import Floats
from bench.peers.base import Peer, Solver


class _Proximity(Solver):
    def __init__(self, vertices: Floats, triangles: NDArray[np.int64]) -> None:
        import trimesh

        proximity: Any = trimesh.proximity
        self.query = proximity.ProximityQuery(trimesh.Trimesh(vertices, triangles, process=False))

    def ask(self, native: Any) -> Any:
        return -self.query.signed_distance(native)  # It counts inside as positive.


class Trimesh(Peer):
    """`ProximityQuery.signed_distance`."""

    name = "trimesh"
    package = "trimesh"
    module = "rtree"  # trimesh itself is always here, as our reader; the queries need rtree.
    precision = "float64"
    jobs = ("queries",)
    limit = 5_000

    def prepare(self, vertices: Floats, triangles: NDArray[np.int64], threads: int) -> Solver:
        del threads  # It has one.
        return _Proximity(vertices, triangles)


PEERS: list[Peer] = [Trimesh()]
