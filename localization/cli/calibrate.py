"""``farsteer calibrate``: scanner mounts from a log of a drive through a mapped place."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from localization.cli.run_folder import check_file
from localization.cli.terminal import Progress, say


@dataclass(frozen=True)
class Calibrate:
    """Estimate the scanners' mounts from a log of a drive in a known map.

    Mounts and the robot's poses are estimated together, so that all scanners' points lie on the map, the
    robot moves straight ahead while its wheels roll, and stands on its ground. Unobservable axes are
    reported; they keep their values, on average over the scanners. Drive half a minute or more, with turns,
    past walls of several directions.
    """

    log: Annotated[Path, tyro.conf.Positional]
    """Log of readings: ours (.mcap), a ROS bag, a CARMEN text."""
    map: Path
    """Map of the place: a cloud or a ROS occupancy grid (map.yaml)."""
    out: Path | None = None
    """File to write the mounts to, for `farsteer localize --mounts`; by default mounts.toml beside the
    log."""
    mounts: Path | None = None
    """Initial mounts (a file like the one written), which take precedence over those in the log."""
    start: tuple[float, float, float] | None = None
    """Approximate pose at the beginning of the log: x, y [m], heading [degrees]."""
    overwrite: bool = False
    """Replace the file of an earlier calibration."""

    def __call__(self) -> int:
        """Run it."""
        beside = self.log if self.log.is_dir() else self.log.parent
        out = self.out if self.out is not None else beside / "mounts.toml"
        if self.log.exists():
            check_file(out, overwrite=self.overwrite)

        from localization.calibration.calibration_summary import summary
        from localization.calibration.extrinsic_calibration import calibrate
        from localization.calibration.mount_file import read_mounts, write_mounts
        from localization.logs.log_interface import require_scanner
        from localization.logs.open_log import open_log
        from localization.types import Pose

        log, bar = open_log(self.log), Progress()
        require_scanner(log)
        begin = {**log.mounts, **(read_mounts(self.mounts) if self.mounts is not None else {})}
        start = None
        if self.start is not None:
            start = Pose.planar(self.start[0], self.start[1], math.radians(self.start[2]))
        found = calibrate(log, self.map, begin, start=start, progress=bar)
        bar.end()
        lines = summary(found)
        say(*lines)
        write_mounts(out, found.base_from_scanner, comment="\n".join(lines))
        say("", f"{out}: for `farsteer localize {self.log} --map {self.map} --mounts {out}`")
        return 0
