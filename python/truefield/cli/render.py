"""`truefield render`: a picture of an adaptive field, ray by ray."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truefield.cli.options import Threads, check_no_mesh, path
from truefield.cli.progress import progress

_SAMPLES = (1, 9, 25)


def render(
    field: Annotated[
        Path, typer.Argument(metavar="FIELD", show_default=False, parser=path, help="An adaptive field: .tfield.")
    ],
    *,
    output: Annotated[
        Path, typer.Option("--output", "-o", show_default=False, parser=path, help="The picture to write: .png.")
    ],
    view: Annotated[
        str,
        typer.Option(
            "--view",
            help="isometric, front, back, left, right, top, bottom, or a direction to look along as x,y,z.",
        ),
    ] = "isometric",
    size: Annotated[str, typer.Option("--size", help="Width and height in pixels.")] = "1600x1200",
    samples: Annotated[int, typer.Option("--samples", help="Rays a pixel: 1, 9 or 25.")] = 9,
    offset: Annotated[
        float, typer.Option("--offset", help="Draw the shape grown by this length; negative: shrunk.")
    ] = 0.0,
    threads: Threads = None,
) -> None:
    """A picture of an adaptive field, by casting rays at it."""
    import truefield as tf
    from truefield import files
    from truefield.pictures import field_picture

    check_no_mesh(field)
    if output.suffix.lower() != ".png":
        raise tf.TruefieldError(f"'{output}' is no .png; pictures are written as PNG")
    if samples not in _SAMPLES:
        raise tf.TruefieldError(f"--samples is {samples}; give 1, 9 or 25")
    files.check_file(output)
    shown, pixels = _view(view), _size(size)
    with progress() as report:
        loaded = tf.load(field, threads=threads, progress=report)
        if not isinstance(loaded, tf.AdaptiveField):
            raise tf.TruefieldError(f"'{field}' is no adaptive field; make one with `truefield adaptive`")
        field_picture(
            loaded, output, distance=offset, view=shown, size=pixels, samples=samples, threads=threads, progress=report
        )
    typer.echo(f"{output}: {pixels[0]} x {pixels[1]} pixels, {samples} rays each")


def _view(words: str) -> str | tuple[float, float, float]:
    parts = words.split(",")
    if len(parts) == 1:
        return words
    try:
        x, y, z = (float(part) for part in parts)
    except ValueError:
        import truefield as tf

        raise tf.TruefieldError(f"--view is '{words}'; give a name, or a direction as x,y,z") from None
    return x, y, z


def _size(words: str) -> tuple[int, int]:
    width, _, height = words.lower().partition("x")
    if not (width.isdecimal() and height.isdecimal()):
        import truefield as tf

        raise tf.TruefieldError(f"--size is '{words}'; give width and height in pixels, as 1600x1200")
    return int(width), int(height)
