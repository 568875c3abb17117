"""The services of ``simulation_interfaces`` 2.1, below ``/sim/``, for the referee.

A step is a tick of 20 ms. What is not offered answers ``RESULT_FEATURE_UNSUPPORTED``.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from teleop.robot.topics.topic_table import SIMULATION_ACTION, SIMULATION_SERVICES
from teleop.scenario.standard.access import RefereeAccess
from teleop.scenario.standard.answers import Answer, Request, answered, refuser
from teleop.scenario.standard.entity_services import EntityServices
from teleop.scenario.standard.results import Code, ControlError, Feature, Scope, State
from teleop.scenario.standard.stepping import Stepping
from teleop.scenario.standard.world_control import WorldControl

_ALL: Final = Scope.TIME | Scope.STATE | Scope.SPAWNED
_RESET_ALL: Final = (0, 255)
"""Values of the scope for everything."""
_OFFERED: Final = (
    Feature.SPAWNING,
    Feature.DELETING,
    Feature.NAMED_POSES,
    Feature.ENTITY_TAGS,
    Feature.ENTITY_CATEGORIES,
    Feature.ENTITY_STATE_GETTING,
    Feature.ENTITY_STATE_SETTING,
    Feature.ENTITY_INFO_GETTING,
    Feature.SPAWNABLES,
    Feature.SIMULATION_RESET,
    Feature.SIMULATION_STATE_GETTING,
    Feature.WORLD_INFO_GETTING,
    Feature.SPAWNING_ENTITIES,
)
"""What is always offered; the rest depends on the world's control."""
_STEPPING: Final = (
    Feature.SIMULATION_STATE_PAUSE,
    Feature.STEP_SIMULATION_SINGLE,
    Feature.STEP_SIMULATION_MULTIPLE,
    Feature.STEP_SIMULATION_ACTION,
)
"""What is offered where time can be paused."""


class SimulationServices:
    """Serves a world's control to the referee."""

    def __init__(self, access: RefereeAccess, control: WorldControl) -> None:
        """Offer the services; ``access`` watches the protocol already."""
        self._control = control
        self._stepping = Stepping(control)
        answers: dict[str, Answer] = {
            "GetSimulatorFeatures": self._features,
            "ResetSimulation": self._reset,
            "GetSimulationState": self._state,
            "SetSimulationState": self._set_state,
            "GetCurrentWorld": self._world,
            **EntityServices(control).answers,
        }
        for service in SIMULATION_SERVICES:
            name = service.type.rpartition("/")[2]
            handler = _served(answers.get(name) or refuser(name))
            stepping = name == "StepSimulation"
            access.serve(service.name, service.type, self._stepping.step if stepping else handler)
        access.serve_action(SIMULATION_ACTION.name, SIMULATION_ACTION.type, self._stepping.simulate)

    def _features(self, request: Request) -> Request:
        control, features = self._control, list(_OFFERED)
        for scope, feature in (
            (Scope.TIME, Feature.SIMULATION_RESET_TIME),
            (Scope.STATE, Feature.SIMULATION_RESET_STATE),
            (Scope.SPAWNED, Feature.SIMULATION_RESET_SPAWNED),
        ):
            if scope in control.scopes:
                features.append(feature)
        if len(control.states) > 1:
            features.append(Feature.SIMULATION_STATE_SETTING)
        if State.PAUSED in control.states:
            features += _STEPPING
        info = "A step is a tick of 20 ms. The world's frame is map. Entities stand on the ground."
        return {
            "features": {
                "features": sorted(map(int, features)),
                "spawn_formats": [],
                "custom_info": info,
            }
        }

    def _reset(self, request: Request) -> Request:
        self._stepping.require_rest()
        asked = request["scope"]
        if asked not in _RESET_ALL and asked & ~int(_ALL):
            raise ControlError(Code.UNSUPPORTED, f"scope {asked} has bits that are not known here")
        scope = _ALL if asked in _RESET_ALL else Scope(asked)
        if scope & ~self._control.scopes:
            offered = ", ".join(str(s.name) for s in Scope if s in self._control.scopes)
            raise ControlError(Code.UNSUPPORTED, f"of the scopes only {offered} can be reset here")
        self._control.reset(scope)
        return {}

    def _state(self, request: Request) -> Request:
        return {"state": {"state": int(self._control.state)}}

    def _set_state(self, request: Request) -> Request:
        self._stepping.require_rest()
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
        name = self._control.name
        return {
            "world": {
                "name": name,
                "world_resource": {"uri": name, "resource_string": ""},
                "description": "",
                "tags": [],
            }
        }


def _served(answer: Answer) -> Callable[[int, Request, int], Request]:
    return lambda client, request, now: answered(answer, request)
