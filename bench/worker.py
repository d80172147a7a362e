"""One tool, one job, one mesh, in a process of its own: `python -m bench.worker TASK.json`.

Writes what it measured beside the task, so that a tool that prints, or dies, harms nobody else.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from bench import alone, isosurfaces, peers, rays, transforms
from bench.clock import Clock, Peak
from bench.lattice import Lattice


def compare(task: dict[str, Any]) -> dict[str, Any]:
    """Builds and asks `repeats` times; the first round also keeps the answers."""
    peer = peers.ALL[task["peer"]]
    mesh = np.load(task["mesh"])
    vertices, triangles = mesh["vertices"], mesh["triangles"]
    lattice = Lattice(tuple(task["first"]), task["spacing"], tuple(task["shape"]))
    points = np.load(task["points"])[: peer.limit] if task["points"] else np.empty((0, 3))
    count = len(points) or len(lattice)
    values = np.full(count, np.nan, dtype=peer.precision)
    peer.prepare(vertices[triangles[0]], np.array([[0, 1, 2]]), task["threads"])  # Imports, before memory is watched.
    values[:] = np.nan  # Its pages are there before memory is watched, too.
    peak, builds, asks, memory, processor = Peak(), [], [], 0.0, 0.0
    for round_ in range(task["repeats"]):
        build, clock, keep = Clock(), Clock(), values if round_ == 0 else None
        with build:
            solver = peer.prepare(vertices, triangles, task["threads"])
        if task["job"] == "band":
            solver.band(lattice, task["cells"], clock, keep)
        elif len(points):
            native = solver.native(points)
            with clock:
                answer = solver.ask(native)
            if keep is not None:
                keep[:] = solver.values(answer, native)
            del answer, native
        else:
            solver.grid(lattice, clock, keep)
        builds.append(build.seconds)
        asks.append(clock.seconds)
        processor += build.processor + clock.processor
        if round_ == 0:
            memory = peak.mebibytes()
        del solver
    np.save(task["answers"], values)
    busy = processor / (sum(builds) + sum(asks))
    return {
        "build": builds, "ask": asks, "busy": busy, "count": count, "memory": memory, "release": peers.release(peer),
    }  # fmt: skip


def make_table(task: dict[str, Any]) -> dict[str, Any]:
    """A job that makes its own table."""
    of_volumes = {**transforms.JOBS, **isosurfaces.JOBS, **rays.JOBS}
    if task["job"] in of_volumes:
        return of_volumes[task["job"]](task["threads"], task["repeats"], task["volume"])
    mesh = np.load(task["mesh"]) if task["mesh"] else None
    model = () if mesh is None else (mesh["vertices"], mesh["triangles"])
    return alone.JOBS[task["job"]](task["threads"], task["repeats"], *model)


def main() -> None:
    path = Path(sys.argv[1])
    task = json.loads(path.read_text())
    alone_jobs = {*alone.JOBS, *transforms.JOBS, *isosurfaces.JOBS, *rays.JOBS}
    result = make_table(task) if task["job"] in alone_jobs else compare(task)
    path.with_suffix(".result").write_text(json.dumps(result))


if __name__ == "__main__":
    main()
