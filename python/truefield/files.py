"""Writing files so that a reader never sees half of one: written aside, then renamed."""

from __future__ import annotations

import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

from truefield.errors import FileError

PathLike = str | os.PathLike[str]


@contextmanager
def replacing(path: PathLike) -> Iterator[IO[bytes]]:
    """A binary stream whose content appears at `path` when the block ends well, and nowhere otherwise.

    The bytes go to a hidden file in the same folder, which replaces `path` in one step. Devices and pipes
    (`/dev/stdout`) are written directly.

    Raises:
        FileError: the folder does not exist, cannot be written or is full, or `path` is a folder.
    """
    target = Path(path)
    check_file(target)
    if target.exists() and not target.is_file():
        with _explained(target), target.open("wb") as stream:
            yield stream
        return
    target = target.resolve()
    aside = target.with_name(f".{target.name}.{secrets.token_hex(4)}.part")
    try:
        with _explained(Path(path)):
            with aside.open("xb") as stream:
                yield stream
            aside.replace(target)
    except BaseException:
        with suppress(OSError):
            aside.unlink()
        raise


@contextmanager
def replacing_folder(path: PathLike) -> Iterator[Path]:
    """An empty folder to fill; its files appear in the folder `path` when the block ends well, and nowhere otherwise.

    `path` is made if need be. Files of the same names in it are replaced, others are left alone.

    Raises:
        FileError: the parent folder does not exist, cannot be written, or `path` is a file.
    """
    target = Path(path)
    check_folder(target)
    aside = target.resolve().with_name(f".{target.resolve().name}.{secrets.token_hex(4)}.part")
    try:
        with _explained(target):
            aside.mkdir()
        yield aside
        with _explained(target):
            if target.is_dir():
                for file in sorted(aside.iterdir()):
                    file.replace(target / file.name)
            else:
                aside.replace(target.resolve())
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def check_file(path: PathLike) -> None:
    """Raises `FileError` if a file at `path` could not be written; for asking before a long job."""
    target = _named(path)
    if target.is_dir():
        raise FileError(f"cannot write {_shown(path)}: it is a folder; give the name of a file")
    _check_parent(target)


def check_folder(path: PathLike) -> None:
    """Raises `FileError` if a folder at `path` could not be written; for asking before a long job."""
    target = _named(path)
    if target.exists() and not target.is_dir():
        raise FileError(f"cannot write into {_shown(path)}: it is a file; give the name of a folder")
    _check_parent(target.resolve())
    if target.is_dir() and not os.access(target, os.W_OK | os.X_OK):
        raise FileError(f"cannot write into {_shown(path)}: permission denied; choose another folder")


def size_of(stream: IO[bytes]) -> int:
    """The length of a file, which stays where it is."""
    at = stream.tell()
    end = stream.seek(0, 2)
    stream.seek(at)
    return end


def _named(path: PathLike) -> Path:
    # The empty name would be the current folder's.
    if not os.fspath(path):
        raise FileError("cannot write: the name is empty; give the path of a file or folder")
    return Path(path)


def _check_parent(target: Path) -> None:
    folder = target.parent
    if not folder.is_dir():
        raise FileError(f"cannot write {_shown(target)}: the folder {_shown(folder)} does not exist; make it first")
    special = target.exists() and not target.is_file() and not target.is_dir()
    if not special and not os.access(folder, os.W_OK | os.X_OK):
        raise FileError(f"cannot write {_shown(target)}: the folder {_shown(folder)} is not writable; choose another")


@contextmanager
def _explained(path: Path) -> Iterator[None]:
    try:
        yield
    except FileError:
        raise
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise FileError(f"cannot write {_shown(path)}: {reason}; choose another place") from error


def _shown(path: PathLike) -> str:
    return f"'{os.fspath(path)}'"
