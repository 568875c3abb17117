"""The steps of a trial: pairs there and back, so that a robot stays about where it began."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from teleop.step_commands.commands import Step

DISTANCES: Final = (0.1, 0.25, 0.5, 0.75, 1.0)
"""Lengths of straight steps [m]."""

ANGLES: Final = (15, 30, 45, 90)
"""Sizes of turns [deg]."""


def drawn_steps(count: int, seed: int) -> tuple[Step, ...]:
    """Return steps in the order in which they are driven: half of them turns, each followed by its opposite.

    Args:
        count: Number of steps.
        seed: Seed of their order and sizes.
    """
    random = np.random.default_rng(seed)
    steps: list[Step] = []
    for pair in range((count + 1) // 2):
        sign = float(random.choice((-1.0, 1.0)))
        if pair % 2:
            size = sign * math.radians(float(random.choice(ANGLES)))
            steps += [Step(angle=size), Step(angle=-size)]
        else:
            length = sign * float(random.choice(DISTANCES))
            steps += [Step(distance=length), Step(distance=-length)]
    return tuple(steps[:count])
