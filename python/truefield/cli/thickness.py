"""`truefield thickness`: heavy sections and wall thickness of a part."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from truefield.cli.options import Part, Sign, SignRule, Threads, Weld, load, path
from truefield.cli.progress import progress

if TYPE_CHECKING:
    from truefield.mesh import TriangleMesh
    from truefield.thickness import HeavySection

_MOST_LISTED: Final = 10


def thickness(
    part: Part,
    *,
    output: Annotated[
        Path,
        typer.Option(
            "--output", "-o", show_default=False, parser=path, help="The folder for the report; made if need be."
        ),
    ],
    tolerance: Annotated[
        float | None,
        typer.Option(
            "--tolerance",
            show_default="a thousandth of the diagonal",
            help="Width of the depth intervals, model units.",
        ),
    ] = None,
    above: Annotated[
        float | None, typer.Option("--above", show_default="none", help="Walls thicker than this are heavy sections.")
    ] = None,
    below: Annotated[
        float | None, typer.Option("--below", show_default="none", help="Walls thinner than this are counted.")
    ] = None,
    spacing: Annotated[
        float | None,
        typer.Option("--spacing", show_default="about 20,000 samples", help="Mean distance of samples on the surface."),
    ] = None,
    sign: SignRule = Sign.AUTO,
    weld: Weld = None,
    threads: Threads = None,
) -> None:
    """Heavy sections and wall thickness, as numbers, files and pictures.

    Wall thickness is the diameter of the inscribed ball that touches the wall: a section is heavy where it is deeper
    than half of `--above`. Both limits are strict.
    """
    import truefield as tf
    from truefield import files

    files.check_folder(output)
    mesh = load(part, weld)
    _check_limit(above, mesh)
    with progress() as report:
        surface = tf.Surface(mesh, sign=sign.value, threads=threads, progress=report)
        found = tf.thickness(surface, tolerance, above, below, spacing=spacing, threads=threads, progress=report)
        if report:
            report("drawing and writing", 0.0)
        written = found.write(output, threads=threads)
    for sentence in found.sentences():
        typer.echo(sentence)
    sections = found.heavy_sections
    for number, section in enumerate(sections[:_MOST_LISTED], start=1):
        typer.echo(f"  {number:>2}. {_told(section)}")
    if len(sections) > _MOST_LISTED:
        typer.echo(f"  and {len(sections) - _MOST_LISTED} more, see heavy-sections.csv")
    typer.echo(f"{output}: {', '.join(path.name for path in written)}")


def _check_limit(above: float | None, mesh: TriangleMesh) -> None:
    """Refuses a limit that no part of this size can reach: most likely it is in another unit."""
    from truefield.errors import TruefieldError

    lower, upper = mesh.extent
    size = (upper - lower).tolist()
    if above is not None and above > min(size):
        told = " x ".join(f"{side:.6g}" for side in size)
        raise TruefieldError(
            f"--above is {above:g}, but no ball thicker than {min(size):.6g} fits into a part of {told}; "
            "give a smaller limit, in the unit of the part"
        )


def _told(section: HeavySection) -> str:
    depth, volume = section.depth, section.volume
    place = ", ".join(f"{x:.6g}" for x in section.point)
    return (
        f"{2.0 * depth.lower:.6g} to {2.0 * depth.upper:.6g} thick at ({place}), "
        f"volume {volume.lower:.4g} to {volume.upper:.4g}{'' if section.certain else ', may not exist'}"
    )
