"""Drive the robot with roslibpy, a rosbridge client that knows nothing of Farsteer.

Start a robot first (`make serve`), and install the client (`.venv/bin/pip install --constraint constraints.txt roslibpy`).
"""

import argparse
import time
from typing import Any

import roslibpy


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--host", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=9090)
    parser.add_argument("--seconds", type=float, default=3.0, help="how long to drive forward")
    arguments = parser.parse_args()

    ros = roslibpy.Ros(arguments.host, arguments.port)
    ros.run()
    positions: list[dict[str, float]] = []
    odometry = roslibpy.Topic(ros, "/odom", "nav_msgs/Odometry", throttle_rate=100)
    odometry.subscribe(lambda m: positions.append(m["pose"]["pose"]["position"]))
    joy = roslibpy.Topic(ros, "/joy", "sensor_msgs/Joy")

    def stick(forward: float) -> dict[str, Any]:
        # axes[1] is forward, axes[0] turns; buttons[4] is the deadman switch.
        return {"axes": [0.0, forward], "buttons": [0, 0, 0, 0, 1]}

    for _ in range(5):
        joy.publish(stick(0.0))  # the robot arms on a neutral stick
        time.sleep(0.1)  # of two messages within one tick of 20 ms it takes the newer
    end = time.monotonic() + arguments.seconds
    while time.monotonic() < end:
        joy.publish(stick(1.0))  # the watchdog stops the robot after half a second of silence
        time.sleep(0.1)
    ros.terminate()
    if not positions:
        raise SystemExit("no odometry received: is this a Farsteer robot?")
    x, y = (positions[-1][axis] - positions[0][axis] for axis in "xy")
    print(f"{len(positions)} odometry messages, moved by x {x:.2f} m, y {y:.2f} m")


if __name__ == "__main__":
    main()
