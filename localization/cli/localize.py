"""``farsteer localize``: a log of readings and a map in; where the robot was, how surely, and a report out."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from localization.cli.run_folder import run_folder
from localization.cli.terminal import Progress, say

if TYPE_CHECKING:
    from localization.evaluation.localization_history import History
    from localization.evaluation.trajectory import Trajectory
    from localization.logs.frame_tree import SensorLayout
    from localization.motion.sensor_configuration import SensorConfiguration
    from localization.pipeline.log_replay import LogRun
    from localization.report.html_page import Review
    from localization.report.reference_comparison import Judgement
    from localization.report.rerun_recording import LogRecording
    from localization.types import Pose

_TOLD = 2.0
"""Between two lines of progress, of the log's time [s]."""


@dataclass(frozen=True)
class Localize:
    """Localise a log of readings in a map; of a run's own log it reproduces the estimate bit for bit.

    The log: ours (.mcap), a ROS 1 or ROS 2 bag (LaserScan, PointCloud2, Imu, JointState, Odometry,
    /initialpose, /tf_static) or a CARMEN text, compressed or not; what is in the file decides. What moves
    the robot is taken from wheels and gyro if the log has both, else from its odometry, else from what
    there is. Where a foreign log begins is looked for in the whole map and believed once the robot has
    moved; --start says it at once.

    Writes into one folder:
      estimate.tum     where the robot was: t x y z qx qy qz qw, for evo and other tools
      covariance.csv   of each of these poses, the upper triangle of the 6x6 covariance
      health.csv       of each sweep: state, fit, unexplained share, NIS, held directions, reasons
      report.html      all of it as figures and pictures, on one page
      recording.rrd    to look at with `rerun recording.rrd`: map, sweeps, path, health, hypotheses

    The pictures want `pip install 'farsteer[report]'`, the recording 'farsteer[operator]'; without
    them the rest is written all the same.

    For example:
      farsteer localize runs/first/readings.mcap --map scenes/office/cloud.ply --truth runs/first/truth.tum
                                          our own log; errors against the truth
      farsteer localize office.bag --map office.ply --start 3 2 90
                                          a ROS bag, begun near x 3 m, y 2 m, facing 90 degrees
      farsteer localize bag/ --map hall.pcd --mount laser 0.2 0 0.3 0 --topics /scan /odom
                                          a bag without /tf_static, a map without normals
      farsteer localize intel.log.gz --map map.yaml
                                          a CARMEN text in an occupancy grid; where it begins is found
    """

    log: Annotated[Path, tyro.conf.Positional]
    """Log of readings: a file, or a ROS 2 bag's folder."""
    map: Path
    """Map to localise in: a cloud (PLY, PCD, lines x y z; normals are made if it has none) or map.yaml."""
    out: Path | None = None
    """Folder for the files; runs/<time> unless given."""
    start: tuple[float, float, float] | None = None
    """About where the log begins: x, y [m], heading [degrees]."""
    truth: Path | None = None
    """A reference trajectory (TUM) to hold the estimate against: ATE, RPE, heading, NEES."""
    inside: tuple[float, float, float] | None = None
    """A place in the open [m], for a cloud that has neither normals nor a floor."""
    motion: Literal["wheels-and-gyro", "wheels", "gyro", "odometry", "scanner"] | None = None
    """What to take the motion from, if not from what the log has."""
    flat: bool | None = None
    """Whether the ground is level; taken to be if all scanners are, unless given."""
    mount: dict[str, tuple[float, float, float, float]] = field(default_factory=dict)
    """Where a frame sits on base_link, if a bag does not say: NAME x y z [m] yaw [degrees]."""
    mounts: Path | None = None
    """Where the scanners sit, before what the log says: a file that `farsteer calibrate` wrote."""
    topics: tuple[str, ...] = ()
    """Topics of a bag to read; all that are understood unless given."""
    recording: bool = True
    """Whether to write recording.rrd: some 100 MB for each kilometre."""
    report: bool = True
    """Whether to write report.html."""

    def __call__(self) -> int:
        """Run it."""
        from localization.evaluation.localization_history import (
            History,
            write_covariances,
            write_health,
        )
        from localization.evaluation.trajectory import read_tum, write_tum

        truth = None if self.truth is None else read_tum(self.truth)
        run = self._run()
        folder = run_folder(self.out)
        folder.mkdir(parents=True, exist_ok=True)
        recording = _recording(folder / "recording.rrd", run, truth) if self.recording else None
        history, bar, ended = History(), Progress(), False
        try:
            _localise(run, history, bar, recording)
            ended = True
        except KeyboardInterrupt:
            say("interrupted: what was localised so far is written")
        finally:
            if recording is not None:
                recording.close()
        bar(1.0, "writing")
        write_tum(folder / "estimate.tum", history.trajectory())
        write_covariances(folder / "covariance.csv", history)
        write_health(folder / "health.csv", history.sweeps)
        judgement = _judgement(history, truth, flat=run.localizer.config.sensors.flat)
        review = self._review(run, history, judgement)
        if self.report:
            _write_report(folder / "report.html", review)
        bar.end()
        self._tell(review, folder)
        if not ended:
            return 130
        return int(not len(history.trajectory()))

    def _run(self) -> LogRun:
        from localization.calibration.mount_file import read_mounts
        from localization.cli.sensor_layout import layout_of
        from localization.maps.prepared_map import default_cache
        from localization.pipeline.log_replay import LogRun

        layout = layout_of(self.mount, self.topics)
        return LogRun(
            self.log,
            self.map,
            sensors=self._suite(layout),
            start=_pose(self.start[0], self.start[1], 0.0, self.start[2]) if self.start else None,
            layout=layout,
            inside=self.inside,
            mounts=None if self.mounts is None else read_mounts(self.mounts),
            cache=default_cache(),
        )

    def _suite(self, layout: SensorLayout) -> SensorConfiguration | None:
        """The suite that was asked for; None if it is the log's own."""
        from localization.logs.open_log import open_log
        from localization.motion.sensor_configuration import Motion, SensorConfiguration

        if self.motion is None and self.flat is None:
            return None
        own = open_log(self.log, layout).sensors
        motion = own.motion if self.motion is None else Motion(self.motion)
        return SensorConfiguration(motion, own.flat if self.flat is None else self.flat)

    def _review(self, run: LogRun, history: History, judgement: Judgement | None) -> Review:
        from localization.report.html_page import Review

        suite = run.localizer.config.sensors
        ground = "level ground" if suite.flat else "uneven ground"
        low, high = run.cloud.bounds
        size = " x ".join(f"{s:.1f}" for s in high - low)
        facts = {
            "log": f"{self.log}",
            "map": f"{self.map}: {len(run.cloud.points)} points, {size} m",
            "motion from": f"{suite.motion}, on {ground}",
            "scanners": "; ".join(f"{n} at {_where(m)}" for n, m in run.mounts.items()),
        }
        return Review(
            self.log.name,
            self.map.name,
            run.cloud,
            history,
            facts,
            run.verdicts,
            run.notes,
            judgement,
        )

    def _tell(self, review: Review, folder: Path) -> None:
        from localization.report.html_page import lines

        say(*(f"hint {v.verdict.value}: {v.reason}" for v in review.verdicts), *review.notes)
        say(*lines(review), "")
        files = sorted(path.name for path in folder.iterdir() if path.name in FILES)
        say(f"in {folder}/: {' '.join(files)}")
        if self.recording and not _has("rerun"):
            say(f"no recording.rrd, for want of rerun: {_INSTALL.format('operator')}")
        if self.report and not _has("matplotlib"):
            say(f"no pictures in report.html, for want of matplotlib: {_INSTALL.format('report')}")


FILES = ("covariance.csv", "estimate.tum", "health.csv", "recording.rrd", "report.html")
"""What it may write."""
_INSTALL = "pip install 'farsteer[{}]'"


def _localise(
    run: LogRun,
    history: History,
    bar: Progress,
    recording: LogRecording | None,
) -> None:
    from localization.types import SECOND

    told = 0.0
    for estimate in run:
        history.add(estimate)
        if recording is not None:
            recording.show(estimate)
        since = (estimate.stamp - int(history.begin)) / SECOND
        if since >= told + _TOLD:
            told = since
            bar(run.log.share, f"{since:.0f} s of the log, {estimate.health}")


def _recording(path: Path, run: LogRun, truth: Trajectory | None) -> LogRecording | None:
    """A recording, or None where rerun is not installed."""
    if not _has("rerun"):
        return None
    from localization.report.rerun_recording import LogRecording

    return LogRecording(path, run.cloud, run.mounts, truth)


def _judgement(history: History, truth: Trajectory | None, *, flat: bool) -> Judgement | None:
    """The estimate held against the truth; None, and why, if they do not meet."""
    from localization.evaluation.metrics import EvaluationError
    from localization.report.reference_comparison import Judgement

    if truth is None:
        return None
    try:
        return Judgement.of(history, truth, flat=flat)
    except EvaluationError as error:
        say(f"not held against the reference: {error}")
        return None


def _write_report(path: Path, review: Review) -> None:
    from localization.report.html_page import page

    if _has("matplotlib"):
        from localization.report.plots import plan, timeline

        pictures = {
            "plan": plan(review.history, review.cloud, review.verdicts, review.judgement),
            "timeline": timeline(review.history, review.judgement),
        }
        path.write_text(page(review, pictures), encoding="utf-8")
    else:
        missing = f"There are no pictures, for want of matplotlib: {_INSTALL.format('report')}"
        path.write_text(page(review, {}, missing), encoding="utf-8")


def _has(library: str) -> bool:
    return find_spec(library) is not None


def _where(mount: Pose) -> str:
    x, y, z = mount.position
    roll, pitch, yaw = (math.degrees(a) for a in mount.euler)
    return f"{x:.3f} {y:.3f} {z:.3f} m, {roll:.1f} {pitch:.1f} {yaw:.1f}°"


def _pose(x: float, y: float, z: float, degrees: float) -> Pose:
    from localization.types import Pose

    return Pose.from_euler((x, y, z), yaw=math.radians(degrees))
