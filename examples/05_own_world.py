"""A world of your own: a floor plan as text, and a drive through it. See docs/worlds.md for all its keys."""

import argparse

from localization.types import Twist
from robot_sim import Simulation, parse_world

PLAN = """
bounds = [0.0, 0.0, 10.0, 6.0]       # x and y from, x and y to [m]
height = 2.5
spawn = [2.0, 3.0, 0.0]              # x [m], y [m], heading [degrees]
[[wall]]
name = "south"
from = [0.0, -0.1]
to = [10.0, -0.1]
thickness = 0.2
[[wall]]
name = "north"
from = [0.0, 6.1]
to = [10.0, 6.1]
thickness = 0.2
[[wall]]
name = "east"
from = [10.1, 0.0]
to = [10.1, 6.0]
thickness = 0.2
[[wall]]
name = "west"
from = [-0.1, 0.0]
to = [-0.1, 6.0]
thickness = 0.2
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=5.0, help="how long to drive forward")
    arguments = parser.parse_args()

    simulation = Simulation(parse_world(PLAN, name="my room"), seed=0)
    start = simulation.truth().map_from_base
    for _ in range(round(50 * arguments.seconds)):  # ticks of 20 ms
        simulation.command(Twist.planar(0.5, 0.0))
        simulation.step()
    end = simulation.truth().map_from_base
    print(f"drove from x {start.position[0]:.2f} m to x {end.position[0]:.2f} m")
    print("touches:", ", ".join(simulation.touching) or "nothing")


if __name__ == "__main__":
    main()
