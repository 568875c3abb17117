"""What clients do to the simulated world in real time, carried out between two ticks."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from localization.types import SECOND, Hint
from robot_sim import Simulation, scene_names
from teleop.robot.inbox import DriveCommand, InboxMessage, PoseHint, Relocalize, Undo, WorldCall
from teleop.robot.tick_record import PAUSED, Rejection, WorldAnswer
from teleop.robot.world_control.answers import Answer, Request, answered
from teleop.robot.world_control.entity_services import EntityServices
from teleop.robot.world_control.results import Code, ControlError, Scope, State
from teleop.robot.world_control.simulated_entities import SimulatedWorld
from teleop.robot.world_control.state_services import StateServices, world_resource

_OF_ENTITIES: Final = (
    *("GetEntities", "SetEntityState", "SpawnEntity", "DeleteEntity"),
    *("GetSpawnables", "GetNamedPoses"),
)
"""What is offered of the services about entities: nothing that returns a true pose."""
_A_TICK: Final = 3
"""Calls that are worked off in a tick: a collision check takes up to a millisecond of its twenty."""
_LONGEST_SLIP, _LARGEST_SLIP = 60.0, 10.0


@dataclass(frozen=True, slots=True)
class WorldChoice:
    """The world that a robot is started in anew."""

    scene: str
    """Name of the scene; empty for the present one."""
    people: bool
    """Whether people walk, doors swing and carts are pushed."""
    rearranged: int | None
    """Seed by which furniture has moved; None if it has not."""


class Playground(SimulatedWorld):
    """Owns whether the world stands still, and which one comes next; works off the calls of clients."""

    def __init__(
        self, simulation: Simulation, carried: Callable[[], object] = lambda: None
    ) -> None:
        """Play with a simulation; ``carried`` is called when the robot has been set down elsewhere."""
        super().__init__(simulation, carried)
        self._state = State.PLAYING
        self._calls: list[WorldCall] = []
        self._held: list[InboxMessage] = []
        self._hints: list[InboxMessage] = []
        self.answers: tuple[WorldAnswer, ...] = ()
        """Answers of the last tick."""
        self.next_world: WorldChoice | None = None
        """The world that somebody wants instead of this one."""
        entities = EntityServices(self).answers
        self._services: dict[str, Answer] = {
            **{name: entities[name] for name in _OF_ENTITIES},
            **StateServices(self).answers,
            "GetAvailableWorlds": self._worlds,
        }
        self._own: dict[str, Answer] = {
            "PlaygroundSlip": self._slip,
            "PlaygroundWorld": self._anew,
        }

    @property
    def paused(self) -> bool:
        """Whether the world stands still."""
        return self._state is State.PAUSED

    def admit(
        self, inbox: Sequence[InboxMessage]
    ) -> tuple[list[InboxMessage], tuple[Rejection, ...]]:
        """Work off the calls among the messages of a tick; return what else the robot is to obey, and what it is not.

        While the world stands still commands are refused, and hints and searches wait.
        """
        self._calls += [message for message in inbox if isinstance(message, WorldCall)]
        calls, self._calls = self._calls[:_A_TICK], self._calls[_A_TICK:]
        self.answers = tuple(WorldAnswer(call.number, self._answer(call)) for call in calls)
        hints, self._hints = self._hints, []
        messages = [*self._held, *inbox, *hints]
        if not self.paused:
            self._held = []
            return messages, ()
        self._held = [m for m in messages if isinstance(m, PoseHint | Undo | Relocalize)]
        refused = {m.client for m in messages if isinstance(m, DriveCommand)}
        others: list[InboxMessage] = [
            m for m in messages if not isinstance(m, DriveCommand) and m not in self._held
        ]
        return others, tuple(Rejection(client, PAUSED) for client in sorted(refused))

    def _answer(self, call: WorldCall) -> dict[str, Any]:
        request: Request = json.loads(call.request)
        if call.service in self._services:
            return answered(self._services[call.service], request)
        try:
            return {"success": True, **self._own[call.service](request)}
        except ControlError as error:
            return {"success": False, "message": str(error)}

    @property
    def state(self) -> State:
        """Whether time goes on."""
        return self._state

    @property
    def states(self) -> frozenset[State]:
        """States that can be set."""
        return frozenset({State.PLAYING, State.PAUSED})

    def set_state(self, state: State) -> None:
        """Let time go on, or pause it."""
        self._state = state

    def reset(self, scope: Scope) -> None:
        """See ``SimulatedWorld.reset``; the robot knows its start, as when it is switched on."""
        super().reset(scope)
        if Scope.STATE in scope:
            self._hints.append(PoseHint("", Hint(0, self._start, np.zeros((6, 6)))))

    def _worlds(self, request: Request) -> Request:
        return {"worlds": [world_resource(name) for name in scene_names()]}

    def _slip(self, request: Request) -> Request:
        seconds, factor = float(request["seconds"]), float(request["factor"])
        for field, value, most in (
            ("seconds", seconds, _LONGEST_SLIP),
            ("factor", factor, _LARGEST_SLIP),
        ):
            if not (math.isfinite(value) and 0.0 <= value <= most):
                raise ControlError(Code.FAILED, f"{field} must be 0 to {most:g}, got {value:g}")
        self._sim.slip(round(seconds * SECOND), factor)
        return {"message": f"the wheels seem to turn {factor:g} times as fast for {seconds:g} s"}

    def _anew(self, request: Request) -> Request:
        scene, seed = request["scene"], request["rearranged"]
        if scene and scene not in scene_names():
            names = ", ".join(scene_names())
            raise ControlError(Code.NOT_FOUND, f"no scene {scene[:80]!r}; there are: {names}")
        if seed < -1:
            raise ControlError(
                Code.FAILED, f"rearranged must be a seed, or -1 for none, got {seed}"
            )
        self.next_world = WorldChoice(scene, request["people"], None if seed < 0 else seed)
        return {"message": "the robot starts anew"}
