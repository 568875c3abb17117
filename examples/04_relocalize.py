"""Find a robot that does not know where it is: search the whole map, and drive on until one place remains.

Needs a log with motion, such as that of `make sim ARGS="--out runs/first"`; the hints in it are left out here.
"""

import argparse
from pathlib import Path

from localization import Hint, Localizer, load_cloud, prepare, read_log


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("log", type=Path)
    parser.add_argument("map", type=Path)
    arguments = parser.parse_args()

    log = read_log(arguments.log)
    localizer = Localizer(prepare(load_cloud(arguments.map)), log.mounts)
    localizer.relocalize()
    places = 0
    for reading in log:
        if isinstance(reading, Hint):
            continue
        estimate = localizer.add(reading)
        if len(estimate.hypotheses) != places:
            places = len(estimate.hypotheses)
            print(f"{estimate.stamp / 1e9:5.1f} s: {places} places explain what the scanners see")
        if estimate.map_from_base is not None:
            x, y, _ = estimate.map_from_base.position
            print(
                f"{estimate.stamp / 1e9:5.1f} s: found at x {x:.2f} m, y {y:.2f} m ({estimate.health})"
            )
            return
    raise SystemExit("not found before the log ended")


if __name__ == "__main__":
    main()
