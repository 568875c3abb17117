"""Scenarios that come with the project, and the files that a command's words name."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from pathlib import Path

from teleop.errors import SettingError
from teleop.scenario.files.errors import text_of


def shipped_folder() -> Path:
    """Return the folder of the scenarios that come with the project.

    A wheel has it inside the package; in the repository it is a folder beside it.
    """
    package = Path(__file__).parents[2]
    installed = package / "scenarios"
    return installed if installed.is_dir() else package.parent / "scenarios"


def shipped_files() -> dict[str, Path]:
    """Return the files of the scenarios that come with the project, by name."""
    return {path.stem: path for path in sorted(shipped_folder().glob("*.toml"))}


def scenario_files(words: Iterable[str]) -> list[Path]:
    """Return the scenario files that words name: files, folders of files, and scenarios of the project by name.

    Raises:
        SettingError: If there is no such file, or a folder holds no scenario.
    """
    return [path for word in words for path in _files(word)]


def _files(word: str) -> list[Path]:
    path = Path(word)
    if path.is_dir():
        found = [file for file in sorted(path.glob("*.toml")) if not _is_floor_plan(file)]
        if not found:
            raise SettingError(f"{word} holds no scenario file (*.toml)")
        return found
    if path.exists():
        return [path]
    shipped = shipped_files()
    if word in shipped:
        return [shipped[word]]
    from teleop.scenario.files.problems import nearest

    raise SettingError(
        f"{word} is neither a file nor a scenario of the project{nearest(word, list(shipped))}"
        " (`farsteer scenario list` names those)"
    )


def _is_floor_plan(file: Path) -> bool:
    """Return whether a file is a world that lies beside scenarios; one that is damaged is taken for a scenario."""
    try:
        data = tomllib.loads(text_of(file))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError):
        return False
    return "bounds" in data and "format" not in data
