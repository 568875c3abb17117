"""Errors of the simulation, all derived from SimulationError."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class SimulationError(Exception):
    """Base class of all errors that this package raises on purpose."""


class _UnknownNameError(SimulationError):
    kind = ""

    def __init__(self, name: str, available: Iterable[str]) -> None:
        self.name, self.available = name, tuple(available)
        super().__init__(f"no {self.kind} named {name!r}; available: {', '.join(self.available)}")


class UnknownSceneError(_UnknownNameError):
    """No scene has this name; the message lists the available ones."""

    kind = "scene"


class UnknownSurfaceError(_UnknownNameError):
    """No surface has this name; the message lists the available ones."""

    kind = "surface"


class WorldError(SimulationError):
    """The floor plan or MJCF file cannot be built, or a start pose lies inside an obstacle."""


class PhysicsError(SimulationError):
    """The physics became unstable; the simulation cannot continue from here."""


class SensorError(SimulationError, ValueError):
    """Invalid sensor parameters; the message names the parameter and the valid values."""


class PacketError(SimulationError, ValueError):
    """Bytes that are not a valid packet of the robot's controller, or values that do not fit one."""


class PageError(SimulationError):
    """A Markdown page lacks the markers between which a generated table is written."""


class CameraError(SimulationError, ValueError):
    """Invalid parameters of a camera; the message names the parameter and the valid values."""


class CameraUnavailableError(SimulationError):
    """Nothing can be rendered on this machine; the message names the packages that are missing."""


class ArmError(SimulationError, ValueError):
    """Invalid numbers of an arm; the message names the field and the valid values."""


def nearest(name: str, known: Iterable[str]) -> str:
    """Return the most similar of the known names, or all of them, as the end of a sentence."""
    names = list(known)
    near = difflib.get_close_matches(name, names, n=3, cutoff=0.5)
    return f"did you mean {' or '.join(near)}?" if near else f"there are: {', '.join(names)}"
