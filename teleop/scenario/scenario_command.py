"""The command ``farsteer scenario``: runs, repeats, lists and explains scenarios."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, TypeAlias

import tyro

from teleop.scenario.file_commands import Explain, List, Schema
from teleop.scenario.host_command import Host
from teleop.scenario.replay_command import Replay
from teleop.scenario.run_command import Run

Command: TypeAlias = (
    Annotated[Run, tyro.conf.subcommand("run")]
    | Annotated[Replay, tyro.conf.subcommand("replay")]
    | Annotated[Host, tyro.conf.subcommand("host")]
    | Annotated[List, tyro.conf.subcommand("list")]
    | Annotated[Explain, tyro.conf.subcommand("explain")]
    | Annotated[Schema, tyro.conf.subcommand("schema")]
)


@dataclass(frozen=True)
class Scenarios:
    """Run, repeat, list and explain scenarios that judge who drives."""

    command: tyro.conf.OmitSubcommandPrefixes[tyro.conf.OmitArgPrefixes[Command]]

    def __call__(self) -> int:
        """Run the command."""
        run: Callable[[], int] = self.command
        return run()
