"""A scripted mission with limits, judged: the same seed gives the same bits, so it serves as a regression test.

Exit status 0 means that all limits were met, 1 that one was missed.
"""

import argparse
from pathlib import Path

from robot_sim import load_world
from teleop.scenario.mission import Mission, MissionLimits
from teleop.scenario.mission_run import run_in_process
from teleop.scene_clouds import load_scene_cloud


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scene", default="office")
    parser.add_argument("--seconds", type=float, default=20.0, help="robot time")
    parser.add_argument("--out", type=Path, default=Path("runs/mission"))
    arguments = parser.parse_args()

    mission = Mission(
        scene=arguments.scene,
        seed=3,
        pose_error=0.5,  # the operator's hint is wrong by this much [m]
        slip=(8.0,),  # the wheels spin after so many seconds
        duration=arguments.seconds,
        limits=MissionLimits(position_rmse=0.02, position_max=0.10, distance=5.0),
    )
    world, cloud = load_world(mission.scene), load_scene_cloud(mission.scene)
    summary, _ = run_in_process(mission, world, cloud, arguments.out)
    for check in summary.checks:
        print(
            "met   " if check.met else "MISSED", check.name, f"{check.value:.4g} of {check.limit}"
        )
    print("files in", arguments.out)
    return int(not summary.passed)


if __name__ == "__main__":
    raise SystemExit(main())
