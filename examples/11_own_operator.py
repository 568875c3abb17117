"""An operator of your own in a scenario: it sees and sends only what goes over the wire, and drives by sight.

It keeps the stick forward and turns to the side where the scanner sees more room. The scenario's referee says what
came of it.
"""

import argparse
from typing import Any

from teleop.scenario.files.limits import Limits
from teleop.scenario.files.scenario import Mission, Scenario, WorldSettings
from teleop.scenario.operators.operator import Briefing, Operator
from teleop.scenario.operators.wire import Wire
from teleop.scenario.session.run import run_scenario


class BySight(Operator):
    """Drives where there is room."""

    def begin(self, wire: Wire, briefing: Briefing) -> None:
        """Subscribe to what is seen, and to whether the robot listens."""
        self.ranges: list[float] = []
        self.armed = False
        wire.subscribe("/scan", "sensor_msgs/LaserScan", self.on_scan)
        wire.subscribe("/teleop/state", "farsteer_msgs/TeleopState", self.on_state)

    def on_scan(self, message: dict[str, Any]) -> None:
        """Remember the newest scan."""
        self.ranges = [min(r, 5.0) for r in message["ranges"]]  # from right to left

    def on_state(self, message: dict[str, Any]) -> None:
        """Remember whether the robot is armed."""
        self.armed = message["armed"]

    def act(self, wire: Wire, now: int) -> None:
        """Send a stick's position ten times a second."""
        if now % 100_000_000 or not self.ranges:
            return
        forward = turn = 0.0  # a neutral stick arms the robot
        if self.armed:
            count = len(self.ranges)
            right, left = sum(self.ranges[: count // 2]), sum(self.ranges[count // 2 :])
            near = min(self.ranges[2 * count // 5 : 3 * count // 5])
            forward, turn = (0.8, (left - right) / (left + right)) if near > 0.9 else (0.0, 0.5)
        wire.publish(
            "/joy",
            "sensor_msgs/Joy",
            {"header": {"stamp": wire.stamp}, "axes": [turn, forward], "buttons": [0, 0, 0, 0, 1]},
        )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scene", default="office")
    parser.add_argument("--seconds", type=float, default=20.0, help="robot time")
    arguments = parser.parse_args()

    scenario = Scenario(
        format=1,
        name="by-sight",
        world=WorldSettings(scene=arguments.scene),
        mission=Mission(time_limit=arguments.seconds),
        limits=Limits(contacts=0, distance=0.2 * arguments.seconds),
    )
    outcome = run_scenario(scenario, operator=BySight())
    print(f"{outcome.ending}, at {outcome.factor:.1f} times real time")
    for check in outcome.checks:
        print("met   " if check.met else "MISSED", f"{check.text}: {check.value:.4g} {check.limit}")
    return int(outcome.status)


if __name__ == "__main__":
    raise SystemExit(main())
