"""Masses and shapes of an arm's bodies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from localization.types import Pose
from robot_sim.arm.arm_table import load_arm
from robot_sim.arm.parts import JAWS, ArmBody, Solid, arm_bodies, inertial, placed
from robot_sim.errors import ArmError

ARM = load_arm()


def placed_bodies(opening: float = 0.0) -> dict[str, tuple[ArmBody, Pose]]:
    """Return each body of the outstretched arm with its arm_base_from_body, by name."""
    angles = {joint.name: 0.0 for joint in ARM.joints}
    found: dict[str, tuple[ArmBody, Pose]] = {}
    for body in arm_bodies(ARM):
        parent = found[body.parent][1] if body.parent in found else Pose.identity()
        found[body.name] = body, parent @ placed(body, angles, opening)
    return found


def test_outstretched_each_mass_is_where_the_paper_has_it() -> None:
    found = []
    for body, pose in placed_bodies().values():
        found += [((pose @ s.pose).position[0], s.mass, s.name) for s in body.solids]
    tubes = sorted((x, m) for x, m, name in found if name == "tube")
    servos = sorted((x, m) for x, m, name in found if name == "servo")
    thick = [(0.07, 0.076), (0.14 + 0.0515, 0.047), (0.243 + 0.0152, 0.017)]
    np.testing.assert_allclose(tubes[2:5], thick, atol=1e-12)
    joints = [(0.0, 0.055), (0.0, 0.055), (0.14, 0.055), (0.243, 0.009), (0.2734, 0.009)]
    np.testing.assert_allclose(servos, joints, atol=1e-12)
    hand = np.array([(x, m) for x, m, _ in found if x > 0.2735])
    assert hand[:, 1].sum() == pytest.approx(0.048)
    assert hand[:, 1] @ hand[:, 0] / 0.048 == pytest.approx(0.2734 + 0.5 * 0.1385)


@pytest.mark.parametrize("opening", [0.0, 0.03, 0.06])
def test_pads_are_as_far_apart_as_the_gripper_is_open(opening: float) -> None:
    inner = []
    for name, side in zip(JAWS, (1.0, -1.0), strict=True):
        body, pose = placed_bodies(opening)[name]
        pad = next(s for s in body.solids if s.name == "pad")
        inner.append((pose @ pad.pose).position[1] - side * 0.5 * pad.size[1])
        assert (pose @ pad.pose).position[0] + 0.5 * pad.size[0] == pytest.approx(0.4119)
    assert inner[0] - inner[1] == pytest.approx(opening)


def test_the_palm_ends_where_the_fingers_begin() -> None:
    body, pose = placed_bodies()["arm_link_5"]
    palm = next(s for s in body.solids if s.name == "palm")
    front = (pose @ palm.pose).position[0] + 0.5 * palm.size[0]
    assert front == pytest.approx(0.4119 - ARM.gripper.finger)


def test_inertia_is_that_of_the_solid_seen_as_many_points() -> None:
    turned = Pose.from_euler((0.1, -0.2, 0.3), roll=0.4, pitch=0.5, yaw=0.6)
    box = Solid("palm", "box", (0.3, 0.2, 0.1), turned, 2.0)
    tube = Solid("tube", "cylinder", (0.1, 0.5), turned.inverse(), 3.0)
    draw = np.random.default_rng(2)
    grid = (np.stack(np.meshgrid(*[np.arange(60)] * 3), -1).reshape(-1, 3) + 0.5) / 60 - 0.5
    round_ = draw.uniform(-1.0, 1.0, (1_000_000, 3))
    round_ = round_[np.hypot(round_[:, 0], round_[:, 1]) < 1.0] * [0.1, 0.1, 0.25]
    for solid, points in ((box, grid * box.size), (tube, round_)):
        at = solid.pose.apply(points)
        at = at - at.mean(axis=0)
        tensor = solid.mass * (np.eye(3) * (at**2).sum(axis=1).mean() - at.T @ at / len(at))
        found = inertial(ArmBody("b", "p", Pose.identity(), None, None, (solid,)))
        np.testing.assert_allclose(found.centre, solid.pose.position)
        np.testing.assert_allclose(found.tensor, tensor, atol=3e-3 * tensor.max())


def test_two_halves_have_the_inertia_of_the_whole() -> None:
    whole = Solid("tube", "box", (0.4, 0.1, 0.1), Pose.identity(), 2.0)
    halves = tuple(
        Solid("tube", "box", (0.2, 0.1, 0.1), Pose.from_euler((x, 0.0, 0.0)), 1.0)
        for x in (-0.1, 0.1)
    )
    one, two = (
        inertial(ArmBody("b", "p", Pose.identity(), None, None, solids))
        for solids in ((whole,), halves)
    )
    np.testing.assert_allclose(one.tensor, two.tensor, atol=1e-15)


def test_jaws_too_heavy_for_link_5_are_refused() -> None:
    heavy = replace(ARM, gripper=replace(ARM.gripper, jaw_mass=0.02))
    with pytest.raises(ArmError, match=r"s2: gripper: .* try a smaller jaw_mass"):
        arm_bodies(heavy)
