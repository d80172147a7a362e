"""libigl's signed distance: float64, sign by pseudonormals or by the fast winding number."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.lattice import Floats
from bench.peers.base import Peer, Solver


class _Tree(Solver):
    """The call builds its tree each time; a slab is large enough for that not to matter."""

    def __init__(self, vertices: Floats, triangles: NDArray[np.int64], sign: str) -> None:
        import igl

        self.igl, self.vertices, self.triangles = igl, vertices, triangles
        self.sign = getattr(igl, f"SIGNED_DISTANCE_TYPE_{sign}")

    def ask(self, native: Any) -> Any:
        return self.igl.signed_distance(native, self.vertices, self.triangles, sign_type=self.sign)[0]


class LibIgl(Peer):
    """`igl.signed_distance` with one sign rule; IGL_NUM_THREADS is set by the harness."""

    package = "libigl"
    module = "igl"
    precision = "float64"

    def __init__(self, name: str, sign: str, jobs: tuple[str, ...]) -> None:
        self.name, self.sign, self.jobs = name, sign, jobs

    def prepare(self, vertices: Floats, triangles: NDArray[np.int64], threads: int) -> Solver:
        del threads
        return _Tree(vertices, triangles, self.sign)


PEERS: list[Peer] = [
    LibIgl("libigl", "PSEUDONORMAL", ("dense", "queries")),
    LibIgl("libigl-winding", "FAST_WINDING_NUMBER", ("winding",)),
]
