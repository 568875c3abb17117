"""The operator that a scenario asks for."""

from __future__ import annotations

from pathlib import Path

from teleop.errors import SettingError
from teleop.scenario.files import operator_settings as settings
from teleop.scenario.operators.careless import Careless
from teleop.scenario.operators.command_file import read_commands
from teleop.scenario.operators.follower import Follower
from teleop.scenario.operators.hand import HandOperator
from teleop.scenario.operators.operator import Operator
from teleop.scenario.operators.places import Places
from teleop.scenario.operators.replay import Replay
from teleop.scenario.operators.steering import SteeringModel
from teleop.scenario.operators.steps import StepOperator


def operator_of(chosen: settings.Operator, *, beside: Path | None) -> Operator:
    """Return the operator of the library that a scenario asks for.

    Args:
        chosen: The scenario's settings; not ``client`` or ``station``.
        beside: Folder of the scenario's file, for recorded commands; the present one if it has none.

    Raises:
        SettingError: If recorded commands cannot be read, or are not in the folder.
    """
    match chosen:
        case settings.Follower():
            return Follower(chosen)
        case settings.Steering():
            return SteeringModel(chosen)
        case settings.Careless():
            return Careless(chosen)
        case settings.Replay():
            return Replay(read_commands(_inside(beside or Path(), chosen.file)))
        case settings.Steps():
            return StepOperator(chosen)
        case settings.Places():
            return Places()
        case settings.Hand():
            return HandOperator(chosen)
        case settings.Client():
            raise SettingError("operator.kind: a client of your own drives, which --client starts")
        case settings.Station():
            raise SettingError("operator.kind: a station is a process of its own")


def _inside(folder: Path, name: str) -> Path:
    """Return the path of a file in a folder.

    Raises:
        SettingError: If it is elsewhere, also by a link.
    """
    path = (folder / name).resolve()
    if not path.is_relative_to(folder.resolve()):
        raise SettingError(f"operator.file: {name!r} is not in the scenario file's folder")
    return path
