"""Light through panes and off mirrors."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from benchmarks.pictures.optical_bench import (
    box_xml,
    pane_xml,
    wall_xml,
)
from robot_sim.scene_objects.materials import MATERIALS
from robot_sim.sensors.lidar_effects import (
    Effects,
    Panes,
    Sensitivity,
)
from robot_sim.sensors.lidar_models import lidar_model
from robot_sim.sensors.surface_optics import pane_reflectance
from tests.robot_sim.sensors.support import AHEAD, EffectsBench, along


@given(st.floats(0.0, 1.0), st.floats(1.0, 2.5))
def test_panes_mirror_a_share(cosine: float, index: float) -> None:
    share = float(pane_reflectance(np.array([cosine]), np.array([index]))[0])
    assert 0.0 <= share <= 1.0 + 1e-9


def test_panes_reflect_by_fresnels_equations() -> None:
    index = np.full(3, 1.52)
    cosines = np.cos(np.radians([0.0, 56.66, 89.99]))
    normal, brewster, grazing = pane_reflectance(cosines, index)
    face = ((1.52 - 1.0) / (1.52 + 1.0)) ** 2
    assert normal == pytest.approx(2 * face / (1 + face))
    # At Brewster's angle half of the light, that polarised along, is not mirrored at all.
    across = ((1.52**2 - 1.0) / (1.52**2 + 1.0)) ** 2
    assert brewster == pytest.approx(across / 2 * 2 / (1 + across / 2), rel=1e-3)
    assert grazing > 0.99


def test_glass_is_transparent_except_for_its_glint() -> None:
    bench = EffectsBench(pane_xml(2.0) + wall_xml(5.0))
    echoes = bench.echoes(along(0.0, 3.0, 10.0, 30.0, 60.0))
    x = echoes.distances * np.cos(np.radians([0.0, 3.0, 10.0, 30.0, 60.0]))
    np.testing.assert_allclose(x, [1.997, 5.0, 5.0, 5.0, 5.0], atol=1e-4)
    # Through the pane and back: transmittance squared, of a white wall's cosine.
    glass = MATERIALS["glass"]
    expected = 0.8 * math.cos(math.radians(10.0)) * glass.transmittance**2
    assert echoes.remissions[2] == pytest.approx(expected, rel=0.01)


def test_both_casters_look_through_the_same_glass() -> None:
    pytest.importorskip("embreex")
    from robot_sim.raycasting.embree_caster import EmbreeRayCaster
    from robot_sim.raycasting.embree_scene import StaticGeometry

    bench = EffectsBench(
        pane_xml(2.0)
        + pane_xml(3.0, yaw=0.4)
        + wall_xml(5.0)
        + box_xml(0.0, 3.0, (4.0, 0.1, 2.0), "mirror")
    )
    rays = along(*np.linspace(-40.0, 80.0, 121))
    slow = bench.echoes(rays)
    bench.caster = EmbreeRayCaster(StaticGeometry(bench.model), bench.model, bench.data)
    fast = bench.echoes(rays)
    np.testing.assert_allclose(fast.distances, slow.distances, atol=1e-4)
    np.testing.assert_allclose(fast.remissions, slow.remissions, rtol=1e-4, atol=1e-6)
    assert np.isfinite(slow.distances).sum() > 80


def test_glint_fades_with_the_angle_of_incidence_as_configured() -> None:
    bench = EffectsBench(pane_xml(2.0))
    degrees = np.array([0.0, 0.5, 1.0, 1.5])
    glass, panes = MATERIALS["glass"], Panes()
    expected = glass.reflectivity + panes.glint * glass.specular * np.exp(
        -((np.sin(np.radians(degrees)) / panes.lobe) ** 2)
    )
    np.testing.assert_allclose(bench.echoes(along(*degrees)).remissions, expected, rtol=5e-3)


def test_pane_before_nothing_is_measured_only_near_normal_incidence() -> None:
    bench = EffectsBench(pane_xml(4.0))
    effects = lidar_model("sick_lms111").effects()
    told = np.isfinite([scan.ranges for scan in bench.sweeps(40, effects=effects)]).mean(axis=0)
    degrees = np.abs(np.linspace(-135.0, 135.0, 541))
    assert told[degrees < 0.6].min() > 0.9
    assert told[(degrees > 6.0) & (degrees < 40.0)].max() < 0.1


def test_two_panes_attenuate_by_both() -> None:
    one = EffectsBench(pane_xml(2.0) + wall_xml(5.0)).echoes(along(10.0))
    two = EffectsBench(pane_xml(2.0) + pane_xml(3.0) + wall_xml(5.0)).echoes(along(10.0))
    np.testing.assert_allclose(two.distances, one.distances, atol=1e-4)
    glass = MATERIALS["glass"]
    assert two.remissions[0] / one.remissions[0] == pytest.approx(glass.transmittance**2, rel=0.01)


def test_mirror_shows_objects_before_it_as_if_behind() -> None:
    slant = box_xml(2.0, 0.0, (0.003, 1.0, 1.0), "mirror", yaw=math.radians(-45.0))
    bench = EffectsBench(
        slant
        + box_xml(0.0, 3.1, (9.0, 0.1, 2.0), "wall")
        + box_xml(0.0, -3.1, (9.0, 0.1, 2.0), "wall")
    )
    echoes = bench.echoes(along(0.0))
    # Its front is 3 mm off, along a normal at 45 deg: 2 - 0.0042 m to it, then as far as the wall.
    assert echoes.distances[0] == pytest.approx(5.0 - 0.003 * math.sqrt(2.0), abs=1e-4)
    assert echoes.remissions[0] == pytest.approx(0.8 * 0.85**2, rel=1e-3)


def test_tracing_between_two_mirrors_ends() -> None:
    bench = EffectsBench(
        box_xml(2.0, 0.0, (0.003, 5.0, 5.0), "mirror")
        + box_xml(-2.0, 0.0, (0.003, 5.0, 5.0), "mirror")
    )
    echoes = bench.echoes(along(0.0, 20.0, 45.0))
    assert echoes.distances[0] == pytest.approx(1.997)
    assert np.isfinite(echoes.distances).all()


def test_glass_is_a_wall_while_the_effect_is_off() -> None:
    bench = EffectsBench(pane_xml(2.0) + wall_xml(5.0))
    (scan,) = bench.sweeps(1, effects=Effects(sensitivity=Sensitivity()))
    assert scan.ranges[AHEAD + 40] * math.cos(math.radians(20.0)) == pytest.approx(1.997, abs=1e-4)
    assert scan.intensities[AHEAD] == pytest.approx(0.8)
