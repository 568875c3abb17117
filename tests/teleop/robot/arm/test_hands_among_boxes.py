"""Adversarial hands among boxes: a small part of the campaign of ``benchmarks arm``."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.arm.boxes import boxes, free_poses, on_a_floor
from benchmarks.arm.campaign import Tally, episode


@pytest.mark.slow
def test_no_hand_brings_the_arm_nearer_than_two_millimetres() -> None:
    clearance, tally = on_a_floor(), Tally()
    for seed in range(5):
        chance = np.random.default_rng([25, 1000, seed])
        clearance.surround(boxes(chance))
        start = next(free_poses(clearance, chance))
        episode(clearance, start, chance, tally, 200)
    assert tally.steps == 1000
    assert tally.nearest >= 0.002 - 1e-6
    assert tally.held < 0.2 * tally.steps
