"""Files that a command writes: a folder of its own, checked before the work, where nothing is replaced unasked."""

from __future__ import annotations

import errno
import tempfile
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import Final

from localization.errors import LocalizationError

_RUNS: Final = Path("runs")
"""Folder of the folders of runs."""
_DEVICE: Final = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EIO)
"""Errors of the device, which say nothing about the file that was being written."""


class OutputError(LocalizationError):
    """A folder or file that cannot be written, or would be replaced; the message names the option."""


def check_folder(out: Path | None, files: Iterable[str], *, overwrite: bool = False) -> None:
    """Check before any work that ``run_folder`` will succeed and replace nothing; leaves no trace.

    Args:
        out: Folder that the user named with ``--out``, if any.
        files: Names of the files that will be written into it.
        overwrite: Whether the user allows files of these names to be replaced.

    Raises:
        OutputError: If the folder cannot be written, or holds one of the files.
    """
    if out is None:
        _check_writable(
            _RUNS, f"no file can be written to {_RUNS}/", "give another folder with --out"
        )
        return
    if out.exists() and not out.is_dir():
        raise OutputError(f"--out {out} is a file: give a folder")
    present = [] if overwrite else [name for name in files if (out / name).exists()]
    if present:
        raise OutputError(
            f"--out {out} already holds {present[0]}: give another folder, or add --overwrite"
        )
    _check_writable(out, f"no file can be written to --out {out}", "give another folder")


def check_file(out: Path, *, overwrite: bool = False) -> None:
    """Check before any work that a file can be written and replaces nothing; leaves no trace.

    Raises:
        OutputError: If the file exists, or its folder cannot be written.
    """
    if out.is_dir():
        raise OutputError(f"--out {out} is a folder: give a file")
    if out.exists() and not overwrite:
        raise OutputError(f"--out {out} already exists: give another file, or add --overwrite")
    _check_writable(out.parent, f"--out {out} cannot be written", "give another file")


def run_folder(out: Path | None) -> Path:
    """Create and return the folder that the user named, or else a new one, ``runs/<local date and time>``.

    A new one is nobody else's, also if several commands begin within the same second.
    """
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        return out
    name = time.strftime("%Y-%m-%dT%H-%M-%S")
    for number in count(1):
        folder = _RUNS / (name if number == 1 else f"{name}-{number}")
        try:
            folder.mkdir(parents=True)
        except FileExistsError:
            continue
        return folder
    raise AssertionError


def remove_earlier(folder: Path, files: Iterable[str]) -> None:
    """Remove the files of an earlier run from a folder, so that none of them is taken for one of the next."""
    for name in files:
        (folder / name).unlink(missing_ok=True)


@contextmanager
def writing_to(folder: Path) -> Iterator[None]:
    """Report a full or failing disk by the folder that was being written, with what it holds by then.

    Raises:
        OutputError: In place of the system's error, which names neither.
    """
    try:
        yield
    except OSError as error:
        if error.errno not in _DEVICE:
            raise
        kept = ", ".join(sorted(p.name for p in folder.glob("*") if p.stat().st_size)) or "nothing"
        raise OutputError(f"{folder}: {error.strerror}; kept there: {kept}") from None


def _check_writable(folder: Path, failure: str, remedy: str) -> None:
    """Create a file in a folder, and the folders that are missing, and remove them again."""
    absent = [f for f in (folder, *folder.parents) if not f.exists()]
    made: list[Path] = []
    try:
        for parent in reversed(absent):
            parent.mkdir()
            made.append(parent)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        raise OutputError(f"{failure} ({error.strerror}): {remedy}") from None
    finally:
        for parent in reversed(made):
            parent.rmdir()
