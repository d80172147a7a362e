"""The list of commands."""

from __future__ import annotations

from typing import Annotated

import typer

from truefield.cli.adaptive import adaptive
from truefield.cli.contour import contour
from truefield.cli.distance import distance
from truefield.cli.field import field
from truefield.cli.info import info
from truefield.cli.render import render
from truefield.cli.sample import sample
from truefield.cli.surface import surface
from truefield.cli.thickness import thickness
from truefield.cli.transform import transform

app = typer.Typer(
    name="truefield",
    help="Distance fields that people can trust: how far, how deep, how thick, each with a guarantee.",
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"]},
)
for command in (info, thickness, contour, distance, field, adaptive, sample, surface, render, transform):
    app.command()(command)


def _show_version(wanted: bool) -> None:
    if wanted:
        from truefield import __version__

        typer.echo(f"truefield {__version__}")
        raise typer.Exit


@app.callback(invoke_without_command=True)
def _start(
    context: typer.Context,
    version: Annotated[  # noqa: ARG001 - Typer acts on it
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Say the version and stop.")
    ] = False,
) -> None:
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())
