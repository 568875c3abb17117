"""A robot in lockstep whose world the referee controls, and clients at its protocol."""

from __future__ import annotations

import itertools
import json
from pathlib import Path
from typing import Any

from localization.maps.cloud import Cloud
from localization.maps.prepared_map import prepare
from robot_sim import Simulation, World
from teleop.robot.assembly import RobotParts, build_stepped_robot
from teleop.robot.serving.serve_config import ServeConfig
from teleop.robot.tick_record import TickRecord
from teleop.rosbridge.auth.authenticator import Authenticator
from teleop.rosbridge.framing.outgoing_frames import CloseFrame
from teleop.scenario.standard.access import RefereeAccess
from teleop.scenario.standard.lockstep_world import LockstepWorld
from teleop.scenario.standard.simulation_services import SimulationServices


class Desk:
    """A plain robot in lockstep with the standard's services; no socket, no clock."""

    def __init__(self, world: World, cloud: Cloud, cache: Path) -> None:
        self.violations: list[tuple[str, str]] = []
        self.access = RefereeAccess(lambda *attempt: self.violations.append(attempt))
        authenticator = Authenticator(self.access.credentials(), lambda: 0.0)
        self.stepped = build_stepped_robot(
            RobotParts(world, seed=1),
            cloud,
            prepare(cloud, cache=cache),
            ServeConfig(port=0, lockstep=True),
            authenticator=authenticator,
        )
        self.protocol = self.stepped.gateway.server.protocol
        self.ticks: list[TickRecord] = []
        self.stepped.observers = (self.ticks.append,)
        self.access.watch(self.protocol)
        SimulationServices(self.access, LockstepWorld(self.stepped))
        self._received: dict[int, list[Any]] = {}
        self._ids = itertools.count()
        self.referee = self.connect(self.access.token)

    @property
    def simulation(self) -> Simulation:
        return self.stepped.robot.simulation

    def connect(self, token: str | None = None) -> int:
        """Connect a client, with a token in its request or without."""
        authenticator = self.protocol.authenticator
        assert authenticator is not None
        access = None if token is None else authenticator.verify_token(token)
        assert (access is None) == (token is None)
        return self.protocol.connect(self.stepped.stamp, access=access)

    def send(self, client: int, **operation: object) -> None:
        """Send an operation as a client."""
        self.protocol.receive(client, json.dumps(operation), self.stepped.stamp)

    def received(self, client: int) -> list[Any]:
        """Return the operations sent to a client since the last call."""
        for other, output in self.protocol.connections.drain():
            decoded = (
                {"op": "closed"} if isinstance(output, CloseFrame) else json.loads(output.text)
            )
            self._received.setdefault(other, []).append(decoded)
        return self._received.pop(client, [])

    def ask(self, client: int, service: str, **args: object) -> tuple[bool, Any]:
        """Call a service of ``/sim``; return ``result`` and ``values``."""
        identity = f"call {next(self._ids)}"
        self.send(client, op="call_service", id=identity, service=f"/sim/{service}", args=args)
        answers = [o for o in self.received(client) if o.get("id") == identity]
        assert len(answers) == 1, answers
        return answers[0]["result"], answers[0]["values"]

    def call(self, service: str, **args: object) -> Any:
        """Call a service as the referee, which is always answered with values."""
        good, values = self.ask(self.referee, service, **args)
        assert good, values
        return values

    def done(self, service: str, **args: object) -> Any:
        """Call a service as the referee, and have it carried out."""
        values = self.call(service, **args)
        assert values["result"] == {"result": 1, "error_message": ""}, values
        return values

    def refused(self, service: str, **args: object) -> tuple[int, str]:
        """Call a service as the referee; return the result's code and text."""
        answer = self.call(service, **args)["result"]
        assert answer["result"] != 1, answer
        return answer["result"], answer["error_message"]


def pose(x: float, y: float, w: float = 1.0, z: float = 0.0) -> dict[str, Any]:
    """Return a pose on the floor; w and z are of its quaternion."""
    return {
        "position": {"x": x, "y": y, "z": 0.0},
        "orientation": {"w": w, "x": 0.0, "y": 0.0, "z": z},
    }
