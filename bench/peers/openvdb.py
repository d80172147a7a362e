"""OpenVDB's narrow band, as MeshLib's wheel ships it: float32, sign by flooding the grid."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.clock import Clock
from bench.lattice import Floats, Lattice
from bench.peers.base import Peer, Solver
from bench.peers.meshlib import volume


class _Mesh(Solver):
    def __init__(self, vertices: Floats, triangles: NDArray[np.int64]) -> None:
        from meshlib import mrmeshnumpy, mrmeshpy

        self.lib = mrmeshpy
        self.mesh = mrmeshnumpy.meshFromFacesVerts(triangles.astype(np.int32), vertices.astype(np.float32))

    def ask(self, native: Any) -> Any:
        raise ValueError(f"asked for {len(native)} points, and makes narrow bands only; see `Peer.jobs`")

    def band(self, lattice: Lattice, cells: int, clock: Clock, values: NDArray[Any] | None) -> None:
        lib, box = self.lib, self.lib.Box3i()
        params = lib.MeshToVolumeParams()
        params.type = lib.MeshToVolumeParams.Type.Signed
        params.surfaceOffset = float(cells)
        params.voxelSize = lib.Vector3f(*(3 * [lattice.spacing]))
        # Its samples lie at whole multiples of the voxel size: move the mesh so that ours do too.
        params.worldXf = lib.AffineXf3f.translation(lib.Vector3f(*(-c for c in lattice.first)))
        with clock:
            answer = lib.meshToDistanceVdbVolume(lib.MeshPart(self.mesh), params)
        if values is not None:
            box.min, box.max = lib.Vector3i(0, 0, 0), lib.Vector3i(*lattice.shape)
            read = volume(lib.vdbVolumeToSimpleVolume(answer, box))  # In voxels; +-cells marks the rest.
            values[:] = np.where(np.abs(read) < cells * (1 - 1e-6), read * lattice.spacing, np.nan)


class OpenVdb(Peer):
    """`meshToLevelSet` by way of MeshLib."""

    name = "openvdb"
    package = "meshlib"
    module = "meshlib"
    jobs = ("band",)

    def prepare(self, vertices: Floats, triangles: NDArray[np.int64], threads: int) -> Solver:
        del threads  # As many as the processors it may run on.
        return _Mesh(vertices, triangles)


PEERS: list[Peer] = [OpenVdb()]
