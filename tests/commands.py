"""Runs the command line in this process and keeps what it says."""

from __future__ import annotations

from typing import NamedTuple

import pytest
from truefield.cli import main


class Outcome(NamedTuple):
    status: int
    out: str
    err: str


class Command:
    """Calls the command `truefield` with arguments."""

    def __init__(self, capsys: pytest.CaptureFixture[str]) -> None:
        self._capsys = capsys

    def __call__(self, *arguments: object) -> Outcome:
        self._capsys.readouterr()
        status = main([str(argument) for argument in arguments])
        said = self._capsys.readouterr()
        return Outcome(status, said.out, said.err)

    def done(self, *arguments: object) -> str:
        """What a command prints that must succeed."""
        outcome = self(*arguments)
        assert outcome.status == 0, outcome.err
        assert outcome.err == ""
        return outcome.out

    def refused(self, *arguments: object) -> str:
        """The one sentence of a command that must refuse its input."""
        outcome = self(*arguments)
        assert outcome.status == 2, outcome
        assert outcome.out == ""
        assert outcome.err.startswith("truefield: ")
        assert outcome.err.count("\n") == 1
        assert outcome.err.endswith("\n")
        return outcome.err
