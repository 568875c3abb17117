"""The chair on a motion base over drives through the courtyard: lag, what it takes of its limits, what a rider feels.

The inertial unit's messages of a drive by the truth are followed at 100 Hz, 5 ms after they were measured, as over a
local network. Lag is the shift of the true roll and pitch that fits the platform's best. What is felt is weighted by
ISO 2631-1.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from benchmarks.bridges.whole_body_vibration import weighted_rms
from benchmarks.common.figures import OURS, Figure, say
from benchmarks.replay.recordings import Recording, record, world_of
from localization.types import SECOND, Inertial
from teleop.bridges.motion_platform.bridge_config import Cueing
from teleop.bridges.motion_platform.datagram import Receiver, pack
from teleop.bridges.motion_platform.follower import Follower
from teleop.bridges.motion_platform.limited_motion import PERIOD
from teleop.bridges.motion_platform.platform import Platform, load_platform
from teleop.robot.attitude_filter import AttitudeFilter

FloatArray = npt.NDArray[np.float64]

SEEDS: Final = (41, 42, 43)
SECONDS: Final = 100.0
_LINK: Final = 0.005
"""Age of a message when it arrives [s]."""
_LAGS: Final = np.arange(-0.02, 0.12, 0.001)
CUEINGS: Final[tuple[Cueing, ...]] = ("tilt", "washout")


@dataclass(frozen=True, slots=True)
class Ride:
    """What a platform did on a drive."""

    times: FloatArray
    """(T,) [s], by the robot's clock."""
    poses: FloatArray
    """(T, 6) of the platform [m, rad]."""
    true_tilt: FloatArray
    """(T, 2) roll and pitch of the robot at these times [rad]."""
    refused: int
    """Datagrams that a strict receiver refused."""


def main() -> None:
    """Print the figures of all drives."""
    platform = load_platform("simona")
    drives = [drive(seed) for seed in SEEDS]
    for cueing in CUEINGS:
        rides = [ride(recording, platform, cueing) for recording in drives]
        for figure in _figures(rides, platform, cueing):
            say(
                f"  {figure.case:8s} {figure.quantity:46s} {figure.text:16s} {figure.verdict}".rstrip()
            )


def drive(seed: int) -> Recording:
    """Return a drive through the courtyard."""
    return record(world_of("courtyard"), name="courtyard", seed=seed, seconds=SECONDS)


def ride(recording: Recording, platform: Platform, cueing: Cueing) -> Ride:
    """Follow a drive from its first message on."""
    messages = list(_messages(recording))
    follower, receiver = Follower(platform, cueing, 1.0), Receiver(platform)
    now, end, taken = messages[0][0], messages[-1][0], 0
    times, poses = [], []
    while now < end:
        while messages[taken][0] + _LINK <= now:
            follower.take_imu(messages[taken][1], messages[taken][0] + _LINK)
            taken += 1
        pose = follower.step(now)
        receiver.take(pack(pose))
        now += PERIOD
        # A pose is where the platform is at the end of its period.
        times.append(now)
        poses.append(pose.pose)
    return Ride(
        np.array(times), np.array(poses), _true_tilt(recording, np.array(times)), receiver.refused
    )


def lag(ride: Ride) -> float:
    """Return by how much the platform's tilt is behind the robot's [s]; the unit's own bias does not count."""
    moving = ride.poses[:, 3:5] - ride.poses[:, 3:5].mean(axis=0)
    off = []
    for shift in _LAGS:
        true = np.column_stack(
            [np.interp(ride.times - shift, ride.times, ride.true_tilt[:, axis]) for axis in (0, 1)]
        )
        off.append(np.square(moving - (true - true.mean(axis=0))).sum())
    return float(_LAGS[int(np.argmin(off))])


def felt(poses: FloatArray) -> tuple[float, float]:
    """Return the weighted horizontal and vertical acceleration of the platform's middle [m/s^2]."""
    moved = np.diff(poses[:, :3], n=2, axis=0) / PERIOD**2
    sides = [weighted_rms(moved[:, axis], PERIOD, "horizontal") for axis in (0, 1)]
    return float(np.linalg.norm(sides)), weighted_rms(moved[:, 2], PERIOD, "vertical")


def _figures(rides: list[Ride], platform: Platform, cueing: Cueing) -> Iterator[Figure]:
    n = sum(len(one.times) for one in rides)
    limits = platform.limits
    poses = [one.poses for one in rides]
    rates = [np.diff(one, axis=0) / PERIOD for one in poses]
    changes = [np.diff(one, axis=0) / PERIOD for one in rates]
    if cueing == "tilt":
        yield Figure(cueing, OURS, "lag", 1e3 * max(map(lag, rides)), "ms", n, most=40.0)
        off = [np.abs(one.poses[:, 3:5] - one.true_tilt) for one in rides]
        yield Figure(
            cueing,
            OURS,
            "tilt off the robot's, p95",
            _degrees(np.quantile(np.concatenate(off), 0.95)),
            "deg",
            n,
        )
    for name, values, most in (
        ("position", poses, limits.position),
        ("rate", rates, limits.rate),
        ("acceleration", changes, limits.acceleration),
    ):
        share = max(float((np.abs(one) / most).max()) for one in values)
        yield Figure(
            cueing,
            OURS,
            f"greatest share of the limits, {name}",
            100.0 * share,
            "%",
            n,
            most=100.0 + 1e-6,
        )
    yield Figure(
        cueing,
        OURS,
        "datagrams that a strict receiver refuses",
        sum(one.refused for one in rides),
        "",
        n,
        most=0.0,
    )
    if cueing == "washout":
        sides, up = np.max([felt(one) for one in poses], axis=0)
        yield Figure(cueing, OURS, "weighted acceleration, horizontal (W_d)", sides, "m/s2", n)
        yield Figure(cueing, OURS, "weighted acceleration, vertical (W_k)", up, "m/s2", n)


def _degrees(angle: float) -> float:
    return float(np.degrees(angle))


def _messages(recording: Recording) -> Iterator[tuple[float, dict[str, Any]]]:
    """Yield each message of ``/imu/data`` with the time at which it was measured [s]."""
    attitude = AttitudeFilter()
    for reading in recording.readings:
        if not isinstance(reading, Inertial):
            continue
        attitude = attitude.after(reading)
        w, x, y, z = attitude.quaternion
        yield (
            reading.stamp / SECOND,
            {
                "header": {
                    "stamp": {"sec": reading.stamp // SECOND, "nanosec": reading.stamp % SECOND},
                    "frame_id": "base_link",
                },
                "orientation": {"x": x, "y": y, "z": z, "w": w},
                "orientation_covariance": [0.0] * 9,
                "angular_velocity": dict(zip("xyz", reading.angular_velocity, strict=True)),
                "linear_acceleration": dict(zip("xyz", reading.specific_force, strict=True)),
            },
        )


def _true_tilt(recording: Recording, times: FloatArray) -> FloatArray:
    stamps = np.array(sorted(recording.truth)) / SECOND
    tilts = np.array([_tilt(recording.truth[stamp].rotation) for stamp in sorted(recording.truth)])
    return np.column_stack([np.interp(times, stamps, tilts[:, axis]) for axis in (0, 1)])


def _tilt(rotation: FloatArray) -> tuple[float, float]:
    return float(np.arctan2(rotation[2, 1], rotation[2, 2])), float(-np.arcsin(rotation[2, 0]))


def picture(path: Path, seed: int = SEEDS[0]) -> None:
    """Draw one drive: the robot's tilt, and the platform's by both rules."""
    from matplotlib.figure import Figure as Drawing

    platform, recording = load_platform("simona"), drive(seed)
    figure = Drawing(figsize=(7.0, 4.2), layout="constrained")
    axes = figure.subplots(2, 1, sharex=True)
    for cueing, colour in zip(CUEINGS, ("#009e73", "#d55e00"), strict=True):
        one = ride(recording, platform, cueing)
        for axis, (row, name) in enumerate(zip(axes, ("roll", "pitch"), strict=True)):
            if cueing == CUEINGS[0]:
                row.plot(
                    one.times,
                    np.degrees(one.true_tilt[:, axis]),
                    color="0.6",
                    lw=2.5,
                    label="robot",
                )
            row.plot(
                one.times,
                np.degrees(one.poses[:, 3 + axis]),
                color=colour,
                lw=0.9,
                label=f"platform, {cueing}",
            )
            row.set_ylabel(f"{name} [deg]")
            row.spines[["top", "right"]].set_visible(False)
    axes[0].legend(frameon=False, ncols=3, fontsize=8)
    axes[1].set_xlabel("time [s]")
    figure.savefig(path, dpi=90)
