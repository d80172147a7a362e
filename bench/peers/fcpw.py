"""FCPW through its Python wheel: float32, SIMD, sign from the normal of the nearest element.

Its answers are a list of Python objects; reading them is not counted.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.lattice import Floats
from bench.peers.base import Peer, Solver


class _Scene(Solver):
    def __init__(self, vertices: Floats, triangles: NDArray[np.int64]) -> None:
        import fcpw

        self.fcpw, self.scene = fcpw, fcpw.scene_3D()
        self.scene.set_object_count(1)
        self.scene.set_object_vertices(np.asfortranarray(vertices, dtype=np.float32), 0)
        self.scene.set_object_triangles(np.asfortranarray(triangles, dtype=np.int32), 0)
        self.scene.build(fcpw.aggregate_type.bvh_surface_area, True)

    def native(self, points: Floats) -> Any:
        far = np.full(len(points), np.finfo(np.float32).max, dtype=np.float32)
        return np.asfortranarray(points, dtype=np.float32), far

    def ask(self, native: Any) -> Any:
        answer = self.fcpw.interaction_3D_list()
        self.scene.find_closest_points(*native, answer, True)
        return answer

    def values(self, answer: Any, native: Any) -> NDArray[Any]:
        points = np.ascontiguousarray(native[0])
        found = zip(answer, points, strict=True)
        return np.fromiter((one.signed_distance(p) for one, p in found), dtype=np.float32, count=len(points))


class Fcpw(Peer):
    """Closest points, with normals for the sign."""

    name = "fcpw"
    package = "fcpw"
    module = "fcpw"

    def prepare(self, vertices: Floats, triangles: NDArray[np.int64], threads: int) -> Solver:
        del threads  # It takes all processors it may run on; the harness lends it as many as there are threads.
        return _Scene(vertices, triangles)


PEERS: list[Peer] = [Fcpw()]
