"""Reading of scenario files, with the line of each error."""

from __future__ import annotations

import json
import re
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from pydantic import ValidationError

from teleop.scenario.files.errors import (
    ScenarioError,
    ScenarioFileError,
    line_of,
    line_of_error,
    text_of,
)
from teleop.scenario.files.lines import lines_of
from teleop.scenario.files.operator_settings import Replay
from teleop.scenario.files.problems import scenario_errors
from teleop.scenario.files.scenario import SCHEMA, Scenario

_LARGEST: Final = 1 << 20
"""Largest size of a scenario file [bytes]."""


def read_scenario(path: Path) -> Scenario:
    """Read a scenario file.

    The files that it names, a scene and recorded commands, are found beside it, and are absolute paths in the
    result, whatever the working directory is.

    Args:
        path: The file.

    Raises:
        ScenarioFileError: If the file says what no scenario can; its text has a line for each error.
        OSError: If the file cannot be read.
    """
    if path.stat().st_size > _LARGEST:
        raise ScenarioFileError([f"{path}: larger than {_LARGEST >> 20} MiB: no scenario file"])
    try:
        text = text_of(path)
        data = tomllib.loads(text)
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1
        raise ScenarioFileError([f"{path}:{line}: the file must be UTF-8"]) from None
    except tomllib.TOMLDecodeError as error:
        raise ScenarioFileError([_syntax(error, path, text)]) from None
    try:
        return with_found_files(scenario_from(data), path.parent)
    except ExceptionGroup as group:
        lines = lines_of(text)
        errors = [e for e in group.exceptions if isinstance(e, ScenarioError)]
        errors.sort(key=lambda error: line_of(error, lines))
        raise ScenarioFileError([line_of_error(e, path, lines) for e in errors]) from None


def scenario_from(data: dict[str, Any]) -> Scenario:
    """Return the scenario that a document of TOML or JSON describes.

    Raises:
        ExceptionGroup: With a ``ScenarioError`` for each field that is wrong.
    """
    try:
        # Strict, but for JSON's own types: no number is read from a text, and lists are tuples.
        return SCHEMA.validate_json(json.dumps(data, default=str), strict=True)
    except ValidationError as error:
        problems = error.errors(include_url=False)
        raise ExceptionGroup("errors in a scenario", scenario_errors(problems, data)) from None


def with_found_files(scenario: Scenario, folder: Path) -> Scenario:
    """Return a scenario whose files are absolute paths.

    Args:
        scenario: A scenario whose files are relative to ``folder``.
        folder: Folder of the scenario file, which no file may be outside of.

    Raises:
        ExceptionGroup: With a ``ScenarioError`` for each file that is elsewhere or missing.
    """
    errors = []
    try:
        scenario = _with_found_scene(scenario, folder)
    except ScenarioError as error:
        errors.append(error)
    for name in ("operator", "second"):
        operator = getattr(scenario, name)
        if not isinstance(operator, Replay):
            continue
        try:
            file = _inside(folder, operator.file, (name, "file"))
            found = replace(operator, file=str(file))
            scenario = replace(scenario, **{name: found})  # type: ignore[arg-type]
        except ScenarioError as error:
            errors.append(error)
    if errors:
        raise ExceptionGroup("files of a scenario", errors)
    return scenario


def _with_found_scene(scenario: Scenario, folder: Path) -> Scenario:
    scene = scenario.world.scene
    if re.fullmatch(r"[A-Za-z0-9_-]+", scene):
        # A name; what comes with the project has precedence over a folder of that name.
        from robot_sim.floorplan.scene_folders import scene_names

        if scene in scene_names() or not (folder / scene).exists():
            return scenario
    found = _inside(folder, scene, ("world", "scene"))
    return replace(scenario, world=replace(scenario.world, scene=str(found)))


def _inside(folder: Path, name: str, field: tuple[str, str]) -> Path:
    """Return the path of a file in a folder; symbolic links may not lead out of it either."""
    if "\0" in name:
        raise ScenarioError(field, f"{name!r} is no name of a file")
    home = folder.resolve()
    path = Path(name)
    if path.is_absolute() or ".." in path.parts:
        raise ScenarioError(field, f"{name!r} must be a path inside the scenario file's folder")
    found = (home / path).resolve()
    if not found.is_relative_to(home):
        raise ScenarioError(field, f"{name!r} leads out of the scenario file's folder by a link")
    if not found.exists():
        raise ScenarioError(field, f"{name!r} is not in {folder}; put it beside the scenario file")
    return found


def _syntax(error: tomllib.TOMLDecodeError, path: Path, text: str) -> str:
    place = re.search(r" \(at (?:line (\d+), column \d+|end of document)\)$", str(error))
    line = place[1] if place and place[1] else text.rstrip("\n").count("\n") + 1
    return f"{path}:{line}: no TOML: {str(error)[: place.start()] if place else error}"
