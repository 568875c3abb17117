"""Rows on turning: yaw rate over wheel rates, torque, power and steadiness."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import mujoco
import numpy as np

from robot_sim.drive.tyres import GRAVITY
from robot_sim.drive.wheel_slip import slip_of
from robot_sim.robot.imperfections import Imperfections
from robot_sim.robot.mujoco_body import WHEELS
from robot_sim.robot.platforms import HUSKY, JACKAL, P3AT
from robot_sim.robot.skid_steer_parameters import SkidSteer
from robot_sim.scene_objects.floor_surfaces import Surface
from robot_sim.validation import friction_theory
from robot_sim.validation.drive_bench import BENCH, DriveBench, Run, chi, ramped
from robot_sim.validation.row import Row, reported, within

WEIGHED = 27.1
"""Mass for spin torque and power [kg]: a P3-AT without scanners."""
RATES = (0.2, 1.0, 3.0, 6.4)
"""Wheel rates in place [rad/s], up to the fastest at which the P3-AT drives straight."""
FRICTIONS = (0.3, 0.7, 0.9)
"""Friction coefficients of the sweep."""
MASSES = (27.0, 35.0, 50.0)
"""Masses of the sweep [kg]."""
CURVES = (0.0, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0, 20.0, 30.0, 50.0)
"""Values of lambda: sum over difference of the rim speeds."""
RATIOS = (0.7, 0.85, 1.0, 1.2, 1.43)
"""Values of friction across over friction along the wheels."""
OFFSETS = (-0.024, 0.015, 0.024)
"""Offsets of the centre of mass from the wheels' centre [m]."""
_WANG = "Wang et al., Sensors 2015, 15, 9681"
_CLOSED = "closed form of four Coulomb contacts"


def ballasted(robot: SkidSteer, mass: float) -> SkidSteer:
    """Return the robot with a chassis mass that gives it the total ``mass`` [kg]."""
    return replace(robot, chassis_mass=robot.chassis_mass + mass - robot.mass)


def uniform_friction(friction: float) -> Surface:
    """Return a floor with the same friction in all directions."""
    return Surface(f"mu {friction}", friction, friction, 0.0, "swept")


def spin(robot: SkidSteer, rate: float, surface: Surface = BENCH) -> Run:
    """Turn in place at a wheel rate [rad/s] for 3 s; return the settled part, from 1 s on."""
    return DriveBench(robot, surface).run(ramped(-rate, rate, 3.0)).after(1.0)


def in_place() -> Iterator[Row]:
    """Yield the worst chi of each sweep, and the published figures of the P3-AT."""
    robot = P3AT()
    swept = [
        chi(robot, spin(robot, rate, uniform_friction(friction)))
        for rate in RATES
        for friction in FRICTIONS
    ]
    loaded = [chi(r, spin(r, 2.0)) for r in (ballasted(robot, m) for m in MASSES)]
    group = "Turning in place"
    name = "chi, wheels at 0.2 to 6.4 rad/s, mu 0.3 to 0.9, the worst of 12"
    yield within(group, name, robot.chi, 0.03, _worst(swept, robot.chi), source=_CLOSED)
    name = "chi, 27 to 50 kg, the worst of 3"
    yield within(group, name, robot.chi, 0.03, _worst(loaded, robot.chi), source=_CLOSED)
    run = spin(robot, 2.0)
    here = chi(robot, run)
    aria = friction_theory.ARIA_TRACK / robot.track
    yield within(group, "chi, ARIA", aria, 0.03, here, source="ARIA `DiffConvFactor` 0.0034")
    yield within(
        group,
        "chi, P3-AT in Wang's curve",
        friction_theory.published_chi(0.0),
        0.03,
        here,
        source=_WANG,
    )
    slips = [
        slip_of(robot, vx, vy, turn, rates)
        for (vx, vy, turn), rates in zip(run.twists.tolist(), run.wheel_rates, strict=True)
    ]
    spans = [s.icr_left - s.icr_right for s in slips]
    yield within(
        group,
        "distance of left and right ICR",
        friction_theory.MANDOW_SPAN,
        0.03,
        float(np.mean(spans)),
        unit="m",
        source="ICRs in public ROS packages, attributed to Mandow et al., IROS 2007",
    )
    yield from _others()


def _others() -> Iterator[Row]:
    source = "Clearpath `control.yaml`, URDF"
    for robot, track in (
        (HUSKY, friction_theory.HUSKY_TRACK),
        (JACKAL, friction_theory.JACKAL_TRACK),
    ):
        target = track / robot.track
        rates = (0.1 * robot.wheel_rate, 0.95 * robot.wheel_rate)
        values = [chi(robot, spin(robot, rate)) for rate in rates]
        name = f"chi, {robot.name.title()}, at a tenth and at all of its wheel rate, the worst"
        value = _worst(values, target)
        yield within("Turning in place", name, target, 0.03, value, source=source)


def curves() -> Iterator[Row]:
    """Yield chi in curves of growing radius; the rule of the tyres' lateral grip was fitted to them."""
    robot = P3AT()
    for curve in CURVES:
        slow, fast = _rates(curve)
        ways = [(slow, fast), (fast, slow), (-slow, -fast), (-fast, -slow)]
        values = [chi(robot, DriveBench(robot).run(ramped(*w, 3.0)).after(1.0)) for w in ways]
        target = friction_theory.published_chi(curve)
        name = f"chi at lambda {curve:g}, the worst of left, right, forward, back"
        yield within(
            "Curves", name, target, 0.03, _worst(values, target), source=_WANG, fitted=True
        )


def chi_in_curve(curve: float, *, compliant: bool = True) -> float:
    """Return chi of the P3-AT in a left curve of that lambda, with tyres that bend or do not."""
    robot = P3AT()
    run = DriveBench(robot, compliant=compliant).run(ramped(*_rates(curve), 3.0)).after(1.0)
    return chi(robot, run)


def _rates(curve: float) -> tuple[float, float]:
    """Return left and right wheel rates [rad/s] with that ratio of sum to difference."""
    if curve == 0.0:
        return -2.0, 2.0
    mean = min(3.0, 6.0 / (1.0 + 1.0 / curve))
    return mean * (1.0 - 1.0 / curve), mean * (1.0 + 1.0 / curve)


def anisotropy() -> Iterator[Row]:
    """Yield chi on floors with different friction across and along the wheels."""
    robot = P3AT()
    for ratio in RATIOS:
        floor = Surface(f"ratio {ratio}", 0.6, 0.6 * ratio, 0.0, "swept")
        value = chi(robot, spin(robot, 2.0, floor))
        target = friction_theory.anisotropic_chi(robot, ratio)
        name = f"chi, mu across / along {ratio:g}"
        yield within("Anisotropic friction", name, target, 0.01, value, source=_CLOSED)


def offsets() -> Iterator[Row]:
    """Yield chi with the centre of mass off the wheels' centre."""
    for offset in OFFSETS:
        robot = replace(P3AT(), imperfections=Imperfections(com_offset=(offset, 0.0, 0.0)))
        value = chi(robot, spin(robot, 2.0))
        target = friction_theory.turning_chi(robot, offset)
        name = f"chi, centre of mass {1e3 * offset:+.0f} mm"
        source = "four Coulomb contacts, loads by lever, solved independently of MuJoCo"
        yield within("Centre of mass", name, target, 0.02, value, source=source)


def width() -> Iterator[Row]:
    """Yield chi with tyres that touch with their whole width, which is only reported."""
    notes = "as first measured with such cylinders"
    cases = (
        (0.0, friction_theory.ARIA_TRACK / P3AT().track, "ARIA"),
        (0.024, 1.39, notes),
        (-0.04, 1.28, notes),
    )
    for offset, target, source in cases:
        robot = replace(P3AT(), imperfections=Imperfections(com_offset=(offset, 0.0, 0.0)))
        bench = DriveBench(robot, compliant=False)
        widen(bench.model, robot)
        value = chi(robot, bench.run(ramped(-2.0, 2.0, 3.0)).after(1.0))
        name = f"chi, centre of mass {1e3 * offset:+.0f} mm"
        yield reported(
            "Tyres touching with their full width", name, target, value, source=source, digits=3
        )


def widen(model: mujoco.MjModel, robot: SkidSteer) -> None:
    """Make the tyres of a compiled robot cylinders of their full width."""
    for wheel in WHEELS:
        tyre = model.geom(f"{wheel}_tyre").id
        model.geom_type[tyre] = mujoco.mjtGeom.mjGEOM_CYLINDER
        model.geom_size[tyre, 1] = robot.wheel_half_width
        model.geom_rbound[tyre] = math.hypot(robot.wheel_radius, robot.wheel_half_width)


def effort() -> Iterator[Row]:
    """Yield torque and power in place, on which chi has no information."""
    group = "Effort"
    for robot in (ballasted(P3AT(), WEIGHED), P3AT(), HUSKY, JACKAL):
        target = friction_theory.spin_torque(robot, BENCH.mu_long)
        value = float(np.abs(spin(robot, 2.0).torques).mean())
        name = f"torque per wheel, {robot.name}, {robot.mass:.1f} kg, mu 0.7"
        yield within(group, name, target, 0.05, value, unit="N m", source=_CLOSED, digits=2)
    light = ballasted(P3AT(), WEIGHED)
    for rate in (2.0, 6.0):
        run = spin(light, rate)
        value = float((run.torques * run.wheel_rates).sum(axis=1).mean())
        target = 4.0 * friction_theory.spin_torque(light, BENCH.mu_long) * rate
        name = f"power in place, wheels at {rate:g} rad/s, {WEIGHED} kg"
        yield within(group, name, target, 0.05, value, unit="W", source=_CLOSED, digits=1)
    yield from _rolling()


def _rolling() -> Iterator[Row]:
    robot, floor = P3AT(), Surface("carpet", 0.8, 0.8, 0.03, "swept")
    run = DriveBench(robot, floor).run(ramped(3.0, 3.0, 3.0)).after(1.0)
    target = 0.03 * robot.mass * GRAVITY / 4.0 * robot.rolling_radius
    value = float(run.torques.mean())
    name = "torque per wheel, straight, rolling resistance 0.03"
    source = "load x resistance x radius"
    yield within("Effort", name, target, 0.05, value, unit="N m", source=source)


def steadiness() -> Iterator[Row]:
    """Yield drift, ripple, vibration and lost contacts while turning in place."""
    group = "Steadiness in place"
    run = DriveBench(P3AT()).run(ramped(-2.0, 2.0, 12.0), fine=True)
    walked = float(np.hypot(*run.positions[:, :2].T).max())
    yield Row(
        group, "position drift in 12 s", 0.0, 10.0, 1e3 * walked, unit="mm", source="target chosen"
    )
    settled = run.after(1.0)
    turn = settled.twists[:, 2]
    turns = (settled.yaws[-1] - settled.yaws[0]) / (2.0 * math.pi)
    ripple = 100.0 * float(np.ptp(turn) / turn.mean())
    name = f"yaw-rate ripple, peak to peak, {turns:.1f} turns"
    yield Row(group, name, 0.0, 1.0, ripple, unit="%", source="pyramidal cones fail this", digits=4)
    for rate, part in ((2.0, settled), (6.0, _fast())):
        shake = float(part.accelerations.std(axis=0).max())
        name = f"accelerometer std, wheels at {rate:g} rad/s, every step"
        yield Row(
            group,
            name,
            0.0,
            0.05,
            shake,
            unit="m/s²",
            source="MuJoCo's default contacts: 7.7",
            digits=4,
        )
        down = int(part.tyres_down.sum(axis=1).min())
        name = f"wheels down, fewest in any step, at {rate:g} rad/s"
        yield Row(group, name, 4, 0, down, source="MuJoCo's default contacts: 0", digits=0)


def _fast() -> Run:
    return DriveBench(P3AT()).run(ramped(-6.0, 6.0, 4.0), fine=True).after(2.0)


def _worst(values: list[float], target: float) -> float:
    return max(values, key=lambda v: abs(v - target))
