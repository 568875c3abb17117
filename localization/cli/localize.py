"""``farsteer localize``: trajectory, covariances and a report from a log of readings and a map."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from localization.cli.run_folder import check_folder, remove_earlier, run_folder, writing_to
from localization.cli.sensor_layout import MotionName, MountOptions, TopicOptions, layout_of
from localization.cli.terminal import Progress, fitted, remark, say, say_json
from localization.extras import has, missing

if TYPE_CHECKING:
    from collections.abc import Callable

    from localization.evaluation.localization_history import History
    from localization.evaluation.trajectory import Trajectory
    from localization.logs.frame_tree import SensorLayout
    from localization.motion.sensor_configuration import SensorConfiguration
    from localization.pipeline.dead_reckoning_run import DeadReckoningRun
    from localization.pipeline.log_replay import LogRun
    from localization.report.reference_comparison import ReferenceComparison
    from localization.report.report_summary import Report
    from localization.report.rerun_recording import LogRecording
    from localization.types import Pose

_PROGRESS_PERIOD = 2.0
"""Time in the log between two lines of progress [s]."""


@dataclass(frozen=True)
class Localize:
    """Localise a log of readings in a map; for a run's own log the estimate is reproduced bit for bit.

    The log is one of ours (.mcap), a ROS 1 or ROS 2 bag (LaserScan, PointCloud2, Imu, JointState, Odometry,
    /initialpose, /tf_static) or a CARMEN text, compressed or not; the content decides, not the name. The
    motion comes from wheels and gyro if the log has both, otherwise from its odometry, otherwise from the
    sensors there are. The initial pose in a foreign log is searched for in the whole map and accepted once
    the robot has moved; --start gives it at once.

    A log without a scanner, or any log without --map, is dead-reckoned: the wheels' displacement, turned by the
    inertial unit's orientation or gyro if there is one. The path then begins at the origin with the heading that the
    inertial unit reports, or at --start.

    Writes into one folder:
      estimate.tum     trajectory: t x y z qx qy qz qw, for evo and other tools
      covariance.csv   upper triangle of the 6x6 covariance of each of these poses
      health.csv       for each sweep: state, inlier ratio, unexplained share, NIS, observable axes, reasons
      config.json      the input, and all settings as used; --settings reads it again
      report.html      figures and statistics on one page
      recording.rrd    map, sweeps, path, health and hypotheses, for `rerun recording.rrd`

    The recording needs the extra `operator`; without it the other files are still written.

    For example:
      farsteer localize runs/first/readings.mcap --map scenes/office/cloud.ply --truth runs/first/truth.tum
                                          our own log; errors with respect to the truth
      farsteer localize office.bag --map office.ply --start 3 2 90
                                          a ROS bag that begins near x 3 m, y 2 m, heading 90 degrees
      farsteer localize bag/ --map hall.pcd --mount laser 0.2 0 0.3 0 --topics /scan /odom
                                          a bag without /tf_static, a map without normals
      farsteer localize intel.log.gz --map map.yaml
                                          a CARMEN text in an occupancy grid; the initial pose is found
      farsteer localize office.bag --map map.yaml --set registration.normal_noise=0.1 --set matcher=kiss
                                          other settings; `docs/settings.md` lists them
      farsteer localize jackal.bag
                                          a log without scanner, dead-reckoned
    """

    log: Annotated[Path, tyro.conf.Positional]
    """Log of readings: a file, or a ROS 2 bag's folder."""
    map: Path | None = None
    """Map to localise in: a cloud (PLY, PCD, lines x y z; missing normals are computed) or map.yaml; without
    it the log is dead-reckoned."""
    out: Path | None = None
    """Folder for the files; by default runs/<time>."""
    start: tuple[float, float, float] | None = None
    """Approximate pose at the beginning of the log: x, y [m], heading [degrees]."""
    truth: Path | None = None
    """Reference trajectory (TUM) to compare the estimate with: ATE, RPE, heading, NEES."""
    inside: tuple[float, float, float] | None = None
    """A place in the open [m], for a cloud that has neither normals nor a floor."""
    motion: MotionName | None = None
    """Source of the motion; by default the best that the log has."""
    flat: bool | None = None
    """Whether the ground is level; by default it is if all scanners are level."""
    mount: MountOptions = field(default_factory=dict)
    """Pose of a frame on base_link, where the log lacks it: NAME x y z [m] yaw
    [degrees], or NAME x y z roll pitch yaw."""
    mounts: Path | None = None
    """File of mounts by `farsteer calibrate`, which take precedence over those in the log."""
    topics: TopicOptions = ()
    """Topics of a bag to read; by default all of a known type, of one robot."""
    assignments: Annotated[
        tuple[str, ...], tyro.conf.arg(name="set", metavar="NAME=VALUE"), tyro.conf.UseAppendAction
    ] = ()
    """Another value for a setting of the localiser, such as registration.normal_noise=0.1; repeatable, and
    takes precedence over --settings."""
    settings: Path | None = None
    """File of settings: TOML, such as `registration.normal_noise = 0.1`, or the config.json of a run."""
    recording: bool = True
    """Whether to write recording.rrd: some 100 MB per kilometre."""
    report: bool = True
    """Whether to write report.html."""
    overwrite: bool = False
    """Replace the files of an earlier run in --out."""
    json: bool = False
    """Print the results as JSON."""

    def __call__(self) -> int:
        """Run it."""
        check_folder(self.out, FILES, overwrite=self.overwrite)

        from localization.evaluation.tum_file import read_tum

        truth = None if self.truth is None else read_tum(self.truth)
        run = self._run()
        folder = run_folder(self.out)
        remove_earlier(folder, FILES)
        with writing_to(folder):
            return self._localize(run, truth, folder)

    def _localize(
        self, run: LogRun | DeadReckoningRun, truth: Trajectory | None, folder: Path
    ) -> int:
        from localization.evaluation.localization_history import (
            History,
            write_covariances,
            write_health,
        )
        from localization.evaluation.tum_file import write_tum
        from localization.logs.log_interface import LogError

        self._write_config(folder / "config.json", run)
        recording = (
            _open_recording(folder / "recording.rrd", run, truth) if self.recording else None
        )
        history, bar = History(), Progress()
        stopped: KeyboardInterrupt | LogError | None = None
        try:
            _localise(run, history, bar, recording)
        except (KeyboardInterrupt, LogError) as error:
            stopped = error
            why = "interrupted" if isinstance(error, KeyboardInterrupt) else "the log is damaged"
            self._note(f"{why}: writing the estimates so far")
        finally:
            if recording is not None:
                recording.close()
        bar(1.0, "writing")
        write_tum(folder / "estimate.tum", history.trajectory())
        write_covariances(folder / "covariance.csv", history)
        write_health(folder / "health.csv", history.sweeps)
        comparison = _compare(history, truth, self._note, flat=run.config.sensors.flat)
        report = self._report(run, history, comparison)
        if self.report:
            _write_report(folder / "report.html", report)
        bar.end()
        self._print(report, folder)
        if isinstance(stopped, LogError):
            raise stopped
        if stopped is not None:
            return 130
        return int(not len(history.trajectory()))

    def _run(self) -> LogRun | DeadReckoningRun:
        from localization.calibration.mount_file import read_mounts
        from localization.maps.prepared_map import default_cache
        from localization.pipeline.log_replay import open_run

        layout = layout_of(self.mount, self.topics)
        return open_run(
            self.log,
            self.map,
            sensors=self._sensors(layout),
            start=_pose(self.start[0], self.start[1], 0.0, self.start[2]) if self.start else None,
            layout=layout,
            inside=self.inside,
            mounts=None if self.mounts is None else read_mounts(self.mounts),
            settings=self._settings(),
            cache=default_cache(),
        )

    def _settings(self) -> dict[str, object]:
        """Return the settings of the file, and over them those of the command line."""
        from localization.settings import assignments, read_settings

        kept = {} if self.settings is None else read_settings(self.settings)
        return kept | assignments(self.assignments)

    def _write_config(self, path: Path, run: LogRun | DeadReckoningRun) -> None:
        from localization.config import to_json

        values = {
            "log": str(self.log),
            "map": None if self.map is None else str(self.map),
            "start": self.start,
            "changed": self._settings(),
            "localizer": to_json(run.config),
        }
        path.write_text(json.dumps(values, indent=2) + "\n", encoding="utf-8")

    def _sensors(self, layout: SensorLayout) -> SensorConfiguration | None:
        """Return the sensors that the options ask for; None for the log's own."""
        from localization.logs.open_log import open_log
        from localization.motion.sensor_configuration import Motion, SensorConfiguration

        if self.motion is None and self.flat is None:
            return None
        own = open_log(self.log, layout).sensors
        motion = own.motion if self.motion is None else Motion(self.motion)
        return SensorConfiguration(motion, own.flat if self.flat is None else self.flat)

    def _report(
        self,
        run: LogRun | DeadReckoningRun,
        history: History,
        comparison: ReferenceComparison | None,
    ) -> Report:
        from localization.pipeline.dead_reckoning_run import DeadReckoningRun
        from localization.report.report_summary import Report

        facts = {"log": f"{self.log}"}
        if self.map is not None and run.cloud is not None:
            low, high = run.cloud.bounds
            size = " x ".join(f"{s:.1f}" for s in high - low)
            facts["map"] = f"{self.map}: {len(run.cloud.points)} points, {size} m"
        if isinstance(run, DeadReckoningRun):
            facts["motion from"] = run.motion
            facts["frame"] = (
                "odom, which begins where the log does, with the heading that the inertial unit reports, if any"
                if self.start is None
                else "that of --start"
            )
        else:
            sensors = run.config.sensors
            ground = "level ground" if sensors.flat else "uneven ground"
            facts["motion from"] = f"{sensors.motion}, on {ground}"
            facts["scanners"] = "; ".join(f"{n} at {_where(m)}" for n, m in run.mounts.items())
        if changed := self._settings():
            facts["settings"] = ", ".join(f"{name} = {value}" for name, value in changed.items())
        return Report(
            self.log.name,
            "" if self.map is None else self.map.name,
            run.cloud,
            history,
            facts,
            run.verdicts,
            run.notes,
            comparison,
            run.why if isinstance(run, DeadReckoningRun) else "",
        )

    def _note(self, *lines: str) -> None:
        """Print lines that are not of the result, apart from it if it is JSON."""
        (remark if self.json else say)(*lines)

    def _print(self, report: Report, folder: Path) -> None:
        from localization.report.report_summary import lines

        files = sorted(path.name for path in folder.iterdir() if path.name in FILES)
        if self.json:
            from localization.cli.localize_json import results

            say_json({**results(report), "folder": folder, "files": files})
        else:
            hints = (f"hint {v.verdict.value}: {v.reason}" for v in report.verdicts)
            say(*fitted(*hints, *report.notes, *lines(report)), "")
            say(*fitted(f"in {folder}/:  {' '.join(files)}"))
        if self.recording and not has("rerun"):
            self._note(f"no recording.rrd: {missing('rerun')}")


FILES = (
    "config.json",
    "covariance.csv",
    "estimate.tum",
    "health.csv",
    "recording.rrd",
    "report.html",
)
"""Names of the files that the command may write."""


def _localise(
    run: LogRun | DeadReckoningRun,
    history: History,
    bar: Progress,
    recording: LogRecording | None,
) -> None:
    from localization.types import SECOND

    shown = 0.0
    for estimate in run:
        history.add(estimate)
        if recording is not None:
            recording.show(estimate)
        since = (estimate.stamp - int(history.begin)) / SECOND
        if since >= shown + _PROGRESS_PERIOD:
            shown = since
            bar(run.log.share, f"{since:.0f} s of the log, {estimate.health}")


def _open_recording(
    path: Path, run: LogRun | DeadReckoningRun, truth: Trajectory | None
) -> LogRecording | None:
    """Return a recording, or None if rerun is not installed."""
    if not has("rerun"):
        return None
    from localization.report.rerun_recording import LogRecording

    return LogRecording(path, run.cloud, run.mounts, truth)


def _compare(
    history: History, truth: Trajectory | None, note: Callable[..., None], *, flat: bool
) -> ReferenceComparison | None:
    """Return the comparison with the truth; None, after printing the reason, if they cannot be compared."""
    from localization.evaluation.error_statistics import EvaluationError
    from localization.report.reference_comparison import ReferenceComparison

    if truth is None:
        return None
    try:
        return ReferenceComparison.of(history, truth, flat=flat)
    except EvaluationError as error:
        note(f"not compared with the reference: {error}")
        return None


def _write_report(path: Path, report: Report) -> None:
    from localization.report.html_page import page

    path.write_text(page(report), encoding="utf-8")


def _where(mount: Pose) -> str:
    x, y, z = mount.position
    roll, pitch, yaw = (math.degrees(a) for a in mount.euler)
    return f"{x:.3f} {y:.3f} {z:.3f} m, {roll:.1f} {pitch:.1f} {yaw:.1f}°"


def _pose(x: float, y: float, z: float, degrees: float) -> Pose:
    from localization.types import Pose

    return Pose.from_euler((x, y, z), yaw=math.radians(degrees))
