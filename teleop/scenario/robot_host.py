"""The process of a robot that a test has started: ``RobotProcess`` is its other end."""

from __future__ import annotations

import asyncio
import json
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final

from localization.errors import LocalizationError
from localization.maps.map_cache import default_cache
from localization.surfaces.files import surfaces_of
from robot_sim import SimulationError
from teleop.clock import LARGEST_LAG, PERIOD, unix_seconds
from teleop.errors import TeleopError
from teleop.robot.lockstep_service import LockstepService
from teleop.robot.serving.server_setup import offer_map, offer_surfaces
from teleop.robot.tick_record import TickRecord
from teleop.robot.world_control.spares import SPARE_BOXES, SPARE_PEOPLE
from teleop.rosbridge.auth.authenticator import Authenticator
from teleop.scenario.files.reading import scenario_from
from teleop.scenario.files.scenario import Scenario
from teleop.scenario.referee.outcome import EventKind
from teleop.scenario.session.client_watch import ClientWatch
from teleop.scenario.session.links import link_of
from teleop.scenario.session.places import pose_of
from teleop.scenario.session.scene import Scene, checked_scene_of, options_of, scene_name
from teleop.scenario.session.session import SECOND, Session
from teleop.scenario.session.world_extras import extras_of
from teleop.scenario.standard.access import RefereeAccess
from teleop.scenario.standard.lockstep_world import LockstepWorld
from teleop.scenario.standard.simulation_services import SimulationServices

_SETTLING: Final = 0.002
"""Real time for frames that have been sent before a request to be read [s]."""
_REFUSALS: Final = (TeleopError, LocalizationError, SimulationError, ValueError, TypeError)
"""Errors that the test is answered with."""

Answer = dict[str, Any]


@dataclass
class _Host:
    """A robot, and what a test can do with it."""

    session: Session
    lockstep: LockstepService | None
    """Lets clients step it, too; None in real time."""
    last: TickRecord | None = None
    """The newest tick."""

    async def answer(self, request: Answer) -> Answer:
        """Do what is asked, and return the answer."""
        # What a client sent before the test asked is in the socket, and shall be read first.
        await asyncio.sleep(_SETTLING)
        match request["do"]:
            case "step":
                return await self._step(int(request["ticks"]))
            case "truth":
                return self._truth()
            case "carry":
                self.session.simulation.carry_to(pose_of(self.session.scene.world, request["to"]))
                return self._truth()
            case "events":
                events = self.session.referee.events
                kept = [{"stamp": e.stamp, "kind": e.kind.value, "text": e.text} for e in events]
                return {"events": kept}
        raise TeleopError(f"nobody can {request['do']} a robot")

    async def _step(self, ticks: int) -> Answer:
        if self.lockstep is None:
            raise TeleopError(
                "a robot in real time cannot be stepped; start it with pace='lockstep'"
            )
        if ticks < 1:
            raise TeleopError(f"ticks must be >= 1, got {ticks}")
        for _ in range(ticks):
            self.session.tick()
            await asyncio.sleep(0)
        return self._truth()

    def observe(self, tick: TickRecord) -> None:
        """Keep the newest tick."""
        self.last = tick

    def _truth(self) -> Answer:
        truth = self.session.simulation.truth()
        position = truth.map_from_base.position
        tick = self.last
        return {
            "stamp": self.session.stamp,
            "x": float(position[0]),
            "y": float(position[1]),
            "heading": float(truth.map_from_base.yaw),
            "speed": float(truth.twist.linear[0]),
            "turn_rate": float(truth.twist.angular[2]),
            "touching": [] if tick is None else list(tick.condition.touching),
            "health": "waiting" if tick is None else tick.estimate.health.value,
        }


async def serve(read: Callable[[], str], write: Callable[[Answer], None]) -> None:
    """Start the robot of the first request, and answer the others until there are no more.

    Args:
        read: Returns the next line; empty at the end.
        write: Sends an answer.
    """
    request = json.loads(read())
    is_real = request["pace"] == "real"
    notes: list[str] = []
    try:
        scenario = scenario_from(request["scenario"])
        scene = checked_scene_of(scenario)
        if request["spares"]:
            scene = _with_spares(scene, scenario)
        access = RefereeAccess(lambda client, name: note(f"{client} tried to use {name}"))
        session = Session(
            scenario,
            scene,
            link=link_of(scenario),
            authenticator=Authenticator(access.credentials(), unix_seconds),
            by_clock=is_real,
            camera=request["camera"],
            without_camera=lambda error: notes.append(f"serving without a camera: {error}"),
        )
    except ExceptionGroup as group:
        write({"error": "; ".join(map(str, group.exceptions))})
        return
    except _REFUSALS as error:
        write({"error": str(error)})
        return

    def note(text: str) -> None:
        session.note(EventKind.VIOLATION, text)

    server = session.server
    access.watch(server.protocol)
    ClientWatch(
        server.protocol,
        session.note,
        lambda connection: access.is_referee(connection.access),
    )
    offer_map(server, scene.map_file)
    offer_surfaces(server, surfaces_of(scene.cloud, cache=default_cache()))
    host = _Host(session, None if is_real else LockstepService(session.stepped))
    if not is_real:  # in the place of those that refuse everybody
        SimulationServices(access, LockstepWorld(session.stepped))
    session.stepped.observers = (*session.stepped.observers, host.observe)
    async with server:
        address = {"url": server.url, "host": server.host, "port": server.port}
        write({**address, "token": access.token, "notes": notes})
        ticking = asyncio.create_task(_tick_by_the_clock(session)) if is_real else None
        while line := await asyncio.to_thread(read):
            try:
                write(await host.answer(json.loads(line)))
            except _REFUSALS as error:
                write({"error": str(error)})
            if ticking is not None and ticking.done():
                ticking.result()
        if ticking is not None:
            ticking.cancel()
    if session.camera is not None:
        session.camera.close()


def _with_spares(scene: Scene, scenario: Scenario) -> Scene:
    """Return a scene with boxes and people that are parked until somebody spawns them."""
    name = scene_name(scenario.world, None)
    world = options_of(scenario.world).world(
        name,
        scenario.seed if scenario.world.alive else 0,
        extras_of(scenario, scene.world),
        spare_boxes=SPARE_BOXES,
        spare_people=SPARE_PEOPLE,
    )
    return replace(scene, world=world)


async def _tick_by_the_clock(session: Session) -> None:
    """Tick each 20 ms; a lag that is too long to be caught up is dropped."""
    loop = asyncio.get_running_loop()
    due = loop.time()
    while session.ending is None:
        session.tick()
        due = max(due + PERIOD / SECOND, loop.time() - LARGEST_LAG / SECOND)
        # Even a robot that is behind listens between two ticks.
        await asyncio.sleep(max(0.0, due - loop.time()))


def main() -> None:
    """Serve the process at the other end of the standard streams."""
    # What somebody prints goes where errors go; answers have the stream for themselves.
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)

    def write(answer: Answer) -> None:
        answers.write(json.dumps(answer) + "\n")
        answers.flush()

    asyncio.run(serve(sys.stdin.readline, write))


if __name__ == "__main__":
    main()
