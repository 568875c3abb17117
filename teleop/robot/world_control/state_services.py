"""The services of ``simulation_interfaces`` about the world as a whole: its name, its state, and its beginning."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from teleop.robot.world_control.answers import Answer, Request
from teleop.robot.world_control.results import Code, ControlError, Scope, State
from teleop.robot.world_control.simulated_entities import SimulatedWorld

_ALL: Final = Scope.TIME | Scope.STATE | Scope.SPAWNED
_OFFERED: Final = Scope.STATE | Scope.SPAWNED
"""What can be reset; time goes back in no world."""
_RESET_ALL: Final = (0, 255)
"""Values of the scope for everything."""


class StateServices:
    """Answers what concerns a world as a whole."""

    def __init__(
        self, control: SimulatedWorld, require_rest: Callable[[], object] = lambda: None
    ) -> None:
        """Answer for a world; ``require_rest`` raises a ControlError while it must not be changed."""
        self._control, self._require_rest = control, require_rest

    @property
    def answers(self) -> dict[str, Answer]:
        """What answers each service, by its type's name."""
        return {
            "ResetSimulation": self._reset,
            "GetSimulationState": self._state,
            "SetSimulationState": self._set_state,
            "GetCurrentWorld": self._world,
        }

    def _reset(self, request: Request) -> Request:
        self._require_rest()
        asked = request["scope"]
        if asked not in _RESET_ALL and asked & ~int(_ALL):
            raise ControlError(Code.UNSUPPORTED, f"scope {asked} has bits that are not known here")
        scope = _ALL if asked in _RESET_ALL else Scope(asked)
        if scope & ~_OFFERED:
            offered = ", ".join(str(s.name) for s in _OFFERED)
            raise ControlError(Code.UNSUPPORTED, f"of the scopes only {offered} can be reset here")
        self._control.reset(scope)
        return {}

    def _state(self, request: Request) -> Request:
        return {"state": {"state": int(self._control.state)}}

    def _set_state(self, request: Request) -> Request:
        self._require_rest()
        wanted = request["state"]["state"]
        if wanted == self._control.state:
            raise ControlError(Code.ALREADY_THERE, f"it is {self._control.state.name} already")
        if wanted not in self._control.states:
            offered = ", ".join(state.name for state in sorted(self._control.states))
            raise ControlError(
                Code.UNSUPPORTED, f"state {wanted} cannot be set here; those that can: {offered}"
            )
        self._control.set_state(State(wanted))
        return {}

    def _world(self, request: Request) -> Request:
        return {"world": world_resource(self._control.name)}


def world_resource(name: str) -> Request:
    """Return the ``WorldResource`` of a world."""
    resource = {"uri": name, "resource_string": ""}
    return {"name": name, "world_resource": resource, "description": "", "tags": []}
