"""A stopwatch that stops around what is not the tool's work, and the peak memory of a process."""

from __future__ import annotations

import contextlib
import re
import resource
import sys
import time
from pathlib import Path
from types import TracebackType


class Clock:
    """Adds up the wall time and the processors' time of its `with` blocks."""

    def __init__(self) -> None:
        self.seconds = 0.0
        self.processor = 0.0
        self._start = (0.0, 0.0)

    def __enter__(self) -> Clock:
        self._start = time.perf_counter(), time.process_time()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.seconds += time.perf_counter() - self._start[0]
        self.processor += time.process_time() - self._start[1]


class Peak:
    """How far the memory of this process rises above what it was when the object was made."""

    def __init__(self) -> None:
        # Linux can forget the highest level so far, so that imports do not hide the work.
        with contextlib.suppress(OSError):
            Path("/proc/self/clear_refs").write_text("5")
        self._before = _highest()

    def mebibytes(self) -> float:
        """The rise so far, in MiB."""
        return max(0.0, _highest() - self._before)


def _highest() -> float:
    try:
        found = re.search(r"VmHWM:\s+(\d+) kB", Path("/proc/self/status").read_text())
    except OSError:
        found = None
    if found:
        return int(found[1]) / 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1024 * 1024 if sys.platform == "darwin" else 1024)
