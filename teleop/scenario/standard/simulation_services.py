"""The services of ``simulation_interfaces`` 2.1, below ``/sim/``, for the referee.

A step is a tick of 20 ms. What is not offered answers ``RESULT_FEATURE_UNSUPPORTED``.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from teleop.robot.topics.topic_table import SIMULATION_ACTION, SIMULATION_SERVICES
from teleop.robot.world_control.answers import Answer, Request, answered, refuser
from teleop.robot.world_control.entity_services import EntityServices
from teleop.robot.world_control.results import Feature
from teleop.robot.world_control.state_services import StateServices
from teleop.scenario.standard.access import RefereeAccess
from teleop.scenario.standard.lockstep_world import LockstepWorld
from teleop.scenario.standard.stepping import Stepping

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
    Feature.SIMULATION_RESET_STATE,
    Feature.SIMULATION_RESET_SPAWNED,
    Feature.SIMULATION_STATE_GETTING,
    Feature.SIMULATION_STATE_PAUSE,
    Feature.STEP_SIMULATION_SINGLE,
    Feature.STEP_SIMULATION_MULTIPLE,
    Feature.STEP_SIMULATION_ACTION,
    Feature.WORLD_INFO_GETTING,
    Feature.SPAWNING_ENTITIES,
)
"""What is offered."""


class SimulationServices:
    """Serves a world's control to the referee."""

    def __init__(self, access: RefereeAccess, control: LockstepWorld) -> None:
        """Offer the services; ``access`` watches the protocol already."""
        self._stepping = Stepping(control)
        answers: dict[str, Answer] = {
            "GetSimulatorFeatures": _features,
            **StateServices(control, self._stepping.require_rest).answers,
            **EntityServices(control).answers,
        }
        for service in SIMULATION_SERVICES:
            name = service.type.rpartition("/")[2]
            handler = _served(answers.get(name) or refuser(name))
            stepping = name == "StepSimulation"
            access.serve(service.name, service.type, self._stepping.step if stepping else handler)
        access.serve_action(SIMULATION_ACTION.name, SIMULATION_ACTION.type, self._stepping.simulate)


def _features(request: Request) -> Request:
    info = "A step is a tick of 20 ms. The world's frame is map. Entities stand on the ground."
    return {
        "features": {
            "features": sorted(map(int, _OFFERED)),
            "spawn_formats": [],
            "custom_info": info,
        }
    }


def _served(answer: Answer) -> Callable[[int, Request, int], Request]:
    return lambda client, request, now: answered(answer, request)
