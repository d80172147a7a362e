"""`truefield field`: a complete field in a file, for asking again and again."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from truefield.cli.options import FIELD_SUFFIX, Part, Sign, SignRule, Threads, Weld, load, path
from truefield.cli.progress import progress


class Region(str, Enum):
    """Which cells hold lists."""

    EVERYWHERE = "everywhere"
    INSIDE = "inside"


def field(
    part: Part,
    *,
    output: Annotated[
        Path, typer.Option("--output", "-o", show_default=False, parser=path, help="What to write: a .tfield.")
    ],
    resolution: Annotated[
        int | None, typer.Option("--resolution", show_default="128", help="Cells along the longest side.")
    ] = None,
    cell_size: Annotated[
        float | None, typer.Option("--cell-size", show_default=False, help="Or the edge of a cell, in model units.")
    ] = None,
    region: Annotated[
        Region, typer.Option("--region", help="`inside`: cells outside the part hold no lists; smaller, as exact.")
    ] = Region.EVERYWHERE,
    sign: SignRule = Sign.AUTO,
    weld: Weld = None,
    threads: Threads = None,
) -> None:
    """The complete field: for every cell, each triangle that can be nearest inside it.

    The file holds the part too; `truefield distance` and `truefield contour` take it in place of a mesh.
    """
    import truefield as tf
    from truefield import files

    if output.suffix.lower() != FIELD_SUFFIX:
        raise tf.TruefieldError(f"cannot write '{output}': a field goes into a {FIELD_SUFFIX}; change the suffix")
    files.check_file(output)
    mesh = load(part, weld)
    with progress() as report:
        built = tf.complete_field(
            mesh, resolution, cell_size, region=region.value, sign=sign.value, threads=threads, progress=report
        )
        built.save(output, threads=threads, progress=report)
    x, y, z = built.shape
    size = output.stat().st_size / 2**20
    typer.echo(f"{output}: {x} x {y} x {z} cells of {built.cell_size:.6g}, {size:.1f} MiB with the part")
    typer.echo(f"sign rule: {built.sign_rule.name}, {built.sign_rule.reason}")
