"""Map of a log: the part of ``farsteer map`` that needs neither a scene nor a simulator."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from localization.cli.run_folder import check_file, check_folder, run_folder, writing_to
from localization.cli.sensor_layout import MotionName, MountOptions, TopicOptions, layout_of
from localization.cli.terminal import Progress, say
from localization.extras import require

if TYPE_CHECKING:
    from collections.abc import Callable

    from localization.logs.log_interface import ReadingsLog
    from localization.mapping.cloud_builder import MappingConfig
    from localization.mapping.slam import Survey
    from localization.maps.cloud import Cloud
    from localization.types import Pose


@dataclass(frozen=True)
class LogMapping:
    """Options for mapping a log without known poses."""

    start: tuple[float, float, float] | None = None
    """Pose at which the log begins: x, y [m], heading [degrees]; the map's origin by default."""
    uneven: bool = False
    """Follow the ground's height and slope; by default the ground is taken to be level."""
    motion: MotionName | None = None
    """Source of the motion in a log; by default the best that the log has."""
    mount: MountOptions = field(default_factory=dict)
    """Pose of a log's frame on base_link, where the log lacks it: NAME x y z [m] yaw
    [degrees], or NAME x y z roll pitch yaw."""
    topics: TopicOptions = ()
    """Topics of a bag to read; by default all of a known type."""
    overwrite: bool = False
    """Replace the file that --out names."""

    def map_log(self, path: Path, out: Path | None) -> int:
        """Build the cloud of a log, and write it and the drive; return the exit status."""
        self.check(out)
        from localization.logs.log_interface import require_scanner
        from localization.logs.open_log import open_log
        from localization.types import Pose

        log = open_log(path, layout_of(self.mount, self.topics))
        require_scanner(log)
        bar = Progress()
        start = None
        if self.start is not None:
            x, y, degrees = self.start
            start = Pose.planar(x, y, math.radians(degrees))
        warnings: list[str] = []
        survey, cloud = self.survey(log, start, path.stem, bar, warn=warnings.append)
        bar.end()
        target = map_file(out)
        with writing_to(target.parent):
            save_map(cloud, target)
            save_drive(survey, target)
        say(*log.warnings)
        if survey.rejected_readings:
            say(f"{survey.rejected_readings} readings were invalid and left out")
        say(*survey.accuracy.lines(), *warnings)
        return 0

    def check(self, out: Path | None) -> None:
        """Check before any work that a cloud can be built, and written to a file or a new folder.

        Raises:
            MissingLibraryError: If Open3D is not installed.
            OutputError: If the file exists or cannot be written.
        """
        require("open3d", "building a map")
        if out is None:
            check_folder(None, ())
        else:
            check_file(out, overwrite=self.overwrite)

    def survey(
        self,
        log: ReadingsLog,
        start: Pose | None,
        name: str,
        bar: Progress,
        mapping: MappingConfig | None = None,
        warn: Callable[[str], None] = lambda line: None,
    ) -> tuple[Survey, Cloud]:
        """Return the poses of a log's sweeps and the cloud that they make.

        Args:
            log: Readings of the drive.
            start: ``map_from_base`` at its beginning.
            name: Name of the cloud.
            bar: Shows the progress.
            mapping: How points become a cloud.
            warn: Called with one line for each remark about the log, and if the map lacks one face of a wall.
        """
        from localization.logs.continuity import WatchedLog
        from localization.mapping.cloud_builder import MappingConfig
        from localization.mapping.slam import map_drive
        from localization.mapping.slam_config import SlamConfig
        from localization.motion.sensor_configuration import Motion, SensorConfiguration

        motion = log.sensors.motion if self.motion is None else Motion(self.motion)
        config = SlamConfig.of(SensorConfiguration(motion, log.sensors.flat), level=not self.uneven)
        readings = WatchedLog(log)
        survey = map_drive(readings, log.mounts, config, start=start, progress=bar)
        for note in readings.notes:
            warn(note)
        bar(0.9, f"fusing {len(survey.steps)} sweeps")
        return survey, survey.cloud(name, mapping or MappingConfig(), warn)


def map_file(out: Path | None) -> Path:
    """Return the file for a map: the named one, or ``map.ply`` in a folder of its own under ``runs``."""
    return out if out is not None else run_folder(None) / "map.ply"


def save_map(cloud: Cloud, path: Path) -> None:
    """Write a cloud and print its size and hash."""
    from localization.maps.map_files import save_cloud

    path.parent.mkdir(parents=True, exist_ok=True)
    saved = save_cloud(cloud, path)
    say(f"{len(saved.points)} points, {path.stat().st_size / 1e6:.2f} MB in {path}")
    say(f"sha256 {saved.sha256}")


def save_drive(survey: Survey, path: Path) -> None:
    """Write the trajectory of a survey beside its map, as a TUM file of the same name."""
    from localization.evaluation.tum_file import write_tum

    write_tum(path.with_suffix(".tum"), survey.trajectory)
