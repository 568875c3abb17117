"""Boxes in the jaws: picked up, held, carried by a robot that drives and is carried itself, dropped."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.arm.handling.grasps import CARRYING, MASSES, Picker, Place, carried, picked
from localization.types import Pose
from robot_sim.drive.tyres import GRAVITY


def holding(place: Place | None = None) -> Picker:
    """Return a robot that holds a box."""
    place = place or Place()
    picker = Picker(place.world())
    assert picker.pick(place)
    return picker


@pytest.mark.parametrize("seed", [0, 2, 28])
def test_a_box_is_picked_up_and_held_while_the_arm_swings(seed: int) -> None:
    held, slip = picked(seed)
    assert held
    assert slip < 5.0


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("pose", CARRYING)
def test_a_box_slips_less_than_a_centimetre_over_ten_metres_and_three_turns(
    pose: tuple[float, ...],
) -> None:
    held, slip = carried(max(MASSES), pose, 0.6)
    assert held
    assert slip <= 10.0


def test_the_jaws_press_with_their_force_and_no_more() -> None:
    picker = holding()
    for force in (6.0, 2.0):
        for _ in range(25):
            picker.arm.command(picker.wanted, 0.0, force)
            picker.simulation.step()
        reading = picker.arm.reading
        assert reading.grip_force == pytest.approx(force, abs=0.05)
        assert reading.opening == pytest.approx(0.03, abs=1.5e-3)
        assert (reading.held, reading.touching, reading.hit) == ("parcel", ("parcel",), False)


def test_a_box_falls_when_the_jaws_open_and_then_rests() -> None:
    picker = holding()
    before = picker.simulation._data.body("parcel").xpos[2]
    picker.opening = 0.06
    picker.wait(1.5)
    data, model = picker.simulation._data, picker.world.model
    assert picker.arm.reading.held == ""
    assert data.body("parcel").xpos[2] < before - 0.05
    assert data.tree_asleep[model.body_treeid[model.body("parcel").id]] >= 0


def test_servos_of_a_loaded_arm_bear_the_box_too() -> None:
    light, heavy = (holding(Place(mass=mass)) for mass in (0.01, 0.04))
    more = heavy.arm.reading.torques[1] - light.arm.reading.torques[1]
    data = heavy.simulation._data
    lever = np.hypot(*(data.body("parcel").xpos - data.body("arm_link_2").xpos)[:2])
    assert more == pytest.approx(0.03 * GRAVITY * lever, rel=0.05)


def test_a_robot_that_is_carried_takes_along_what_it_holds() -> None:
    picker = holding()
    before = picker.in_hand
    picker.simulation.carry_to(Pose.planar(-3.0, 2.0, 2.0))
    np.testing.assert_allclose(picker.in_hand, before, atol=1e-3)
    picker.lost = 0
    picker.wait(1.0)
    assert picker.lost == 0
    assert np.linalg.norm(picker.in_hand - before) < 1.0


def test_what_the_arm_holds_is_no_obstacle_that_the_robot_touches() -> None:
    picker = holding()
    assert picker.simulation.touching == ()
    assert picker.simulation.condition.touching == ()
