"""MeshLib: float32, distance volumes and batches of points, sign by pseudonormals or by the winding number."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.clock import Clock
from bench.lattice import Floats, Lattice
from bench.peers.base import Peer, Solver


def floats(vector: Any) -> NDArray[np.float32]:
    """A copy of a vector of floats; element by element would take minutes."""
    size = vector.size()
    return np.array(np.ctypeslib.as_array((ctypes.c_float * size).from_address(vector.data_pointer())))


def volume(simple: Any) -> NDArray[np.float32]:
    """The values of a volume, flat, in C order of [x, y, z]; it stores x fastest."""
    dims = simple.dims
    return np.ravel(floats(simple.data.vec_).reshape(dims.z, dims.y, dims.x).transpose(2, 1, 0))


class _Mesh(Solver):
    def __init__(self, vertices: Floats, triangles: NDArray[np.int64], sign: str) -> None:
        from meshlib import mrmeshnumpy, mrmeshpy

        self.lib, self.convert = mrmeshpy, mrmeshnumpy
        self.sign = getattr(mrmeshpy.SignDetectionMode, sign)
        self.mesh = mrmeshnumpy.meshFromFacesVerts(triangles.astype(np.int32), vertices.astype(np.float32))
        self.mesh.getAABBTree()

    def native(self, points: Floats) -> Any:
        coordinates = self.lib.VertCoords()
        coordinates.vec_ = self.convert.fromNumpyArray(points.astype(np.float32))
        return coordinates

    def ask(self, native: Any) -> Any:
        return self.lib.findSignedDistances(self.mesh, native)

    def values(self, answer: Any, native: Any) -> NDArray[Any]:  # noqa: ARG002
        return floats(answer.vec_)

    def grid(self, lattice: Lattice, clock: Clock, values: NDArray[Any] | None) -> None:
        params = self.lib.MeshToDistanceVolumeParams()
        # Its samples lie at the centres of voxels, half a voxel from its origin.
        params.vol.origin = self.lib.Vector3f(*(c - lattice.spacing / 2 for c in lattice.first))
        params.vol.voxelSize = self.lib.Vector3f(*(3 * [lattice.spacing]))
        params.vol.dimensions = self.lib.Vector3i(*lattice.shape)
        params.dist.signMode = self.sign
        with clock:
            answer = self.lib.meshToDistanceVolume(self.lib.MeshPart(self.mesh), params)
        if values is not None:
            values[:] = volume(answer)


class MeshLib(Peer):
    """Distance volumes and signed distances of points with one sign rule."""

    package = "meshlib"
    module = "meshlib"

    def __init__(self, name: str, sign: str, jobs: tuple[str, ...]) -> None:
        self.name, self.sign, self.jobs = name, sign, jobs

    def prepare(self, vertices: Floats, triangles: NDArray[np.int64], threads: int) -> Solver:
        del threads  # As many as the processors it may run on.
        return _Mesh(vertices, triangles, self.sign)


PEERS: list[Peer] = [
    MeshLib("meshlib", "ProjectionNormal", ("dense", "queries")),
    MeshLib("meshlib-winding", "HoleWindingRule", ("winding",)),
]
