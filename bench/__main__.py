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

from bench import models, peers, table
from bench.compare import Settings, compare

COMPARED = ("dense", "winding", "band", "uniform", "near")


def main() -> None:
    arguments = _arguments()
    jobs = arguments.jobs.split(",") if arguments.jobs else list(COMPARED)
    unknown = sorted(set(jobs) - set(COMPARED))
    if unknown:
        sys.exit(f"error: no job is called {unknown[0]!r}; choose from {', '.join(COMPARED)}")
    tools = arguments.tools.split(",") if arguments.tools else []
    strange = sorted(set(tools) - set(peers.ALL))
    if strange:
        sys.exit(f"error: no tool is called {strange[0]!r}; choose from {', '.join(peers.ALL)}")
    settings = Settings(
        resolution=arguments.resolution, queries=arguments.queries, repeats=arguments.repeats,
        threads=arguments.threads, timeout=arguments.timeout, tools=tools,
    )  # fmt: skip
    folder = Path(arguments.output)
    folder.mkdir(parents=True, exist_ok=True)
    stem = folder / time.strftime("%Y%m%d-%H%M%S")
    machine = _machine(settings)
    report: list[str] = []
    results: list[Any] = []
    numbers = {"machine": machine, "settings": asdict(settings), "results": results}
    _say(report, "\n".join(f"- {key}: {value}" for key, value in machine.items()) + "\n")
    for mesh in models.models(arguments.models, arguments.only.split(",") if arguments.only else []):
        for job in jobs:
            vertices, triangles = np.asarray(mesh.vertices), np.asarray(mesh.triangles, dtype=np.int64)
            result = compare(job, mesh.name, vertices, triangles, settings)
            results.append(asdict(result))
            _say(report, table.comparison(result))
            # After every job, so that an interrupted run keeps what it measured.
            stem.with_suffix(".json").write_text(json.dumps(numbers, indent=1))
            stem.with_suffix(".md").write_text("\n".join(report))
    print(f"Kept in {stem}.md and {stem}.json")


def _say(report: list[str], text: str) -> None:
    report.append(text)
    print(text, flush=True)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m bench", description="Compares truefield with its peers.")
    parser.add_argument("--models", type=Path, help="a folder of meshes; without it, shapes that truefield makes")
    parser.add_argument("--only", help="words, comma separated: only models whose name holds one")
    parser.add_argument("--jobs", help=f"comma separated, of {', '.join(COMPARED)} (default: all)")
    parser.add_argument("--tools", help=f"comma separated, of {', '.join(peers.ALL)} (default: all)")
    parser.add_argument("--resolution", type=int, default=256, help="samples along the longest side (default: 256)")
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
