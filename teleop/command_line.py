"""All commands of ``farsteer``, their options, and the help that lists them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from operator import or_
from typing import TYPE_CHECKING, Annotated, Any, Final, TypeAlias

import tyro

from localization.cli.calibrate import Calibrate
from localization.cli.localize import Localize
from localization.cli.surfaces import Surfaces
from localization.cli.terminal import fitted
from teleop.bridges.commands import (
    KafkaBridge,
    KafkaRest,
    MotionPlatform,
    MotionReceiver,
    ServoBridge,
)
from teleop.console.commands import Console, Tokens
from teleop.link.commands import Link
from teleop.operator.commands import Operate
from teleop.robot.arm_command import Arm
from teleop.robot.board_command import ServoBoardCommand
from teleop.robot.commands import Serve, Validate
from teleop.scenario.fuzzing.fuzz_command import Fuzz
from teleop.scenario.precision.command import Precision
from teleop.scenario.scenario_command import Scenarios
from teleop.scenario.sweeps.command import Sweep
from teleop.scenario.tour.command import Evaluate, Sim
from teleop.scenario.whatif.command import WhatIf
from teleop.world_building.map_command import Map
from teleop.world_building.world_command import Worlds

COMMANDS: Final = {
    "sim": Sim,
    "evaluate": Evaluate,
    "localize": Localize,
    "calibrate": Calibrate,
    "map": Map,
    "surfaces": Surfaces,
    "world": Worlds,
    "serve": Serve,
    "console": Console,
    "tokens": Tokens,
    "operate": Operate,
    "link": Link,
    "kafka-bridge": KafkaBridge,
    "kafka-rest": KafkaRest,
    "arm": Arm,
    "servo-bridge": ServoBridge,
    "servo-board": ServoBoardCommand,
    "motion-platform": MotionPlatform,
    "motion-receiver": MotionReceiver,
    "validate": Validate,
    "scenario": Scenarios,
    "sweep": Sweep,
    "whatif": WhatIf,
    "fuzz": Fuzz,
    "precision": Precision,
}
"""The commands by name."""

if TYPE_CHECKING:
    Command: TypeAlias = Any
else:
    Command = reduce(
        or_, (Annotated[kind, tyro.conf.subcommand(name)] for name, kind in COMMANDS.items())
    )


@dataclass(frozen=True)
class CommandLine:
    """The whole command line.

    A class of its own, for a bare union tyro wraps in a generic one, and then parses the source of
    ``typing`` to find the field's description: a quarter of the time to parse a command.
    """

    command: tyro.conf.OmitSubcommandPrefixes[tyro.conf.OmitArgPrefixes[Command]]
    """Command to run."""


_HELP: Final = """\
usage: farsteer COMMAND [OPTIONS]

A skid-steer robot that knows where it is: simulation, localisation,
teleoperation.

commands (`farsteer COMMAND --help` lists the options of each):
{commands}

examples:
  farsteer sim                       drive the office tour; files in runs/
  farsteer sim --seed 3 --slip 60 90 other noise; the wheels spin at 60 and 90 s
  farsteer sim --alive --effects     among people, with real scanners' errors
  farsteer evaluate runs/x           print the report of a run again
  farsteer localize runs/x/readings.mcap --map scenes/office/cloud.ply
                                     the same estimates from the log alone
  farsteer localize office.bag --map office.ply --start 3 2 90
                                     a ROS bag that begins near (3, 2) m, 90 deg
  farsteer localize intel.log.gz --map map.yaml --truth reference.tum
                                     a CARMEN text, compared to a reference
  farsteer map drive.mcap --out map.ply
                                     a cloud from the readings of any drive
  farsteer surfaces map.yaml --out building.glb
                                     a map's walls, floor and furniture as glTF
  farsteer world generate --seed 7   a generated building to drive in
  farsteer serve --open              a robot, and the page to drive it
  farsteer serve --lan               the same for a tablet in this network
  farsteer console ws://host:9090    the page for another rosbridge server
  farsteer operate ws://127.0.0.1:9090
                                     watch it in rerun, drive it by keyboard
  farsteer kafka-bridge --brokers localhost:9092
                                     drive a robot by step commands of a topic
  farsteer servo-bridge ws://host:9090 --port /dev/ttyUSB0
                                     an Arduino's servos do what its arm does
  farsteer motion-platform ws://host:9090 --udp chair:9095
                                     a chair on six legs tilts as the robot does
  farsteer scenario run office-visit --client "npm run e2e"
                                     judge a client of your own; see report.html
  farsteer sweep office-visit --over link.delay=0:0.4:0.1 --stale on
                                     the same over delays and seeds
  farsteer whatif runs/x --at 41.2 --delay 0.5
                                     what if the link had been slower then?
  farsteer arm torque                what the arm's servos bear, and carry
  farsteer precision --surface carpet
                                     how exact steps of the robot are

other options:
  --version                          print the version
  --tyro-print-completion bash       print a completion script (or zsh, tcsh)

exit status:
  0 all limits met (localize: a pose was found), 1 not so, 2 bad input,
  3 the client under test failed, 130 interrupted"""


def help_text() -> str:
    """Return the help that lists all commands, in 80 columns."""
    width = max(map(len, COMMANDS))
    lines = [
        f"  {name:{width}}  {(command.__doc__ or '').splitlines()[0]}"
        for name, command in COMMANDS.items()
    ]
    return _HELP.format(commands="\n".join(fitted(*lines)))
