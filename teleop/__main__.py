"""The ``farsteer`` command."""

from __future__ import annotations

import os

# One thread per process keeps sums in one order, and so the bits; numpy reads this when imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# rerun warns of each file that it writes on request; it reads this when imported.
os.environ.setdefault("RUST_LOG", "error")

import errno
import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Final, TypeAlias

import tyro

from localization.cli.calibrate import Calibrate
from localization.cli.localize import Localize
from localization.errors import LocalizationError
from teleop.errors import TeleopError
from teleop.operator.commands import Operate
from teleop.robot.commands import Serve, Validate
from teleop.scenario.commands import Evaluate, Sim
from teleop.world_building.map_command import Map
from teleop.world_building.world_command import Worlds

_EXAMPLES = """\
A skid-steer robot that knows where it is: simulation, localisation, teleoperation.

examples:
  farsteer sim                              drive the office tour, report to runs/<time>/
  farsteer sim --seed 3 --slip 60 90        other noise; the wheels spin at 60 and at 90 s
  farsteer sim --alive --effects            among people, with the errors that real scanners make
  farsteer sim --duration 20 --out runs/x   only the first 20 s, into a folder of your choice
  farsteer evaluate runs/x                  print the report again, from the files
  farsteer localize runs/x/readings.mcap --map scenes/office/cloud.ply --out replayed
                                            the same estimates from the log alone
  farsteer localize office.bag --map office.ply --start 3 2 90
                                            a ROS bag that begins near x 3 m, y 2 m, heading 90 degrees
  farsteer localize intel.log.gz --map map.yaml --truth reference.tum
                                            a CARMEN text in an occupancy grid, compared to a reference
  farsteer calibrate drive.mcap --map map.ply
                                            the mounting of the scanners, from a drive through a map
  farsteer map office                       drive the survey and rebuild the scene's cloud
  farsteer map drive.mcap --out map.ply     a cloud from the readings of any drive
  farsteer world generate --seed 7          a generated furnished building to drive and localise in
  farsteer validate                         the robot's physics against published figures
  farsteer serve --port 9090                a robot for any rosbridge client, in real time
  farsteer operate ws://127.0.0.1:9090      watch it in rerun, drive it from the keyboard
  farsteer --version                        print the version

exit status: 0 all limits met (localize: a pose was found), 1 not so, 2 bad input, 130 interrupted
"""

Command: TypeAlias = (
    Annotated[Sim, tyro.conf.subcommand("sim")]
    | Annotated[Evaluate, tyro.conf.subcommand("evaluate")]
    | Annotated[Localize, tyro.conf.subcommand("localize")]
    | Annotated[Calibrate, tyro.conf.subcommand("calibrate")]
    | Annotated[Map, tyro.conf.subcommand("map")]
    | Annotated[Worlds, tyro.conf.subcommand("world")]
    | Annotated[Serve, tyro.conf.subcommand("serve")]
    | Annotated[Operate, tyro.conf.subcommand("operate")]
    | Annotated[Validate, tyro.conf.subcommand("validate")]
)


@dataclass(frozen=True)
class CommandLine:
    """The whole command line.

    A class of its own, for a bare union tyro wraps in a generic one, and then parses the source of
    ``typing`` to find the field's description: a quarter of the time of ``farsteer --help``.
    """

    command: tyro.conf.OmitSubcommandPrefixes[tyro.conf.OmitArgPrefixes[Command]]
    """Command to run."""


_EXTRAS: Final = {
    "cbor2": "wire",
    "embreex": "sim",
    "matplotlib": "report",
    "mujoco": "sim",
    "msgspec": "wire",
    "open3d": "map",
    "pybase64": "wire",
    "rerun": "operator",
    "rerun_bindings": "operator",
    "websockets": "wire",
}
"""Optional libraries by import name, with the extra of ``farsteer`` that installs each."""

_FULL_DISK: Final = (errno.ENOSPC, errno.EDQUOT, errno.EROFS)


def main(arguments: list[str] | None = None) -> int:
    """Parse the command line, run the command and return the exit status."""
    if (sys.argv[1:] if arguments is None else arguments) == ["--version"]:
        from importlib.metadata import version

        sys.stdout.write(f"farsteer {version('farsteer')}\n")
        return 0
    try:
        line = tyro.cli(CommandLine, prog="farsteer", description=_EXAMPLES, args=arguments)
        run: Callable[[], int] = line.command
        return run()
    except KeyboardInterrupt:
        sys.stderr.write("\nfarsteer: interrupted\n")
        return 130
    except BrokenPipeError:
        return 0
    except Exception as error:
        message = _user_error(error)
        if message is None:
            raise
        sys.stderr.write(f"\nfarsteer: {message}\n")
        return 2


def _user_error(error: Exception) -> str | None:
    """Return the message of an error that the user can correct; None for a defect of the program."""
    if isinstance(error, (LocalizationError, TeleopError, *_loaded_errors())):
        return str(error)
    if isinstance(error, OSError) and (error.filename or error.errno in _FULL_DISK):
        return str(error)
    if isinstance(error, ImportError) and error.name is None:
        return str(error)  # raised by a package that explains what to install
    if isinstance(error, ModuleNotFoundError):
        extra = _EXTRAS.get((error.name or "").partition(".")[0])
        return extra and f"{error.name} is missing: pip install 'farsteer[{extra}]'"
    return None


def _loaded_errors() -> list[type[Exception]]:
    """Return the base errors of packages that are imported only when a command needs them."""
    families = (
        ("robot_sim.errors", "SimulationError"),
        ("teleop.rosbridge.errors", "RosbridgeError"),
    )
    # An error whose module was never imported cannot have been raised.
    return [getattr(sys.modules[m], name) for m, name in families if m in sys.modules]


if __name__ == "__main__":
    sys.exit(main())
