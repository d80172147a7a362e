"""What cannot change needs no copies."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

Unpack = Callable[[bytes], object]

_Self = TypeVar("_Self", bound="Immutable")


class Immutable:
    """Nothing of it can change: `copy.copy` and `copy.deepcopy` give the object itself, as of a tuple of numbers."""

    __slots__ = ()

    def __copy__(self: _Self) -> _Self:
        """The object itself."""
        return self

    def __deepcopy__(self: _Self, memo: dict[int, object]) -> _Self:
        """The object itself."""
        return self
