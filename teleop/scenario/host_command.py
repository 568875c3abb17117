"""The command ``farsteer scenario host``: a robot for tests in any language, with the standard's services."""

from __future__ import annotations

import json
import signal
from dataclasses import dataclass
from typing import Annotated

import tyro

from localization.cli.terminal import remark, say


@dataclass(frozen=True)
class Host:
    """Serve a robot in lockstep for tests in any language, until SIGINT or SIGTERM.

    It prints a line, a JSON object with the robot's address and the referee's token. Who connects with this token may step
    the robot, put it elsewhere, reset the world, and put boxes and people into it, by the services of
    `simulation_interfaces` (docs/topics.md); everybody else is a client like any other. Give the token to your tests,
    never to the client under test.
    """

    scene: Annotated[str, tyro.conf.Positional] = "office"
    """Name of a scene, or the path of a scene folder, floor plan or MJCF file."""
    seed: int = 0
    """Seed of all noise; the same seed and the same messages at the same ticks give the same bits."""
    at: str = ""
    """Name of the place where the robot starts; the scene's own start unless given."""
    camera: str | None = None
    """Carry a camera of this model, for its topics: kinect, wide, small, arm; see docs/cameras.md."""
    truth: bool = False
    """Publish the topics of ground truth."""

    def __call__(self) -> int:
        """Serve it."""
        from teleop.scenario.robot_process import RobotProcess, robot_document

        start = {"at": self.at} if self.at else {}
        scenario = robot_document(self.scene, seed=self.seed, start=start, truth=self.truth)
        waited_for = (signal.SIGINT, signal.SIGTERM)
        robot = RobotProcess(scenario, "lockstep", spares=True, camera=self.camera)
        try:
            signal.pthread_sigmask(signal.SIG_BLOCK, waited_for)
            # In one line, after which who waits for it knows that it is whole.
            say(json.dumps({"url": robot.url, "port": robot.port, "token": robot.token}))
            remark(*robot.notes)
            remark("serving until Ctrl-C")
            signal.sigwait(waited_for)
        finally:
            robot.stop()
        return 0
