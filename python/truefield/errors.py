"""The errors of truefield: one sentence each, naming the input, what is wrong and what to do."""

from __future__ import annotations


class TruefieldError(ValueError):
    """An input cannot be used; the message is one sentence that says which, why and what to do."""


class FileError(TruefieldError, OSError):
    """A file cannot be read or written; also an `OSError`."""
