"""`truefield surface`: where a volume of distances has a value, as a mesh."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from truefield.cli.options import Threads
from truefield.cli.progress import progress


class Border(str, Enum):
    """What becomes of a surface that reaches the border of the volume."""

    CLOSED = "closed"
    OPEN = "open"


def surface(
    volume: Annotated[
        Path,
        typer.Argument(
            metavar="VOLUME", show_default=False, help="Distances: .nrrd, .nii, .nii.gz, .vti, .npz, .npy, .tif, .zarr."
        ),
    ],
    *,
    output: Annotated[
        Path, typer.Option("--output", "-o", show_default=False, help="What to write: .stl, .obj, .ply or .off.")
    ],
    distance: Annotated[
        float, typer.Option("--distance", help="The value at the surface; what is below it is inside.")
    ] = 0.0,
    border: Annotated[
        Border, typer.Option("--border", help="`closed` closes it where the volume ends; `open` leaves a rim.")
    ] = Border.CLOSED,
    threads: Threads = None,
) -> None:
    """The surface at a distance, as a closed mesh: marching cubes."""
    import truefield as tf
    from truefield import files, formats

    formats.check(output)
    files.check_file(output)
    field = tf.SampledField.from_volume(tf.read_volume(volume))
    with progress() as report:
        mesh = field.surface(distance, border=border.value, threads=threads, progress=report)
    mesh.write(output)
    typer.echo(f"{output}: {len(mesh.triangles)} triangles at distance {distance:g}, {len(mesh.vertices)} vertices")
