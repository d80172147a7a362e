"""How a run is made."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Settings:
    """The same for every tool."""

    resolution: int = 256
    queries: int = 1_000_000
    repeats: int = 3
    threads: int = 2
    volume: int = 512
    timeout: float = 1800.0
    tools: list[str] = field(default_factory=list)
