"""Drives whose commands, estimates and truth are kept tick by tick, through the whole robot in lockstep."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from benchmarks.replay.recordings import map_of, world_of
from localization.pipeline.localizer import Localizer
from localization.types import SECOND, Health, Pose, Twist
from robot_sim import TICK_NS, Simulation
from teleop.joystick import VelocityRequest
from teleop.prediction.predicted_motion import Command, Motion
from teleop.robot.drive import Drive
from teleop.robot.guard.guard import Guard
from teleop.robot.inbox import DriveCommand, InboxMessage, PoseHint
from teleop.robot.robot import Robot
from teleop.scenario.files.operator_settings import Station
from teleop.scenario.session.station import station_hint
from teleop.scenario.tour_driver import TourDriver

SCENES = ("office", "warehouse", "courtyard", "glasshouse")
SECONDS = 60.0
"""Length of a drive [s]."""
PERIOD = 5
"""Ticks between two looks of a driver who taps keys: 0.1 s."""
_STANDS = 2 * SECOND
"""The robot sets off after this time [ns]: the hint is given and answered before."""


@dataclass(frozen=True, slots=True)
class Moment:
    """One tick."""

    known: Motion | None
    """The newest estimate, in the map."""
    known_at: float
    """Its stamp [s]."""
    sent: Command
    """The command that arrives for it."""
    truth: Motion
    """Where the robot is at its end."""
    share: float
    """By which the guard multiplies the command."""


def drive(scene: str, seed: int, *, keys: bool) -> list[Moment]:
    """Drive a scene's tour by the truth.

    Args:
        scene: its name.
        seed: of noise and biases.
        keys: whether the driver taps keys, all or nothing, instead of holding a stick.
    """
    world = world_of(scene)
    simulation = Simulation(world, seed=seed)
    localizer = Localizer(map_of(scene), simulation.mounts)
    guard = Guard(world.robot, simulation.mounts, simulation.config.drive)
    robot, driver = Robot(Drive(simulation, guard=guard), localizer), TourDriver(world.tour)
    moments: list[Moment] = []
    wanted = Twist.planar(0.0, 0.0)
    for tick in range(round(SECONDS * SECOND / TICK_NS)):
        here, at = simulation.truth().map_from_base, simulation.stamp
        if at >= _STANDS and (tick % PERIOD == 0 or not keys):
            wanted = driver.command(here, Health.TRACKING)
            wanted = _keys(wanted) if keys else wanted
        request = VelocityRequest(wanted, enabled=True)
        inbox: list[InboxMessage] = [DriveCommand("driver", request, stream=True)]
        if tick == 0:
            inbox.append(PoseHint("", station_hint(Station("station"), seed, here)))
        record = robot.tick(at, inbox)
        estimate, truth = record.estimation.estimate, record.drive.truth
        pose = estimate.map_from_base
        moments.append(
            Moment(
                None if pose is None else _motion(pose, estimate.twist),
                estimate.stamp / SECOND,
                Command(at / SECOND, float(wanted.linear[0]), float(wanted.angular[2])),
                _motion(truth.map_from_base, truth.twist),
                record.drive.guard.factor,
            )
        )
    return moments


def _keys(wanted: Twist) -> Twist:
    """Return what somebody asks for who has keys alone, in the page's normal gear."""
    forward, turn = float(wanted.linear[0]), float(wanted.angular[2])
    return Twist.planar(
        0.5 if forward > 0.25 else 0.0, float(np.sign(turn)) * (abs(turn) > 0.3) * 0.6
    )


def _motion(pose: Pose, twist: Twist) -> Motion:
    x, y, _ = pose.position.tolist()
    return Motion(x, y, pose.yaw, float(twist.linear[0]), float(twist.angular[2]))
