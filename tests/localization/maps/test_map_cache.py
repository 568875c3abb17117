from __future__ import annotations

import os
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from localization.maps.map_cache import load, store, tidy
from tests.support import bits

ARRAYS: dict[str, Any] = {
    "small": np.arange(6.0).reshape(2, 3),
    "large": np.random.default_rng(0).integers(0, 255, (40, 8, 8), dtype=np.uint8),
}


def aged(folder: Path, name: str, size: int, used: int) -> Path:
    """A derived file of a size that was last used at a time [s]."""
    file = folder / name
    file.write_bytes(bytes(size))
    os.utime(file, (used, used))
    return file


def test_arrays_are_restored(tmp_path: Path) -> None:
    file = tmp_path / "some.npz"
    store(file, ARRAYS)
    kept = load(file)
    assert kept is not None
    assert set(kept) == set(ARRAYS)
    for name, array in ARRAYS.items():
        assert bits(kept[name]) == bits(array)
        assert not kept[name].flags.writeable
    with np.load(file) as others:
        assert set(others) == set(ARRAYS)


def test_any_damage_is_detected(tmp_path: Path) -> None:
    file = tmp_path / "some.npz"
    store(file, ARRAYS)
    whole = file.read_bytes()
    rng = np.random.default_rng(1)
    for i in rng.integers(0, len(whole), 200).tolist():
        file.write_bytes(whole[:i] + bytes([whole[i] ^ (1 << i % 8)]) + whole[i + 1 :])
        kept = load(file)
        # Names, dates and attributes of members are not covered by their sums; their content is.
        if kept is not None and set(kept) == set(ARRAYS):
            assert all(bits(kept[name]) == bits(array) for name, array in ARRAYS.items())
    for i in rng.integers(0, len(whole), 30).tolist():
        file.write_bytes(whole[:i])
        assert load(file) is None


def test_missing_file_or_file_without_arrays_gives_none(tmp_path: Path) -> None:
    assert load(tmp_path / "none.npz") is None
    with zipfile.ZipFile(tmp_path / "some.npz", "w") as archive:
        archive.writestr("large.npy", b"not an array")
    assert load(tmp_path / "some.npz") is None


def test_least_recently_used_files_are_deleted_first(tmp_path: Path) -> None:
    for name, used in (("a", 30), ("b", 10), ("c", 20), ("d", 40)):
        aged(tmp_path, f"{name}.npz", 1000, used)
    (tmp_path / "notes.txt").write_bytes(bytes(9000))
    (tmp_path / "folder").mkdir()
    aged(tmp_path / "folder", "old.npz", 9000, 0)
    tidy(tmp_path, largest=2500)
    assert sorted(f.name for f in tmp_path.iterdir()) == ["a.npz", "d.npz", "folder", "notes.txt"]
    assert (tmp_path / "folder" / "old.npz").exists()


def test_read_and_just_written_files_are_kept(tmp_path: Path) -> None:
    files = [tmp_path / f"{i}.npz" for i in range(3)]
    for i, file in enumerate(files):
        store(file, ARRAYS)
        os.utime(file, (i, i))
    assert load(files[0]) is not None
    store(tmp_path / "3.npz", ARRAYS, largest=2 * files[0].stat().st_size)
    assert sorted(f.name for f in tmp_path.iterdir()) == ["0.npz", "3.npz"]
    store(tmp_path / "4.npz", ARRAYS, largest=1)
    assert [f.name for f in tmp_path.iterdir()] == ["4.npz"]
