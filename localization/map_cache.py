"""Files derived from maps: whole or not there, checked when read, and never more than a bound.

A cache that cannot be read or written is done without. Of what is kept, whatever was not used for the
longest time goes first once a folder holds more than ``LARGEST`` bytes.
"""

from __future__ import annotations

import contextlib
import os
import struct
import tempfile
import zipfile
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt

Arrays = Mapping[str, npt.NDArray[Any]]

LARGEST = 2**30
"""A folder of derived files holds no more [bytes]: nine maps of two million points."""
_CHUNK = 2**20
"""Read at once when a file is checked [bytes]."""


def default_cache() -> Path:
    """Return the folder for derived files: ``$XDG_CACHE_HOME/farsteer`` or ``~/.cache/farsteer``."""
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "farsteer"


def load(file: Path, *, mapped: Collection[str] = ()) -> Arrays | None:
    """Read what ``store`` has written; None if it is missing or damaged.

    Args:
        file: an uncompressed ``.npz``.
        mapped: names of arrays that stay in the file and are paged in where they are looked at.

    Returns:
        Read-only arrays by name.
    """
    try:
        with file.open("rb") as raw, zipfile.ZipFile(raw) as archive:
            arrays = {
                info.filename.removesuffix(".npy"): _member(file, raw, archive, info, mapped)
                for info in archive.infolist()
            }
        # When it was last used, for the bound.
        os.utime(file)
    except (OSError, ValueError, KeyError, EOFError, struct.error, zipfile.BadZipFile):
        return None
    except NotImplementedError:
        # A damaged file may ask for any compression.
        return None
    return arrays


def store(file: Path, arrays: Arrays, *, largest: int = LARGEST) -> None:
    """Write arrays to a file at once, and keep the folder's derived files within a bound.

    Args:
        file: an ``.npz``; others in its folder may be deleted.
        arrays: by name.
        largest: the bound [bytes].
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
    """Delete derived files of a folder, the longest unused first, until the rest is within a bound.

    Args:
        folder: its own ``.npz`` files count, those of folders in it do not.
        largest: the bound [bytes].
        spare: a file to keep whatever its size.
    """
    found = []
    for file in folder.glob("*.npz"):
        # Another process may be tidying as well.
        with contextlib.suppress(OSError):
            known = file.stat()
            found.append((file != spare, known.st_mtime_ns, known.st_size, file))
    total = sum(size for _, _, size, _ in found)
    for deletable, _, size, file in sorted(found, key=lambda f: f[:2]):
        if deletable and total > largest:
            with contextlib.suppress(OSError):
                file.unlink()
            total -= size


def _member(
    file: Path,
    raw: IO[bytes],
    archive: zipfile.ZipFile,
    info: zipfile.ZipInfo,
    mapped: Collection[str],
) -> npt.NDArray[Any]:
    if info.filename.removesuffix(".npy") not in mapped:
        with archive.open(info) as data:
            array: npt.NDArray[Any] = np.lib.format.read_array(data, allow_pickle=False)
        array.flags.writeable = False
        return array
    # Reading to the end checks the sum, and brings the file into the system's page cache; the pages
    # count as this process's once they are looked at.
    with archive.open(info) as data:
        while data.read(_CHUNK):
            pass
    # A zip archive tells the lengths of a member's name and extra field before its data.
    raw.seek(info.header_offset + 26)
    lengths = struct.unpack("<HH", raw.read(4))
    raw.seek(info.header_offset + 30 + sum(lengths))
    if np.lib.format.read_magic(raw) != (1, 0) or info.compress_type != zipfile.ZIP_STORED:
        raise ValueError(f"{file}: {info.filename} cannot be mapped")
    shape, _, dtype = np.lib.format.read_array_header_1_0(raw)
    where = np.memmap(file, dtype=dtype, mode="r", offset=raw.tell(), shape=shape)
    # As a plain array, for indexing a memmap takes several times as long.
    return where.view(np.ndarray)
