"""The script `truefield`: apart from the package, so that Ctrl-C while that is imported ends it as quietly as later."""

from __future__ import annotations

import sys


def main() -> int:
    """Runs the command line and returns its exit status; see `truefield.cli.door`."""
    try:
        from truefield.cli import main as run
    except KeyboardInterrupt:
        print("truefield: stopped", file=sys.stderr)
        return 130
    return run()
