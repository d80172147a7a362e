"""`python -m bench`: runs the jobs, prints tables, keeps the numbers as JSON."""

from __future__ import annotations

import argparse
import json
import os
import platform
import re
import sys
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from bench import alone, isosurfaces, models, peers, process, rays, table, transforms
from bench.compare import compare
from bench.settings import Settings

COMPARED = ("dense", "winding", "band", "uniform", "near")
ALL = (*COMPARED, *alone.JOBS, *transforms.JOBS, *isosurfaces.JOBS, *rays.JOBS)


def main() -> None:
    arguments = _arguments()
    jobs = _chosen("job", arguments.jobs, ALL) or list(ALL)
    tools = _chosen("tool", arguments.tools, tuple(peers.ALL))
    settings = Settings(
        resolution=arguments.resolution, queries=arguments.queries, repeats=arguments.repeats,
        threads=arguments.threads, volume=arguments.volume, timeout=arguments.timeout, tools=tools,
    )  # fmt: skip
    folder = Path(arguments.output)
    folder.mkdir(parents=True, exist_ok=True)
    stem = folder / time.strftime("%Y%m%d-%H%M%S")
    machine = _machine(settings)
    report: list[str] = []
    results: list[Any] = []
    numbers = {"machine": machine, "settings": asdict(settings), "results": results}
    _say(report, "\n".join(f"- {key}: {value}" for key, value in machine.items()) + "\n")

    def keep(text: str, result: dict[str, Any]) -> None:
        """After every job, so that an interrupted run keeps what it measured."""
        results.append(result)
        _say(report, text)
        stem.with_suffix(".json").write_text(json.dumps(numbers, indent=1))
        stem.with_suffix(".md").write_text("\n".join(report))

    meshes = models.models(arguments.models, arguments.only.split(",") if arguments.only else [])
    for mesh in meshes if set(jobs) & {*COMPARED, *alone.WITH_MODEL} else ():
        vertices, triangles = np.asarray(mesh.vertices), np.asarray(mesh.triangles, dtype=np.int64)
        for job in jobs:
            if job in COMPARED:
                compared = compare(job, mesh.name, vertices, triangles, settings)
                keep(table.comparison(compared), asdict(compared))
            elif job in alone.WITH_MODEL:
                made = process.table(job, settings, mesh.name, vertices, triangles)
                keep(table.plain(made), made)
    for job in jobs:
        if job not in (*COMPARED, *alone.WITH_MODEL):
            made = process.table(job, settings)
            keep(table.plain(made), made)
    print(f"Kept in {stem}.md and {stem}.json")


def _chosen(what: str, given: str | None, known: tuple[str, ...]) -> list[str]:
    """The words of an option, each a known one."""
    words = given.split(",") if given else []
    for word in words:
        if word not in known:
            sys.exit(f"error: no {what} is called {word!r}; choose from {', '.join(known)}")
    return words


def _say(report: list[str], text: str) -> None:
    report.append(text)
    print(text, flush=True)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m bench", description="Compares truefield with its peers.")
    parser.add_argument("--models", type=Path, help="a folder of meshes; without it, shapes that truefield makes")
    parser.add_argument("--only", help="words, comma separated: only models whose name holds one")
    parser.add_argument("--jobs", help=f"comma separated, of {', '.join(ALL)} (default: all)")
    parser.add_argument("--tools", help=f"comma separated, of {', '.join(peers.ALL)} (default: all)")
    parser.add_argument("--resolution", type=int, default=256, help="samples along the longest side (default: 256)")
    parser.add_argument("--volume", type=int, default=512, help="voxels a side of transformed volumes (default: 512)")
    parser.add_argument("--queries", type=int, default=1_000_000, help="random points (default: a million)")
    parser.add_argument("--repeats", type=int, default=3, help="rounds of which the median counts (default: 3)")
    parser.add_argument("--threads", type=int, default=min(2, os.cpu_count() or 1), help="for every tool (default: 2)")
    parser.add_argument(
        "--timeout", type=float, default=1800, help="seconds a tool may take for one job (default: 1800)"
    )
    parser.add_argument(
        "--output", default="bench/results", help="folder for the tables and JSON (default: bench/results)"
    )
    return parser.parse_args()


def _machine(settings: Settings) -> dict[str, str]:
    processor = platform.processor() or platform.machine()
    information = Path("/proc/cpuinfo")
    found = re.search(r"model name\s*:\s*(.+)", information.read_text()) if information.exists() else None
    tools = {p.package: "not installed" if peers.missing(p) else peers.release(p) for p in peers.ALL.values()}
    return {
        "processor": f"{found[1] if found else processor}, {os.cpu_count()} of them",
        "threads": f"{settings.threads} for every tool",
        "system": f"{platform.system()}, Python {platform.python_version()}, numpy {np.__version__}",
        "tools": ", ".join(f"{package} {version}" for package, version in tools.items()),
        "medians of": f"{settings.repeats} rounds",
    }


if __name__ == "__main__":
    main()
