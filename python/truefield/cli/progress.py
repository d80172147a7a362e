"""Progress on the terminal: phase, fraction and time left, on stderr, and only where somebody is looking."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

Report = Callable[[str, float], None]


@contextmanager
def progress() -> Iterator[Report | None]:
    """Gives the function to be told of phase and fraction (0 to 1), or None where stderr is no terminal."""
    from rich.console import Console

    console = Console(stderr=True)
    if not console.is_terminal:
        yield None
        return
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True) as bars:
        phase_shown = ""
        bar = bars.add_task("starting", total=None)

        def report(phase: str, fraction: float) -> None:
            nonlocal phase_shown
            if phase != phase_shown:
                phase_shown = phase
                bars.reset(bar, total=1.0, description=phase)
            bars.update(bar, completed=fraction)

        yield report
