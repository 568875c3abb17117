"""A scanner of your own on the robot: here a narrow, fast one, beside one taken from a data sheet."""

import argparse

import numpy as np

from localization.types import Scan
from robot_sim import ScannerConfig, Simulation, SimulationConfig


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scene", default="office")
    arguments = parser.parse_args()

    own = ScannerConfig(
        name="laser_horizontal",  # where it is mounted
        field_of_view=np.deg2rad(120.0),
        resolution=np.deg2rad(0.5),
        period_ns=50_000_000,  # 20 Hz
        sigma=0.02,  # of a range [m]
    )
    known = ScannerConfig.of("laser_vertical", "hokuyo_utm30lx")
    simulation = Simulation(arguments.scene, config=SimulationConfig(scanners=(own, known)))
    scans: dict[str, Scan] = {}
    for _ in range(10):
        for reading in simulation.step():
            if isinstance(reading, Scan):
                scans[reading.scanner] = reading
    for name, scan in sorted(scans.items()):
        valid = scan.ranges[np.isfinite(scan.ranges)]
        print(
            f"{name}: {len(scan.ranges)} beams, {len(valid)} returns, nearest {valid.min():.2f} m"
        )


if __name__ == "__main__":
    main()
