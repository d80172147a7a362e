"""Runs a task in a process of its own, on as many processors as there are threads."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.settings import Settings

ROOT = Path(__file__).resolve().parent.parent
# Each library reads its own.
THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "TBB_NUM_THREADS", "IGL_NUM_THREADS")


def run(task: dict[str, Any], folder: Path, timeout: float) -> dict[str, Any]:
    """What the task measured, or `{"error": ...}` in one line."""
    threads = int(task["threads"])
    path = folder / "task.json"
    outcome = path.with_suffix(".result")
    outcome.unlink(missing_ok=True)
    path.write_text(json.dumps(task))
    environment = os.environ | dict.fromkeys(THREAD_VARIABLES, str(threads))
    try:
        done = subprocess.run(
            [sys.executable, "-c", _pinned(threads), str(path)],
            cwd=ROOT, env=environment, timeout=timeout, stdin=subprocess.DEVNULL,
            capture_output=True, text=True, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return {"error": f"stopped after {timeout:.0f} s"}
    if outcome.exists():
        result: dict[str, Any] = json.loads(outcome.read_text())
        return result
    lines = done.stderr.strip().splitlines() or [f"exit status {done.returncode}"]
    return {"error": lines[-1][:200]}


def table(job: str, settings: Settings, model: str = "", *mesh: NDArray[Any]) -> dict[str, Any]:
    """A job that makes its own table, on a mesh if it takes one."""
    with tempfile.TemporaryDirectory(prefix="truefield-bench-") as text:
        folder = Path(text)
        if mesh:
            np.savez(folder / "mesh.npz", vertices=mesh[0], triangles=mesh[1])
        task = {
            "job": job, "mesh": str(folder / "mesh.npz") if mesh else None,
            "threads": settings.threads, "repeats": settings.repeats, "volume": settings.volume,
        }  # fmt: skip
        made = run(task, folder, settings.timeout)
        return made | {"job": job, "model": f"{model}: " if model else ""}


def _pinned(threads: int) -> str:
    """A program that keeps to its processors before any library counts them."""
    return (
        "import os\n"
        "pin = getattr(os, 'sched_setaffinity', None)\n"
        f"pin and pin(0, sorted(os.sched_getaffinity(0))[:{threads}])\n"
        "from bench.worker import main; main()"
    )
