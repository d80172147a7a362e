from __future__ import annotations

import pytest
from commands import Command


@pytest.fixture
def truefield(capsys: pytest.CaptureFixture[str]) -> Command:
    return Command(capsys)
