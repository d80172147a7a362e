"""`truefield thickness`: heavy sections and wall thickness of a part."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truefield.cli.options import Part, Resolution, Sign, SignRule, Threads


def thickness(
    part: Part,
    *,
    output: Annotated[
        Path, typer.Option("--output", "-o", show_default=False, help="The folder for the report; made if need be.")
    ],
    tolerance: Annotated[
        float, typer.Option("--tolerance", show_default=False, help="The largest error of depth and thickness.")
    ],
    above: Annotated[
        float | None, typer.Option("--above", show_default=False, help="Walls thicker than this are heavy sections.")
    ] = None,
    below: Annotated[
        float | None, typer.Option("--below", show_default=False, help="Walls thinner than this are too thin.")
    ] = None,
    resolution: Resolution = None,
    sign: SignRule = Sign.AUTO,
    threads: Threads = None,
) -> None:
    """Heavy sections and wall thickness, as numbers, files and pictures.

    Wall thickness is the diameter of the inscribed ball that touches the wall: a section is heavy where it is deeper
    than half of --above.
    """
