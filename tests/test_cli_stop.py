"""Ctrl-C in the middle of a long job: it stops, says so and leaves nothing behind."""

from __future__ import annotations

import os
import re
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
import truefield as tf

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals and terminals are of another kind there")

# Jobs of many minutes: only Ctrl-C ends them while the test waits.
LONG = {
    "contour": ["--depth", "4", "--tolerance", "0.002", "-o", "{out}/shell.ply"],
    "sample": ["--resolution", "700", "-o", "{out}/samples.nrrd"],
    "thickness": ["--above", "10", "--tolerance", "1e-7", "--output", "{out}/report"],
}


@pytest.fixture(autouse=True)
def heard() -> Iterator[None]:
    """Children inherit whether Ctrl-C is ignored, as it is where tests run in the background; a user's is not."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize("command", LONG)
def test_ctrl_c_stops_a_long_job_and_leaves_nothing(tmp_path: Path, command: str) -> None:
    import pty

    tf.shapes.housing().write(tmp_path / "housing.ply")
    out = tmp_path / "out"
    out.mkdir()
    words = [sys.executable, "-m", "truefield", command, str(tmp_path / "housing.ply")]
    terminal, end = pty.openpty()
    process = subprocess.Popen([*words, *(word.format(out=out) for word in LONG[command])], stdout=end, stderr=end)
    os.close(end)
    try:
        shown = read_until(terminal, rb"\d+%", process)
        process.send_signal(signal.SIGINT)
        shown += read_until(terminal, rb"truefield: stopped", process)
        assert process.wait(timeout=30) == 130
    finally:
        process.kill()
        process.wait()
        os.close(terminal)
    assert b"Traceback" not in shown
    assert not list(out.iterdir())


def read_until(terminal: int, pattern: bytes, process: subprocess.Popen[bytes]) -> bytes:
    """What the terminal shows up to the pattern; fails if it never comes."""
    shown = b""
    end = time.monotonic() + 60.0
    while not re.search(pattern, shown):
        assert time.monotonic() < end, f"{pattern!r} never came: {shown!r}"
        if select.select([terminal], [], [], 0.1)[0]:
            try:
                shown += os.read(terminal, 65536)
            except OSError:
                pytest.fail(f"ended with {process.wait()} before {pattern!r}: {shown!r}")
    return shown


def test_ctrl_c_while_starting_is_no_traceback() -> None:
    code = "import signal, os; from truefield.cli import main; import typer; "
    code += "typer.echo = lambda *_: os.kill(os.getpid(), signal.SIGINT); raise SystemExit(main(['--version']))"
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stdout, ended.stderr.strip()) == (130, "", "truefield: stopped")


def test_ctrl_c_while_importing_is_no_traceback(tmp_path: Path) -> None:
    # The first import of the package is where Python spends its start.
    (tmp_path / "numpy.py").write_text("import os, signal, time; os.kill(os.getpid(), signal.SIGINT); time.sleep(9)")
    code = "from truefield_command import main; raise SystemExit(main())"
    environment = os.environ | {"PYTHONPATH": str(tmp_path)}
    ended = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stdout, ended.stderr.strip()) == (130, "", "truefield: stopped")
