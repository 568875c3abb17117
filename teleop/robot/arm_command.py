"""The command ``farsteer arm``: what an arm's servos bear and carry, and its description for ROS."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Final, TypeAlias

import tyro

from localization.cli.terminal import fitted, say, say_json

if TYPE_CHECKING:
    from robot_sim.arm.arm_table import ArmTable

_REACHES: Final = (0.20, 0.25, 0.30, 0.35, 0.38)
"""Distances at which the payload is printed, beside that of the stretched arm [m]."""


@dataclass(frozen=True)
class Torque:
    """Compare an arm's torques with the paper's table 4; print what its servos bear and carry.

    The paper is "Simulation And Real Time Of VR Controlled Robotic Manipulator Using ROS". Where it is misprinted, it
    is said what we read instead, and what shows it.
    """

    arm: str = "s2"
    """Name of an arm, or the path of a .toml file like assets/arms/s2.toml."""
    pose: str = "straight"
    """Named pose in which to print what the servos bear."""
    payload: float = 0.0
    """Mass at the tip in that pose [g]."""
    json: bool = False
    """Print the figures as JSON, in kgf cm and g."""

    def __call__(self) -> int:
        """Run the command."""
        from robot_sim.arm.arm_table import load_arm

        table = load_arm(self.arm)
        paper, servos = _paper(), _servos(table, self.pose, self.payload)
        carried = _carried(table)
        if self.json:
            say_json({"arm": table.name, "paper": paper, "servos": servos, "payload": carried})
            return 0
        say(*fitted(*_paper_lines(paper)), "")
        title = f"What the servos bear, {self.pose}, {self.payload:g} g at the tip [kgf cm]"
        say(title, *_servo_lines(table, servos), "", *_carried_lines(carried))
        return 0


@dataclass(frozen=True)
class Urdf:
    """Print the URDF of a P3-AT with an arm, as the robot serves it under /robot_description.

    Its links have masses, its shapes are cylinders and boxes: no meshes to fetch.
    """

    arm: str = "s2"
    """Name of an arm, or the path of a .toml file like assets/arms/s2.toml."""
    mount: str = "bracket"
    """Where it is mounted on the vehicle."""

    def __call__(self) -> int:
        """Run the command."""
        from robot_sim.arm.arm_table import load_arm
        from robot_sim.robot.platforms import P3AT
        from robot_sim.robot.urdf import urdf

        robot = P3AT()
        say(urdf(robot, robot.mounts, arm=load_arm(self.arm), arm_mount=self.mount).rstrip("\n"))
        return 0


Command: TypeAlias = (
    Annotated[Torque, tyro.conf.subcommand("torque")]
    | Annotated[Urdf, tyro.conf.subcommand("urdf")]
)


@dataclass(frozen=True)
class Arm:
    """Print what an arm's servos bear and carry, or its URDF.

    `farsteer arm torque` compares its torques with the paper's; with --pose ready --payload 20 in that pose and with
    20 g at its tip. `farsteer arm urdf > arm.urdf` writes what RViz, MoveIt's assistant and Unity import.

    To move it: `farsteer serve --arm --open`.
    """

    command: tyro.conf.OmitSubcommandPrefixes[tyro.conf.OmitArgPrefixes[Command]]

    def __call__(self) -> int:
        """Run the command."""
        run: Callable[[], int] = self.command
        return run()


def _paper() -> dict[str, Any]:
    """Return table 4 beside our figures for the paper's own arm, and the paper's misprints."""
    from robot_sim.arm.arm_table import load_arm
    from robot_sim.arm.printed_torques import PRINTED, misprints, paper_torques

    table = load_arm("s2")
    rows = [
        {"link": n, "printed": printed, "ours": ours}
        for n, (printed, ours) in enumerate(
            zip(PRINTED, paper_torques(table), strict=True), start=1
        )
    ]
    return {"table 4": rows, "misprints": misprints(table)}


def _servos(table: ArmTable, pose: str, grams: float) -> list[dict[str, Any]]:
    """Return torque, stall torque and share of each servo."""
    import numpy as np

    from robot_sim.arm.arm_table import KGF_CM
    from robot_sim.arm.statics import Statics, stall_torques
    from robot_sim.errors import ArmError

    if pose not in table.poses:
        raise ArmError(f"pose: {table.name} has no {pose!r}; there are: {', '.join(table.poses)}")
    if not 0.0 <= grams <= 1000.0:
        raise ArmError(f"payload must be 0 to 1000 g, got {grams:g}")
    angles = np.array(table.poses[pose])
    held = Statics(table).holding(angles, payload=1e-3 * grams).torques.tolist()
    rows = zip(table.joints, held, stall_torques(table, table.supply), strict=True)
    return [
        {
            "joint": joint.name,
            "turns": joint.turns,
            "servo": joint.servo.like,
            "torque": torque / KGF_CM,
            "stall": stall / KGF_CM,
            "share": abs(torque) / stall,
        }
        for joint, torque, stall in rows
    ]


def _carried(table: ArmTable) -> list[dict[str, Any]]:
    """Return the payload by reach for all of the stall torque and what a servo stands for long."""
    from robot_sim.arm.statics import payloads, stall_torques, straight_reach

    volts = sorted({v for joint in table.joints for v in joint.servo.stall})
    cases = [(volts[0], 1.0), *((v, table.holding.long) for v in volts)]
    limits = [[share * torque for torque in stall_torques(table, v)] for v, share in cases]
    reaches = [*(r for r in _REACHES if r < straight_reach(table)), straight_reach(table)]
    columns = [payloads(table, reach, limits) for reach in reaches]
    return [
        {
            "supply": supply,
            "share": share,
            "reach": [100.0 * reach for reach in reaches],
            "payload": [1000.0 * column[k].mass for column in columns],
            "joint": [column[k].joint for column in columns],
        }
        for k, (supply, share) in enumerate(cases)
    ]


def _paper_lines(paper: dict[str, Any]) -> Iterator[str]:
    yield "Torques with all links laid flat in one line, the paper's table 4 [kgf cm]"
    yield "         printed     ours   differ"
    for row in paper["table 4"]:
        apart = 100.0 * (row["ours"] / row["printed"] - 1.0)
        moment = "   a bending moment, no torque of its servo" if row["link"] in (1, 4) else ""
        yield f"  link {row['link']}{row['printed']:9.3f}{row['ours']:9.4f}{apart:+7.2f} %{moment}"
    yield ""
    yield "Misprints"
    for misprint in paper["misprints"]:
        yield f"  {misprint.place}:"
        yield f"    {misprint.printed}, read {misprint.read}; {misprint.shown}"


def _servo_lines(table: ArmTable, servos: Sequence[dict[str, Any]]) -> Iterator[str]:
    yield f"                             torque    stall   share at {table.supply:g} V"
    for row in servos:
        long = "" if row["share"] <= table.holding.long else "   not for long"
        name = f"{row['joint']} {row['turns']}"
        figures = f"{row['torque'] + 0.0:9.2f}{row['stall']:9.2f}{row['share']:8.0%}"
        yield f"  {name:<24}{figures}   {row['servo']}{long}"


def _carried_lines(carried: Sequence[dict[str, Any]]) -> Iterator[str]:
    yield "What it carries at the tip, in the best posture with the gripper within 60 deg"
    yield "of level [g], and the joint that bears no more"
    yield f"  {'at a reach of':<21}" + "".join(f"{r:6.1f} cm" for r in carried[0]["reach"])
    for row in carried:
        cells = (
            f"{mass:5.0f} ({joint[-1:]})"
            for mass, joint in zip(row["payload"], row["joint"], strict=True)
        )
        yield f"  {row['supply']:g} V, {row['share']:.0%} of stall".ljust(23) + "".join(cells)
