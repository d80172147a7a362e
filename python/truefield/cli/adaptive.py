"""`truefield adaptive`: the adaptively sampled field of a part, in a file."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from truefield.cli.options import FIELD_SUFFIX, Part, Sign, SignRule, Threads, Weld, load, path
from truefield.cli.progress import progress


class Method(str, Enum):
    """How leaves answer."""

    LINEAR = "linear"
    CUBIC = "cubic"
    EXACT = "exact"
    MIXED = "mixed"


class Rule(str, Enum):
    """When a cell says enough."""

    VERIFIED = "verified"
    SAMPLES = "samples"


def adaptive(
    part: Part,
    *,
    tolerance: Annotated[
        float, typer.Option("--tolerance", show_default=False, help="The largest error at the surface, in model units.")
    ],
    output: Annotated[
        Path, typer.Option("--output", "-o", show_default=False, parser=path, help="What to write: .tfield.")
    ],
    growth: Annotated[
        float, typer.Option("--growth", help="How much the error may grow per unit of distance from the surface.")
    ] = 0.05,
    max_depth: Annotated[
        int | None, typer.Option("--max-depth", show_default="none", help="No cell is divided at this depth.")
    ] = None,
    method: Annotated[
        Method,
        typer.Option("--method", help="Leaves answer by 8 corners, 64 samples, triangles, or corners and triangles."),
    ] = Method.LINEAR,
    rule: Annotated[
        Rule,
        typer.Option("--rule", help="Divide cells until their error is proven, or until 19 samples agree: quicker."),
    ] = Rule.VERIFIED,
    margin: Annotated[
        float | None,
        typer.Option(
            "--margin",
            show_default="an eighth of the longest side",
            help="How far the field goes beyond the box of the part; its surfaces are grown no farther.",
        ),
    ] = None,
    sign: SignRule = Sign.AUTO,
    weld: Weld = None,
    threads: Threads = None,
) -> None:
    """The distances of a part on a tree of cells, fine where the part asks for it, each with a proven error."""
    import truefield as tf
    from truefield import arguments, files

    if output.suffix.lower() != FIELD_SUFFIX:
        raise tf.TruefieldError(f"cannot write '{output}': a field goes into a {FIELD_SUFFIX}; change the suffix")
    files.check_file(output)
    mesh = load(part, weld)
    low, high = mesh.extent
    room = None if margin is None else arguments.length("margin", margin, least=0.0)
    with progress() as report:
        surface = tf.Surface(mesh, sign=sign.value, threads=threads, progress=report)
        field = tf.adaptive_field(
            surface,
            tolerance,
            growth=growth,
            max_depth=max_depth,
            domain=None if room is None else (low - room, high + room),
            method=method.value,
            rule=rule.value,
            threads=threads,
            progress=report,
        )
        field.save(output, threads=threads, progress=report)
    counts = field.statistics()
    typer.echo(f"{output}: {counts['leaves']} leaves, {counts['depth']} levels deep, tolerance {tolerance:g}")
    typer.echo(f"sign rule: {surface.sign_rule.name}, {surface.sign_rule.reason}")
