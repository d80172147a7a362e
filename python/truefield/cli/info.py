"""`truefield info`: what a mesh is, and what is wrong with it."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Annotated, Any, Final

import typer

from truefield.cli.options import Part, Sign, SignRule, Threads
from truefield.cli.progress import progress

# From this longest side on, a part is more likely drawn in the next unit.
_UNITS: Final = ((0.005, "no unit at all"), (0.5, "metres"), (5.0, "inches or metres"), (10_000.0, "millimetres"))
_BEYOND: Final = "micrometres"


def info(
    part: Part,
    *,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON with stable keys instead of text.")] = False,
    sign: SignRule = Sign.AUTO,
    threads: Threads = None,
) -> None:
    """Size, shells, sign rule, and what is wrong with the mesh. Nothing is repaired."""
    import truefield as tf

    mesh = tf.read(part)
    with progress() as report:
        check = mesh.check(threads=threads, progress=report)
        rule = tf.Surface(mesh, sign=sign.value, threads=threads, progress=report).sign_rule
    lower, upper = mesh.extent
    longest = float((upper - lower).max())
    facts: dict[str, Any] = {
        "file": str(part),
        "triangles": len(mesh.triangles),
        "vertices": len(mesh.vertices),
        "lower": lower.tolist(),
        "upper": upper.tolist(),
        "size": (upper - lower).tolist(),
        "units_guess": guess_units(longest),
        "sign_rule": {"name": rule.name, "reason": rule.reason},
        "check": asdict(check),
        "problems": check.problems(),
    }
    typer.echo(json.dumps(facts, indent=2) if as_json else _told(facts))


def guess_units(longest: float) -> str:
    """The unit that a part with this longest side was most likely drawn in; nothing but a guess from the size."""
    return next((unit for limit, unit in _UNITS if longest < limit), _BEYOND)


def _told(facts: dict[str, Any]) -> str:
    check, rule = facts["check"], facts["sign_rule"]
    size, lower, upper = (" x ".join(f"{x:.6g}" for x in facts[key]) for key in ("size", "lower", "upper"))
    spread = f"{size}, from ({lower.replace(' x', ',')}) to ({upper.replace(' x', ',')})"
    measures = f"area {check['area']:.6g}" + (f", volume {check['volume']:.6g}" if check["watertight"] else "")
    rows = [
        ("triangles", f"{facts['triangles']:,} on {facts['vertices']:,} vertices".replace(",", " ")),
        ("size", spread),
        ("units", f"{facts['units_guess']}? Guessed from the size alone; answers are in the model's own unit"),
        ("shells", f"{check['shells']}, {'watertight' if check['watertight'] else 'not watertight'}; {measures}"),
        ("sign rule", f"{rule['name']}: {rule['reason']}"),
    ]
    rows += [("problem", sentence) for sentence in facts["problems"]] or [("problems", "none found")]
    return "\n".join([facts["file"], *(f"  {name:<11}{text}" for name, text in rows)])
