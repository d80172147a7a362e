"""The jobs every tool does: a dense grid, a narrow band, and queries at random points."""

from __future__ import annotations

import statistics
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench import peers, process
from bench.judge import Judge
from bench.lattice import Floats, Lattice
from bench.settings import Settings
from bench.verdict import verdicts

BAND_CELLS = 3


@dataclass
class Row:
    """One tool in one job on one model."""

    tool: str
    error: str | None = None
    release: str = ""
    build: float = 0.0
    seconds: float = 0.0
    busy: float = 0.0
    count: int = 0
    per_sample: float = 0.0
    ratio: float = 0.0
    largest_error: float = 0.0
    wrong_signs: float = 0.0
    estimated: bool = False
    memory: float = 0.0


@dataclass
class Result:
    """All tools in one job on one model."""

    job: str
    model: str
    triangles: int
    shape: tuple[int, int, int]
    spacing: float
    diagonal: float
    rows: list[Row]


def compare(job: str, name: str, vertices: Floats, triangles: NDArray[np.int64], settings: Settings) -> Result:
    """Runs every tool that does the job, then judges all their answers together."""
    lattice = Lattice.over(vertices[np.unique(triangles)], settings.resolution)
    judge = Judge(vertices, triangles)
    kind = "queries" if job in {"uniform", "near"} else job
    chosen = [p for p in peers.ALL.values() if kind in p.jobs and (not settings.tools or p.name in settings.tools)]
    with tempfile.TemporaryDirectory(prefix="truefield-bench-") as text:
        folder = Path(text)
        np.savez(folder / "mesh.npz", vertices=vertices, triangles=triangles)
        points = _queries(job, vertices, triangles, settings.queries)
        if points is not None:
            np.save(folder / "points.npy", points)
        rows: list[Row] = []
        for peer in chosen:
            task = {
                "job": job, "peer": peer.name, "mesh": str(folder / "mesh.npz"), "threads": settings.threads,
                "points": str(folder / "points.npy") if points is not None else None, "repeats": settings.repeats,
                "first": lattice.first, "spacing": lattice.spacing, "shape": lattice.shape, "cells": BAND_CELLS,
                "answers": str(folder / f"{peer.name}.npy"),
            }  # fmt: skip
            absent = peers.missing(peer)
            measured = {"error": "not installed"} if absent else process.run(task, folder, settings.timeout)
            row = _row(peer.name, measured)
            rows.append(row)
        answered = [row for row in rows if not row.error]
        answers = [np.load(folder / f"{row.tool}.npy", mmap_mode="r") for row in answered]
        where = lattice.points if points is None else points.__getitem__
        band = BAND_CELLS * lattice.spacing if job == "band" else None
        for row, verdict in zip(answered, verdicts(answers, judge, where, band) if answers else [], strict=True):
            row.largest_error, row.wrong_signs = verdict.largest_error, verdict.wrong_signs
            row.estimated = verdict.estimated
    ours = next((row.per_sample for row in rows if row.tool.startswith("truefield") and not row.error), 0.0)
    for row in rows:
        row.ratio = row.per_sample / ours if ours else 0.0
    return Result(job, name, len(triangles), lattice.shape, lattice.spacing, judge.diagonal, rows)


def _row(tool: str, measured: dict[str, Any]) -> Row:
    if "error" in measured:
        return Row(tool, error=measured["error"])
    build, ask = statistics.median(measured["build"]), statistics.median(measured["ask"])
    count, release = measured["count"], measured["release"]
    return Row(
        tool, release=release, build=build, seconds=build + ask, count=count, memory=measured["memory"],
        per_sample=(build + ask) / count * 1e9, busy=measured["busy"],
    )  # fmt: skip


def _queries(job: str, vertices: Floats, triangles: NDArray[np.int64], count: int) -> Floats | None:
    """Random points: all over the box and a tenth beyond, or within a hundredth of it from the surface."""
    if job not in {"uniform", "near"}:
        return None
    random = np.random.default_rng(20260)
    low, high = vertices[triangles].min(axis=(0, 1)), vertices[triangles].max(axis=(0, 1))
    if job == "uniform":
        margin = 0.1 * (high - low)
        return np.asarray(random.uniform(low - margin, high + margin, (count, 3)))
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    which = random.choice(len(area), count, p=area / area.sum())
    u, v = random.random((2, count, 1))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    offset = random.uniform(-0.01, 0.01, (count, 1)) * np.linalg.norm(high - low)
    flat = a[which] + u * (b - a)[which] + v * (c - a)[which]
    return np.asarray(flat + offset * normal[which] / area[which, None])
