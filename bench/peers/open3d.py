"""Open3D's ray-casting scene (Embree): float32, sign by counting ray crossings."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.lattice import Floats
from bench.peers.base import Peer, Solver


class _Scene(Solver):
    def __init__(self, vertices: Floats, triangles: NDArray[np.int64], threads: int) -> None:
        import open3d

        self.tensor, self.threads = open3d.core.Tensor, threads
        self.scene = open3d.t.geometry.RaycastingScene(nthreads=threads)
        self.scene.add_triangles(self.tensor(vertices.astype(np.float32)), self.tensor(triangles.astype(np.uint32)))

    def native(self, points: Floats) -> Any:
        return self.tensor(points.astype(np.float32))

    def ask(self, native: Any) -> Any:
        return self.scene.compute_signed_distance(native, nthreads=self.threads)

    def values(self, answer: Any, native: Any) -> NDArray[Any]:  # noqa: ARG002
        return np.asarray(answer.numpy())


class Open3D(Peer):
    """Signed distances of a ray-casting scene."""

    name = "open3d"
    package = "open3d"
    module = "open3d"

    def prepare(self, vertices: Floats, triangles: NDArray[np.int64], threads: int) -> Solver:
        scene = _Scene(vertices, triangles, threads)
        scene.ask(scene.native(vertices[:1]))  # The tree is built by the first query.
        return scene


PEERS: list[Peer] = [Open3D()]
