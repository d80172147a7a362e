"""The command `truefield`."""

from truefield.cli.door import main

__all__ = ["main"]
