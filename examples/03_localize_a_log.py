"""Localise a recorded log in a prebuilt map, and compare the estimate with a reference if there is one.

Any log will do that `farsteer localize` reads: ROS 1 and ROS 2 bags, CARMEN texts, MCAP. One to try it with:
`make sim ARGS="--out runs/first"` leaves runs/first/readings.mcap and runs/first/truth.tum.
"""

import argparse
from pathlib import Path

from localization import localize
from localization.evaluation.trajectory import Trajectory
from localization.evaluation.trajectory_errors import ate
from localization.evaluation.tum_file import read_tum, write_tum


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("log", type=Path)
    parser.add_argument(
        "map", type=Path, help="a cloud (.ply, .pcd) or an occupancy grid (map.yaml)"
    )
    parser.add_argument("--reference", type=Path, help="true poses, as a TUM file")
    parser.add_argument("--out", type=Path, help="where to write the estimate, as a TUM file")
    arguments = parser.parse_args()

    done = localize(arguments.log, arguments.map)
    for note in done.notes:
        print("note:", note)
    trajectory = Trajectory.from_estimates(done.estimates)
    last = done.estimates[-1]
    print(f"{len(trajectory)} poses; at the end the estimate is {last.health}")
    print(f"3 sigma of x at the end: {3e3 * last.covariance[0, 0] ** 0.5:.1f} mm")
    if arguments.reference is not None:
        error = ate(trajectory, read_tum(arguments.reference))
        print(f"position error, rmse: {1e3 * error.position.rmse:.1f} mm")
    if arguments.out is not None:
        write_tum(arguments.out, trajectory)
        print("written:", arguments.out)


if __name__ == "__main__":
    main()
