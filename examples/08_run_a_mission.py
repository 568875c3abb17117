"""A scripted mission with limits, judged: the same seed gives the same bits, so it serves as a regression test.

Exit status 0 means that all limits were met, 1 that one was missed.
"""

import argparse
from pathlib import Path

from teleop.scenario.files.faults import WheelSlip
from teleop.scenario.files.limits import Limits
from teleop.scenario.files.scenario import Mission, Scenario, Start, WorldSettings
from teleop.scenario.tour.drive import drive_tour


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scene", default="office")
    parser.add_argument("--seconds", type=float, default=20.0, help="robot time")
    parser.add_argument("--out", type=Path, default=Path("runs/mission"))
    arguments = parser.parse_args()

    scenario = Scenario(
        format=1,
        name="mission",
        seed=3,
        world=WorldSettings(scene=arguments.scene),
        start=Start(known="about", off=0.5, turned=20.0),  # so wrong is the first pose [m, degrees]
        mission=Mission(tour=True, time_limit=arguments.seconds),
        fault=(WheelSlip("wheel_slip", at=8.0),),
        limits=Limits(goals=False, position_rmse=0.02, position_max=0.10, distance=5.0),
    )
    driven = drive_tour(scenario, arguments.out)
    for check in driven.summary.checks:
        print(
            "met   " if check.met else "MISSED",
            check.text,
            f"{check.value:.4g}, limit {check.limit}",
        )
    print("files in", arguments.out)
    return int(not driven.summary.passed)


if __name__ == "__main__":
    raise SystemExit(main())
