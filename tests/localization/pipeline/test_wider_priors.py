"""A sweep that contradicts the prediction moves the robot only while its wheels slip, or once its pose is in doubt."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest

from localization.config import LocalizerConfig
from localization.filter.ekf import mark
from localization.filter.updates import widen
from localization.monitoring.belief import Belief
from localization.pipeline.registration_cache import SweepRecord
from localization.pipeline.resources import Resources
from localization.pipeline.state import LastSweep, State
from localization.pipeline.sweep_update import Registration, corrected_by_sweep
from localization.types import SECOND, Pose
from tests.support_rooms import HALL, MOUNTS

HERE = Pose.planar(3.5, 2.4, 0.2)
BELIEVED = HERE @ Pose.planar(0.2, 0.1, 0.0)
"""Where the prediction has the robot, and is sure of it to a centimetre."""


def after_sweep(*, slipping: bool = False, odds: float = 10.0) -> tuple[State, Registration]:
    config = LocalizerConfig(kiss_odometry=False)
    state = State.initial(MOUNTS, config)
    filter_ = widen(replace(state.filter, pose=BELIEVED), 0.01, 0.01, 0.01, np.deg2rad(0.2))
    now = SECOND // 10
    state = state._replace(
        filter=mark(filter_),
        placed=True,
        last=LastSweep(map_from_base=BELIEVED),
        health=replace(state.health, belief=Belief(odds)),
        wheels=state.wheels.contradicted() if slipping else state.wheels,
    )
    sweep = HALL.sweep(HERE, noise=0.01, stamp=now)
    resources = Resources(HALL.prepared(), MOUNTS, config, stage=lambda _: nullcontext())
    return corrected_by_sweep(state, SweepRecord((), Pose.identity(), sweep), resources)


def off(state: State) -> float:
    return float(np.linalg.norm(state.filter.pose.position - HERE.position))


def test_pose_that_nobody_doubts_stays_although_a_sweep_fits_elsewhere() -> None:
    state, registration = after_sweep()
    assert off(state) == pytest.approx(np.hypot(0.2, 0.1), abs=0.01)
    assert registration.refusal is not None
    assert registration.refusal.elsewhere


@pytest.mark.parametrize("doubt", [{"slipping": True}, {"odds": 0.0}])
def test_wheels_that_slip_and_a_pose_in_doubt_give_way_to_the_sweep(doubt: dict[str, bool]) -> None:
    state, registration = after_sweep(**doubt)
    assert off(state) < 0.02
    assert registration.refusal is None
