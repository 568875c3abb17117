"""What is wrong with a scenario, and where it says so."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from teleop.errors import TeleopError
from teleop.scenario.files.lines import FieldPath as FieldPath, lines_of


class ScenarioError(TeleopError):
    """A field of a scenario that cannot be run; the text is one line that begins with the field."""

    def __init__(self, path: Sequence[str | int], message: str) -> None:
        """Join a field and what is wrong with it.

        Args:
            path: The field; empty for the scenario as a whole.
            message: What is wrong, and what would work.
        """
        self.path: FieldPath = tuple(path)
        """The field."""
        self.message = message
        """What is wrong, and what would work."""
        super().__init__(f"{dotted(self.path)}: {message}" if path else message)


class ScenarioFileError(TeleopError):
    """A scenario file with errors; the text has one line for each, with the file and the line in it."""

    def __init__(self, errors: Sequence[str]) -> None:
        """Join the lines."""
        self.errors = tuple(errors)
        """The lines."""
        super().__init__("\n".join(errors))


def text_of(file: Path) -> str:
    """Return the text of a scenario file, without the mark of the byte order with which editors on Windows begin it.

    Raises:
        UnicodeDecodeError: If it is not UTF-8.
    """
    return file.read_text(encoding="utf-8-sig")


def located(error: ScenarioError, file: Path) -> ScenarioFileError:
    """Return an error of a scenario file with its file and line."""
    lines = lines_of(text_of(file))
    return ScenarioFileError([line_of_error(error, file, lines)])


def line_of_error(error: ScenarioError, file: Path, lines: Mapping[FieldPath, int]) -> str:
    """Return ``FILE:LINE: field: message``."""
    return f"{file}:{line_of(error, lines)}: {error}"


def line_of(error: ScenarioError, lines: Mapping[FieldPath, int]) -> int:
    """Return the line of an error: that of the innermost part of its path that the file has."""
    path = error.path
    while path and path not in lines:
        path = path[:-1]
    return lines.get(path, 1)


def dotted(path: Sequence[str | int]) -> str:
    """Return a path as it is written in messages, such as ``mission.goals[1].at``."""
    text = ""
    for part in path:
        if isinstance(part, int):
            text += f"[{part}]"
        else:
            text += f".{part}" if text else part
    return text
