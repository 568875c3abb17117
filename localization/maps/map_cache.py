"""Cache of files derived from maps: written atomically, checked when read, bounded in size.

A cache that cannot be read or written is ignored. Once a folder holds more than ``LARGEST`` bytes, the least
recently used files are deleted.
"""

from __future__ import annotations

import contextlib
import os
import tempfile
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import IO, Any, Final

import numpy as np
import numpy.typing as npt

Arrays = Mapping[str, npt.NDArray[Any]]

LARGEST = 2**30
"""Greatest size of a folder of derived files [bytes]: nine maps of two million points."""


_KINDS: Final = (".npz", ".glb")
"""Kinds of derived files."""


def default_cache() -> Path:
    """Return the folder for derived files: ``$XDG_CACHE_HOME/farsteer`` or ``~/.cache/farsteer``."""
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "farsteer"


def load(file: Path) -> Arrays | None:
    """Return the arrays that ``store`` wrote, read-only; None if the file is missing or damaged.

    The file is read into memory, not mapped: a mapped file on a disk that fails, or on a server that
    vanishes, would end the process in the middle of a drive.
    """
    try:
        with zipfile.ZipFile(file) as archive:
            arrays = {
                info.filename.removesuffix(".npy"): _member(archive, info)
                for info in archive.infolist()
            }
        # The time of the last use decides which file is deleted first.
        os.utime(file)
    except (OSError, ValueError, KeyError, EOFError, NotImplementedError, zipfile.BadZipFile):
        return None
    return arrays


def store(file: Path, arrays: Arrays, *, largest: int = LARGEST) -> None:
    """Write arrays to a file atomically, and keep the folder's derived files within a bound.

    Args:
        file: File to write, an ``.npz``; others in its folder may be deleted.
        arrays: Arrays by name.
        largest: Greatest size of all such files in the folder [bytes].
    """
    contents: dict[str, Any] = dict(arrays)
    _write(file, lambda out: np.savez(out, **contents), largest)


def load_bytes(file: Path) -> bytes | None:
    """Return what ``store_bytes`` wrote; None if the file is missing."""
    try:
        content = file.read_bytes()
        os.utime(file)
    except OSError:
        return None
    return content


def store_bytes(file: Path, content: bytes, *, largest: int = LARGEST) -> None:
    """Write a file of another kind in the same way.

    Args:
        file: File to write, a ``.glb``; others in its folder may be deleted.
        content: Its content.
        largest: Greatest size of all derived files in the folder [bytes].
    """
    _write(file, lambda out: out.write(content), largest)


def _write(file: Path, write: Callable[[IO[bytes]], object], largest: int) -> None:
    part: Path | None = None
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=file.parent, suffix=".part", delete=False) as out:
            part = Path(out.name)
            write(out)
        part.replace(file)
        tidy(file.parent, largest=largest, spare=file)
    except OSError:
        if part is not None:
            with contextlib.suppress(OSError):
                part.unlink()


def tidy(folder: Path, *, largest: int = LARGEST, spare: Path | None = None) -> None:
    """Delete derived files of a folder, the least recently used first, until the rest is within a bound.

    Args:
        folder: Folder whose ``.npz`` and ``.glb`` files count; those of its subfolders do not.
        largest: Greatest size of the remaining files [bytes].
        spare: A file to keep whatever its size.
    """
    found = []
    for file in (f for f in folder.glob("*") if f.suffix in _KINDS):
        # Another process may be deleting files at the same time.
        with contextlib.suppress(OSError):
            known = file.stat()
            found.append((file != spare, known.st_mtime_ns, known.st_size, file))
    total = sum(size for _, _, size, _ in found)
    for deletable, _, size, file in sorted(found, key=lambda f: f[:2]):
        if deletable and total > largest:
            with contextlib.suppress(OSError):
                file.unlink()
            total -= size


def _member(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> npt.NDArray[Any]:
    with archive.open(info) as data:
        array: npt.NDArray[Any] = np.lib.format.read_array(data, allow_pickle=False)
        # zipfile compares the checksum only at the end of the data.
        if data.read(1):
            raise ValueError(f"{info.filename} is longer than its array")
    array.flags.writeable = False
    return array
