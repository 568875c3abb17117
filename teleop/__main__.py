"""The ``farsteer`` command."""

from __future__ import annotations

import os

# One thread per process keeps sums in one order, and so the bits; numpy reads this when imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# rerun warns of each file that it writes as we ask it to; it reads this when imported.
os.environ.setdefault("RUST_LOG", "error")

import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, TypeAlias

import tyro

from localization.cli.calibrate import Calibrate
from localization.cli.localize import Localize
from localization.cli.run_folder import run_folder
from localization.cli.terminal import Progress as _Progress, say as _say
from teleop.robot.robot_options import RobotOptions
from teleop.world_building.map_command import Map
from teleop.world_building.world_command import Worlds

_EXAMPLES = """\
A skid-steer robot that knows where it is: simulation, localisation, teleoperation.

examples:
  farsteer sim                              drive the office tour, report to runs/<time>/
  farsteer sim --seed 3 --slip 60 90        other noise; the wheels spin at 60 and at 90 s
  farsteer sim --alive --effects            among people, with scanners that are fooled as real ones are
  farsteer sim --duration 20 --out runs/x   only the first 20 s, into a folder of your choice
  farsteer evaluate runs/x                  print the report again, from the files
  farsteer localize runs/x/readings.mcap --map scenes/office/cloud.ply --out replayed
                                            the same estimates from the log alone
  farsteer localize office.bag --map office.ply --start 3 2 90
                                            a ROS bag, begun near x 3 m, y 2 m, facing 90 degrees
  farsteer localize intel.log.gz --map map.yaml --truth reference.tum
                                            a CARMEN text in an occupancy grid, judged by a reference
  farsteer calibrate drive.mcap --map map.ply
                                            where the scanners really sit, by a drive through a map
  farsteer map office                       drive the survey and build the scene's cloud anew
  farsteer map drive.mcap --out map.ply     a cloud from readings alone, of anybody's drive
  farsteer world generate --seed 7          make up a furnished building, to drive in and localise in
  farsteer validate                         the robot's physics against published figures
  farsteer serve --port 9090                a robot for any rosbridge client, in real time
  farsteer operate ws://127.0.0.1:9090      look at it in rerun, drive it from the keyboard

exit status: 0 all limits met (localize: a pose was found), 1 not so, 2 bad input, 130 interrupted
"""


@dataclass(frozen=True)
class Sim:
    """Drive a scene's tour and report how well the robot knew where it was.

    Two processes, joined by rosbridge alone: the robot here, and a scripted operator that holds the map
    file. It gives a hint that is wrong by a metre and 20 degrees, then steers by what it receives. They
    run in lockstep, faster than real time, with the same bits for the same seed. Everything ends up in
    a folder: readings.mcap, truth.tum, estimate.tum, trace.csv, config.json, summary.json, run.png, and
    the operator's display, operator.rrd.
    """

    scene: str = "office"
    """Which place to drive in."""
    seed: int = 0
    """Of all noise; the same seed gives the same bits."""
    pose_error: float = 1.0
    """How far the hint is from the truth [m]."""
    heading_error: float = 20.0
    """How far it is turned from it [degrees]."""
    slip: Annotated[tuple[float, ...], tyro.conf.arg(metavar="S ...")] = ()
    """Times at which the wheels spin at twice their speed for a second [s]."""
    duration: float | None = None
    """Stop after so many seconds of robot time."""
    options: tyro.conf.OmitArgPrefixes[RobotOptions] = field(default_factory=RobotOptions)
    out: Path | None = None
    """Folder for the files; runs/<time> unless given."""
    picture: bool = True
    """Whether to draw run.png."""

    def __call__(self) -> int:
        """Run it."""
        from teleop.scenario.lockstep_run import run_over_wire
        from teleop.scenario.mission import Mission
        from teleop.scene_clouds import load_scene_cloud, scene_cloud_path

        mission = Mission(
            scene=self.scene,
            seed=self.seed,
            pose_error=self.pose_error,
            heading_error=self.heading_error,
            slip=self.slip,
            duration=self.duration,
            options=self.options,
        )
        folder = run_folder(self.out)
        world = self.options.world(self.scene, self.seed)
        cloud = load_scene_cloud(self.scene)
        bar = _Progress()
        path = scene_cloud_path(self.scene)
        summary, record = run_over_wire(
            mission, world, cloud, path, folder, cache=_cache(), progress=bar
        )
        if self.picture and record.ticks:
            from teleop.scenario.run_picture import draw

            bar(1.0, "drawing")
            title = f"farsteer sim --scene {self.scene} --seed {self.seed}: {record.ending}"
            draw(record, cloud, folder / "run.png", title=title)
        bar.end()
        _say(_table(summary), f"\nfiles in {folder}/")
        return 130 if record.ending == "interrupted" else int(not summary.passed)


@dataclass(frozen=True)
class Evaluate:
    """Print a run's report again, computed from its files."""

    run: Annotated[Path, tyro.conf.Positional]
    """Folder of a run, such as runs/2026-01-31T12-00-00."""

    def __call__(self) -> int:
        """Run it."""
        from teleop.scenario.run_report import read_summary

        summary = read_summary(self.run)
        _say(_table(summary))
        return int(not summary.passed)


@dataclass(frozen=True)
class Serve:
    """Serve a robot in real time until Ctrl-C; any rosbridge client can drive it.

    It listens on this machine only, unless --host says otherwise.
    """

    scene: str = "office"
    """Where the robot is."""
    host: str = "127.0.0.1"
    """Address to listen on."""
    port: int = 9090
    """Port to listen on; 0 takes a free one."""
    seed: int = 0
    """Of the sensor noise."""
    lost: bool = False
    """Start without knowing where; the robot then waits for a hint on /initialpose."""
    record: Path | None = None
    """Write all sensor readings to this file (MCAP)."""
    lockstep: bool = False
    """Let time stand still until a client advances it by the service /sim/step."""
    options: tyro.conf.OmitArgPrefixes[RobotOptions] = field(default_factory=RobotOptions)
    messages: Annotated[tuple[Path, ...], tyro.conf.arg(metavar="FOLDER ...")] = ()
    """Folders with your own .msg, .srv and .action files, each named like its package."""
    ros1: bool = False
    """Name types as ROS 1 does, for clients that know no other."""
    tokens: Path | None = None
    """File of those who may connect and what each may do; everybody everything unless given."""
    origins: Annotated[tuple[str, ...], tyro.conf.arg(metavar="ORIGIN ...")] = ()
    """Web pages that may connect, besides those of this machine, such as https://lab.example."""
    tls_cert: Path | None = None
    """Encrypt, with this certificate (PEM)."""
    tls_key: Path | None = None
    """The certificate's private key (PEM)."""
    audit: Path | None = None
    """Add lines to this file that say who did what."""

    def __call__(self) -> int:
        """Run it."""
        import asyncio

        from teleop.robot.serve import ServeConfig, greeting, serve
        from teleop.scene_clouds import load_scene_cloud, scene_cloud_path

        world, cloud = self.options.world(self.scene, self.seed), load_scene_cloud(self.scene)
        config = ServeConfig(
            host=self.host,
            port=self.port,
            seed=self.seed,
            placed=not self.lost,
            record=self.record,
            lockstep=self.lockstep,
            options=self.options,
            messages=self.messages,
            ros1=self.ros1,
            tokens=self.tokens,
            origins=self.origins,
            tls_cert=self.tls_cert,
            tls_key=self.tls_key,
            audit=self.audit,
        )
        path = scene_cloud_path(self.scene)
        factor = asyncio.run(
            serve(
                world,
                cloud,
                config,
                cache=_cache(),
                map_file=path,
                ready=lambda server: _say(greeting(server, world, cloud, path)),
            )
        )
        _say("\nended" if self.lockstep else f"\nended; kept {factor:.2f} of real time")
        return 0


@dataclass(frozen=True)
class Operate:
    """Operate a robot: rerun shows the live cloud over the map, the keyboard drives.

    Reconnects by itself. Without a screen, --record writes what would be shown to a file.
    """

    url: Annotated[str, tyro.conf.Positional] = "ws://127.0.0.1:9090"
    """Where the robot is served."""
    map: Path | None = None
    """This side's copy of the robot's map (PLY); the office's unless given."""
    record: Path | None = None
    """Record the display to this file (.rrd)."""
    viewer: bool = True
    """Whether to open rerun's viewer; needs a screen."""
    hint: tuple[float, float, float] | None = None
    """Tell the robot that it is at x, y [m], heading [degrees]."""
    duration: float | None = None
    """End after so many seconds."""
    token: Path | None = None
    """File with the token to bring, on a line of its own."""
    ca: Path | None = None
    """Certificate to trust at a wss:// address, if it is not one that this machine trusts (PEM)."""

    def __call__(self) -> int:
        """Run it."""
        import asyncio

        from teleop.operator.operate import OperateConfig, run_operator

        if self.map is None:
            from teleop.scene_clouds import scene_cloud_path

            path = scene_cloud_path("office")
        else:
            path = self.map
        config = OperateConfig(
            url=self.url,
            map=path,
            record=self.record,
            viewer=self.viewer,
            hint=self.hint,
            duration=self.duration,
            token=self.token,
            ca=self.ca,
        )
        asyncio.run(run_operator(config, say=lambda line: _say(f"\r{line}\r")))
        return 0


@dataclass(frozen=True)
class Validate:
    """Measure how the robot turns, rolls, holds and answers, against published figures and theory.

    Prints each quantity with its target, its tolerance and the target's source. No scene, no seed:
    the same figures each time.
    """

    write: Path | None = None
    """Renew the tables of this page, which is docs/robot.md."""
    picture: Path | None = None
    """Draw how it turns in curves into this file (PNG)."""

    def __call__(self) -> int:
        """Run it."""
        from robot_sim.validation import validate
        from robot_sim.validation.report import plain, verdict, write_report

        bar = _Progress()
        rows = validate(bar)
        bar.end()
        _say(plain(rows), "", verdict(rows))
        if self.write is not None:
            write_report(self.write, rows)
            _say(f"tables written to {self.write}")
        if self.picture is not None:
            from benchmarks.figures.turning_figure import draw_turning

            draw_turning(self.picture)
            _say(f"picture written to {self.picture}")
        return int(not all(row.passed for row in rows))


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


def main(arguments: list[str] | None = None) -> int:
    """Parse the command line, run it and return the exit status."""
    command: Callable[[], int] = tyro.cli(
        Command,
        prog="farsteer",
        description=_EXAMPLES,
        args=arguments,
    )
    try:
        return command()
    except KeyboardInterrupt:
        sys.stderr.write("\nfarsteer: interrupted\n")
        return 130
    except BrokenPipeError:
        return 0
    except _known_errors() as error:
        sys.stderr.write(f"\nfarsteer: {error}\n")
        return 2


def _known_errors() -> tuple[type[Exception], ...]:
    """What the user can put right; anything else is a defect and deserves its traceback."""
    families = (
        ("robot_sim.errors", "SimulationError"),
        ("teleop.rosbridge.errors", "RosbridgeError"),
        ("localization.display.rerun_sink", "SinkError"),
        ("teleop.world_building.survey_drive", "SurveyError"),
    )
    # A family whose module was never imported cannot have been raised.
    loaded = [getattr(sys.modules[m], name) for m, name in families if m in sys.modules]
    return (ValueError, OSError, ImportError, *loaded)


def _table(summary: object) -> str:
    from teleop.scenario.run_report import RunSummary, summary_table

    assert isinstance(summary, RunSummary)
    return summary_table(summary)


def _cache() -> Path:
    from localization.maps.prepared_map import default_cache

    return default_cache()


if __name__ == "__main__":
    sys.exit(main())
