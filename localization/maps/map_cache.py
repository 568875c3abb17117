"""Cache of files derived from maps: written atomically, checked when read, bounded in size.

A cache that cannot be read or written is ignored. Once a folder holds more than ``LARGEST`` bytes, the least
recently used files are deleted.
"""

from __future__ import annotations

import contextlib
import os
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

Arrays = Mapping[str, npt.NDArray[Any]]

LARGEST = 2**30
"""Greatest size of a folder of derived files [bytes]: nine maps of two million points."""


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
    part: Path | None = None
    contents: dict[str, Any] = dict(arrays)
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=file.parent, suffix=".part", delete=False) as out:
            part = Path(out.name)
            np.savez(out, **contents)
        part.replace(file)
        tidy(file.parent, largest=largest, spare=file)
    except OSError:
        if part is not None:
            with contextlib.suppress(OSError):
                part.unlink()


def tidy(folder: Path, *, largest: int = LARGEST, spare: Path | None = None) -> None:
    """Delete derived files of a folder, the least recently used first, until the rest is within a bound.

    Args:
        folder: Folder whose ``.npz`` files count; those of its subfolders do not.
        largest: Greatest size of the remaining files [bytes].
        spare: A file to keep whatever its size.
    """
    found = []
    for file in folder.glob("*.npz"):
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
