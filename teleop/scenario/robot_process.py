"""A simulated robot in a process of its own, for tests; it needs nothing but the standard library here.

The two processes speak lines of JSON over pipes: what a client under test does on its socket cannot hold them up,
and a client that blocks the test's own process cannot hold up the robot.
"""

from __future__ import annotations

import json
import os
import select
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from teleop.errors import TeleopError

_START: Final = 180.0
"""Real time within which a robot starts [s]: the first time in a scene, its map is prepared."""
_ANSWER: Final = 120.0
"""Real time within which it answers [s], besides that for the ticks of a step."""
_TICK: Final = 0.2
"""Real time that a tick may take [s]."""


class RobotError(TeleopError):
    """The robot refuses a request, or has ended; the message says why."""


def robot_document(
    scene: str,
    *,
    seed: int,
    start: Mapping[str, Any],
    truth: bool,
    world: Mapping[str, Any] = {},
    faults: Sequence[Mapping[str, Any]] = (),
) -> dict[str, Any]:
    """Return the document of a scenario without goals or limits, for a robot that clients drive for a day at most.

    Args:
        scene: Name of a scene, or path of a scene folder, floor plan or MJCF file.
        seed: Seed of the robot's noise.
        start: Fields of the table ``start``.
        truth: Whether the topics of ground truth are published.
        world: Further fields of the table ``world``.
        faults: Tables ``fault``.
    """
    return {
        "format": 1,
        "name": "robot",
        "seed": seed,
        "world": {"scene": scene, **world},
        "start": dict(start),
        "mission": {"time_limit": 86_400.0},
        "operator": {"kind": "client", "truth": truth},
        "fault": [dict(fault) for fault in faults],
    }


@dataclass(frozen=True, slots=True)
class TrueState:
    """Where the robot really is."""

    stamp: int
    """Robot time [ns]."""
    x: float
    """True x in ``map`` [m]."""
    y: float
    """True y in ``map`` [m]."""
    heading: float
    """True heading in ``map`` [rad]."""
    speed: float
    """True forward speed [m/s]."""
    turn_rate: float
    """True turn rate, positive to the left [rad/s]."""
    touching: tuple[str, ...]
    """Names of the obstacles that it touches."""
    health: str
    """What it publishes of its localisation, such as ``tracking``."""


@dataclass(frozen=True, slots=True)
class RobotEvent:
    """Something that the referee noted, such as a contact, a stop or a client that came."""

    stamp: int
    """Robot time [ns]."""
    kind: str
    """What it is about: contact, stop, hint, health, client, fault or violation."""
    text: str
    """What happened."""


class RobotProcess:
    """Owns the robot's process."""

    def __init__(
        self,
        scenario: Mapping[str, Any],
        pace: str,
        *,
        spares: bool = False,
        camera: str | None = None,
    ) -> None:
        """Start the robot and wait until clients can connect.

        Args:
            scenario: The document of a scenario, whose operator is a client.
            pace: ``lockstep`` or ``real``.
            spares: Whether boxes and people can be put into its world while it runs.
            camera: Name of the camera that it carries in lockstep; None for none.

        Raises:
            RobotError: If there can be no such robot.
        """
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115 (open until ``stop``)
        self._process = subprocess.Popen(
            [sys.executable, "-m", "teleop.scenario.robot_host"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            bufsize=0,
            start_new_session=True,  # Ctrl-C is for the tests, which end it
            env=_environment(camera=camera is not None),
        )
        self._received = b""
        try:
            request = {"scenario": scenario, "pace": pace, "spares": spares, "camera": camera}
            started = self._ask(request, _START)
        except BaseException:
            self.stop()
            raise
        self.url: str = started["url"]
        """Address of its WebSocket, such as ``ws://127.0.0.1:41234``."""
        self.host: str = started["host"]
        """Host of that address."""
        self.port: int = started["port"]
        """Port of that address."""
        self.token: str = started["token"]
        """The referee's token: who connects with it may call the services of ``simulation_interfaces``, in lockstep."""
        self.notes: tuple[str, ...] = tuple(started["notes"])
        """What the robot lacks of what it was asked for, a line each."""

    def step(self, ticks: int = 1) -> TrueState:
        """Advance a robot in lockstep by a number of ticks of 20 ms; what clients have sent counts from the first.

        Raises:
            RobotError: If it runs in real time.
        """
        return _state(self._ask({"do": "step", "ticks": ticks}, _ANSWER + _TICK * ticks))

    def truth(self) -> TrueState:
        """Return where the robot really is."""
        return _state(self._ask({"do": "truth"}))

    def carry_to(self, place: str | Sequence[float]) -> TrueState:
        """Set the robot down elsewhere, as if somebody had carried it.

        Args:
            place: Name of a place of the scene, or x, y [m] and heading [degrees].

        Raises:
            RobotError: If there is no such place, or an obstacle stands there.
        """
        where = place if isinstance(place, str) else list(place)
        return _state(self._ask({"do": "carry", "to": where}))

    def events(self) -> list[RobotEvent]:
        """Return what the referee has noted so far, in order."""
        return [RobotEvent(**event) for event in self._ask({"do": "events"})["events"]]

    def stop(self) -> None:
        """End the robot and its process."""
        if self._process.stdin is not None:
            self._process.stdin.close()
        try:
            self._process.wait(5.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        if self._process.stdout is not None:
            self._process.stdout.close()
        self._errors.close()

    def _ask(self, request: Mapping[str, Any], patience: float = _ANSWER) -> dict[str, Any]:
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(json.dumps(request).encode() + b"\n")
        except (BrokenPipeError, ValueError):
            raise RobotError(f"the robot has ended: {self._last_words()}") from None
        answer: dict[str, Any] = json.loads(self._line(patience))
        if "error" in answer:
            raise RobotError(answer["error"])
        return answer

    def _line(self, patience: float) -> bytes:
        """Return the next line of the robot; it is the only one, since each request has one answer."""
        assert self._process.stdout is not None
        while b"\n" not in self._received:
            ready, _, _ = select.select([self._process.stdout], [], [], patience)
            if not ready:
                raise RobotError(f"the robot has not answered within {patience:g} s")
            part = self._process.stdout.read(1 << 16)
            if not part:
                raise RobotError(f"the robot has ended: {self._last_words()}")
            self._received += part
        line, _, self._received = self._received.partition(b"\n")
        return line

    def _last_words(self) -> str:
        if self._errors.closed:
            return "it was stopped"
        self._errors.seek(0)
        lines = self._errors.read().decode("utf-8", "replace").strip().splitlines()
        return lines[-1] if lines else "it said nothing"


def _environment(*, camera: bool) -> dict[str, str]:
    """Return the environment of a robot's process; one without a camera loads no OpenGL."""
    # Without a choice of somebody's MuJoCo would look for a display.
    no_display = {"MUJOCO_GL": "disable"}
    environment = {**no_display, **os.environ, "OPENBLAS_NUM_THREADS": "1"}
    return environment if camera else {**environment, **no_display}


def _state(answer: Mapping[str, Any]) -> TrueState:
    return TrueState(**{**answer, "touching": tuple(answer["touching"])})
