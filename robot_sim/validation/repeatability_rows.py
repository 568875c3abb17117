"""Rows on the test rig itself: exact replay, no chatter, and control rows that must fail."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

from robot_sim.robot.platforms import P3AT
from robot_sim.validation.drive_bench import DriveBench, chi, ramped
from robot_sim.validation.row import Row

STARTS = 48
"""Number of start conditions that are tested for chatter."""
CHATTER = 0.5
"""Standard deviation of a motor's torque in a steady turn that counts as chatter [N m]."""


def replay() -> Iterator[Row]:
    """Yield the number of differing values of a run that is continued from a snapshot."""
    bench = DriveBench(P3AT())
    bench.run(ramped(1.0, 3.0, 1.0))
    kind = mujoco.mjtState.mjSTATE_INTEGRATION
    snapshot = np.empty(mujoco.mj_stateSize(bench.model, kind))
    mujoco.mj_getState(bench.model, bench.data, snapshot, kind)
    first = bench.run(ramped(-2.0, 4.0, 2.0))
    mujoco.mj_setState(bench.model, bench.data, snapshot, kind)
    again = bench.run(ramped(-2.0, 4.0, 2.0))
    # The first sample is the snapshot, whose sensor data are those of the step before it.
    different = sum(
        int((getattr(first, name)[1:] != getattr(again, name)[1:]).sum())
        for name in first.__dataclass_fields__
    )
    name = "numbers that differ in 2 s replayed from a snapshot"
    yield Row("Trust", name, 0, 0, different, source="bit for bit", digits=0)


def chatter() -> Iterator[Row]:
    """Yield the number of starts that end in torque chatter while turning slowly in place."""
    rng = np.random.default_rng(7)
    locked, ratios = 0, []
    robot = P3AT()
    for _ in range(STARTS):
        bench = DriveBench(robot)
        bench.data.qvel[:2] = rng.uniform(-0.5, 0.5, 2)
        bench.data.qvel[5] = rng.uniform(-2.0, 2.0)
        bench.data.qvel[6:10] = rng.uniform(-6.0, 6.0, 4)
        bench.data.qpos[2] += rng.uniform(0.0, 0.01)
        run = bench.run(ramped(-0.5, 0.5, 3.0, ramp=0.0), fine=True).after(2.0)
        locked += int(run.torques.std(axis=0).max() > CHATTER)
        ratios.append(chi(robot, run))
    source = "stiffer contact parameters locked 4 of 36"
    name = f"starts of {STARTS} that end in torque chatter, wheels at 0.5 rad/s"
    yield Row("Trust", name, 0, 0, locked, source=source, digits=0)
    name = f"spread of chi over these {STARTS} starts"
    yield Row(
        "Trust", name, 0.0, 0.01, float(np.ptp(ratios)), source="one value, limit chosen", digits=4
    )


def control() -> Iterator[Row]:
    """Yield rows with MuJoCo's default contacts on the same rig, which must fail."""
    robot = P3AT()
    bench = DriveBench(robot)
    use_default_contacts(bench.model)
    run = bench.run(ramped(-2.0, 2.0, 4.0), fine=True).after(1.0)
    group, source = "Control: the same rig with MuJoCo's default contacts", "must miss"
    yield Row(
        group, "chi", robot.chi, 0.03 * robot.chi, chi(robot, run), source=source, control=True
    )
    down = int(run.tyres_down.sum(axis=1).min())
    yield Row(
        group, "wheels down, fewest in any step", 4, 0, down, source=source, digits=0, control=True
    )
    shake = float(run.accelerations.std(axis=0).max())
    yield Row(
        group,
        "accelerometer std",
        0.0,
        0.05,
        shake,
        unit="m/s²",
        source=source,
        digits=2,
        control=True,
    )


def use_default_contacts(model: mujoco.MjModel) -> None:
    """Give the wheels' contact pairs MuJoCo's default parameters."""
    model.opt.impratio = 1.0
    model.pair_solref[:] = (0.02, 1.0)
    model.pair_solimp[:] = (0.9, 0.95, 0.001, 0.5, 2.0)
    model.pair_solreffriction[:] = 0.0
