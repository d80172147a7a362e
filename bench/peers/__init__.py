"""The tools, ours first; one file each."""

from __future__ import annotations

import importlib.util
from importlib.metadata import PackageNotFoundError, version

from bench.peers import fcpw, libigl, meshlib, open3d, openvdb, ours, trimesh
from bench.peers.base import Peer

ALL: dict[str, Peer] = {
    peer.name: peer for module in (ours, fcpw, libigl, meshlib, open3d, openvdb, trimesh) for peer in module.PEERS
}


def missing(peer: Peer) -> bool:
    """Whether the tool is not installed."""
    return importlib.util.find_spec(peer.module) is None


def release(peer: Peer) -> str:
    """The installed version, as its package states it."""
    try:
        return version(peer.package)
    except PackageNotFoundError:
        return "?"
