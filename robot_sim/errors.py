"""What can go wrong in the simulation, each told in one line."""

from __future__ import annotations

from collections.abc import Iterable


class SimulationError(Exception):
    """Base of everything this package raises on purpose."""


class UnknownSceneError(SimulationError):
    """There is no scene of that name."""

    def __init__(self, name: str, available: Iterable[str]) -> None:
        self.name = name
        self.available = tuple(available)
        super().__init__(f"no scene named {name!r}; available: {', '.join(self.available)}")


class UnknownSurfaceError(SimulationError):
    """There is no surface of that name."""

    def __init__(self, name: str, available: Iterable[str]) -> None:
        self.name = name
        self.available = tuple(available)
        super().__init__(f"no surface named {name!r}; available: {', '.join(self.available)}")


class WorldError(SimulationError):
    """A floor plan that cannot be built, or a start pose inside an obstacle."""


class PhysicsError(SimulationError):
    """The physics became unstable; the simulation cannot go on from here."""


class SensorError(SimulationError, ValueError):
    """A sensor that cannot be: the message names the parameter and what would work."""


class PacketError(SimulationError, ValueError):
    """Bytes that are not a sound packet of the robot's controller, or numbers that fit in none."""


class PageError(SimulationError):
    """A page has no place for what shall be written into it."""
