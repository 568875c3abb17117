"""A map from readings alone: SLAM over a log, and the point cloud that the localiser can use afterwards.

Needs Open3D (`make map` installs it) and a log of a drive that comes back to where it has been.
"""

import argparse
from pathlib import Path

from localization import save_cloud
from localization.logs.open_log import open_log
from localization.mapping.slam import map_drive
from localization.mapping.slam_config import SlamConfig


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("log", type=Path)
    parser.add_argument("out", type=Path, help="the cloud to write (.ply)")
    arguments = parser.parse_args()

    log = open_log(arguments.log)
    survey = map_drive(log, log.mounts, SlamConfig.of(log.sensors))
    print(f"{len(survey.trajectory)} sweeps", *survey.accuracy.lines(), sep="\n")
    cloud = save_cloud(survey.cloud(arguments.out.stem), arguments.out)
    print(f"written: {arguments.out}, {len(cloud.points)} points")


if __name__ == "__main__":
    main()
