"""The commands ``farsteer scenario list``, ``explain`` and ``schema``: what scenario files there are, and what is in them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from localization.cli.terminal import fitted, say, say_json
from localization.extras import require
from teleop.errors import SettingError


@dataclass(frozen=True)
class List:
    """List the scenarios of the project, or of a folder, each with what happens in it."""

    folder: Annotated[Path | None, tyro.conf.Positional] = None
    """A folder of scenario files; the project's own unless given."""

    def __call__(self) -> int:
        """List them; the exit status is 2 if a file of the folder cannot be read."""
        require("pydantic", "reading scenarios")

        from localization.report.plain_text import plain_text
        from teleop.scenario.files.errors import ScenarioFileError
        from teleop.scenario.files.reading import read_scenario
        from teleop.scenario.files.shipped import scenario_files, shipped_folder

        folder = self.folder or shipped_folder()
        if not folder.is_dir():
            raise SettingError(f"{folder} is no folder")
        files = scenario_files([str(folder)])
        status = 0
        for file in files:
            try:
                scenario = read_scenario(file)
            except ScenarioFileError as error:
                status = 2
                say(*map(plain_text, str(error).split("\n")))
                continue
            faults = ", ".join(dict.fromkeys(fault.kind for fault in scenario.fault))
            facts = [Path(scenario.world.scene).name, scenario.operator.kind, faults]
            head = f"{scenario.name}  ({'; '.join(filter(None, facts))})"
            say(*fitted(head, f"    {plain_text(scenario.description)}"))
        say("", f"{len(files)} scenarios in {folder}; run one with `farsteer scenario run NAME`")
        return status


@dataclass(frozen=True)
class Explain:
    """Explain the fields of scenario files: type, bounds, unit, default, and what they mean."""

    field: Annotated[str, tyro.conf.Positional] = ""
    """A field such as mission.goals.within, a table such as limits, or a kind of fault or operator such as kidnap;
    everything unless given."""

    def __call__(self) -> int:
        """Explain them."""
        require("pydantic", "explaining scenarios")

        from teleop.scenario.files.explaining import explanation

        say(*explanation(self.field))
        return 0


@dataclass(frozen=True)
class Schema:
    """Print the JSON Schema of scenario files, by which editors complete and check them."""

    def __call__(self) -> int:
        """Print it."""
        require("pydantic", "printing the schema")

        from teleop.scenario.files.fields import schema

        title = "Scenario of farsteer"
        say_json(
            {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": title}
            | {**schema()}
        )
        return 0
