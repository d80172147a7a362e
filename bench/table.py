"""Markdown tables for people."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from bench.compare import BAND_CELLS, Result


def markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table whose columns line up; all but the first are aligned right."""
    widths = [max(len(cell) for cell in column) for column in zip(head, *rows, strict=True)]

    def line(cells: Sequence[str]) -> str:
        padded = [c.ljust(w) if i == 0 else c.rjust(w) for i, (c, w) in enumerate(zip(cells, widths, strict=True))]
        return "| " + " | ".join(padded) + " |"

    rule = "|" + "|".join(("-" * (w + 2)) if i == 0 else "-" * (w + 1) + ":" for i, w in enumerate(widths)) + "|"
    return "\n".join([line(head), rule, *(line(row) for row in rows)])


def seconds(value: float) -> str:
    """A time in the unit that fits."""
    return f"{value:.2f} s" if value >= 1 else f"{value * 1e3:.1f} ms"


def comparison(result: Result) -> str:
    """All tools in one job on one model."""
    titles = {
        "dense": f"dense signed grid {_times(result.shape)}",
        "winding": f"dense signed grid {_times(result.shape)}, sign by winding number",
        "band": f"band of {BAND_CELLS} cells in a grid {_times(result.shape)}",
        "uniform": "random queries in and around the box",
        "near": "random queries near the surface",
    }
    unit, name = (result.spacing, "error (cells)") if result.job == "band" else (result.diagonal, "error (of diagonal)")
    head = ["tool", "build + query", "of it build", "busy", "ns/sample", "ratio", name, "wrong signs", "peak MiB"]
    rows, notes = [], []
    for row in result.rows:
        if row.error:
            rows.append([row.tool, *(["-"] * 8)])
            notes.append(f"{row.tool}: {row.error}\n")
            continue
        wrong = f"{'~' if row.estimated else ''}{row.wrong_signs:.0f}"
        rows.append([
            row.tool, seconds(row.seconds), seconds(row.build), f"{row.busy:.1f}", f"{row.per_sample:.1f}",
            f"{row.ratio:.2f}", f"{row.largest_error / unit:.1e}", wrong, f"{row.memory:.0f}",
        ])  # fmt: skip
    title = f"### {result.model} ({result.triangles} triangles): {titles[result.job]}"
    return "\n".join([title, "", markdown(head, rows), "", *notes])


def plain(made: dict[str, Any]) -> str:
    """A table that only truefield fills."""
    if "error" in made:
        return f"### {made['job']}: {made['error']}\n"
    return f"### {made['model']}{made['title']}\n\n{markdown(made['head'], made['rows'])}\n"


def _times(shape: tuple[int, int, int]) -> str:
    return " x ".join(str(n) for n in shape)
