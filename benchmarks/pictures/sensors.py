"""Figures of the simulated sensors and their error models.

``python -m benchmarks.pictures.sensors docs/images`` draws them. Each dot is a beam of a simulated scanner
on an optical bench; lines are the formulas.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.pictures.optical_bench import (
    OpticalBench,
    bench_scanner,
    box_xml,
    pane_xml,
    wall_xml,
)
from localization.geometry import FloatArray
from localization.types import IntArray, Scan
from robot_sim.scene_objects.materials import MATERIALS
from robot_sim.sensors.echoes import detection_chances, footprint_depth, received_power
from robot_sim.sensors.imu import READING_SECONDS, InertialConfig, InertialUnit
from robot_sim.sensors.imu_models import INERTIAL_UNITS
from robot_sim.sensors.imu_noise import allan_deviation
from robot_sim.sensors.lidar_effects import (
    NO_EFFECTS,
    Beam,
    Effects,
    Mixing,
    Sensitivity,
    Spreading,
    Sunlight,
)
from robot_sim.sensors.lidar_models import LIDARS
from robot_sim.sensors.scanner_config import ScannerConfig

_COLOURS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""Okabe and Ito's palette, which colour-blind people can distinguish."""
_GREY: Final = "#777777"

_NARROW: Final = (1e-5, 1e-8)
"""Field of view and resolution [rad] of a thousand beams straight ahead."""


def _points(scan: Scan) -> tuple[FloatArray, FloatArray]:
    seen = np.isfinite(scan.ranges)
    ranges, angles = scan.ranges[seen], scan.angles[seen]
    return ranges * np.cos(angles), ranges * np.sin(angles)


def _ahead(distance: float, material: str, effects: Effects, **parameters: float) -> FloatArray:
    """Return a thousand ranges of a wall straight ahead, as a scanner measures them."""
    scanner = bench_scanner(
        effects=effects, field_of_view=_NARROW[0], resolution=_NARROW[1], **parameters
    )
    (scan,) = OpticalBench(wall_xml(distance, material)).sweeps(1, scanner)
    return scan.ranges


def _figure(panels: int, *, width: float = 8.0, height: float = 3.0) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(width, height), layout="constrained")
    axes = np.atleast_1d(figure.subplots(1, panels))
    return figure, list(axes)


def _label(axes: Axes, x: str, y: str, title: str) -> None:
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.set_title(title, fontsize=9)
    axes.grid(color="#e5e5e5", lw=0.5)
    axes.set_axisbelow(True)


def models() -> Figure:
    """Range errors over distance, by model, and the times of the beams of one scan."""
    figure, (errors, times) = _figure(2)
    for colour, model in zip(_COLOURS, LIDARS.values(), strict=False):
        config = ScannerConfig.of("laser_horizontal", model.name)
        distances = np.linspace(model.range_min, min(model.range_max, 30.0), 60)
        sigma = np.broadcast_to(config.noise.at(distances), distances.shape)
        errors.step(distances, 1e3 * sigma, color=colour, label=model.name, where="post")
        if model.name.endswith("_cm"):
            continue
        for part in range(config.interlace):
            scan = config.scan(0, np.zeros(config.beams_of(part)), part=part)
            at = config.start_of(part) + scan.offsets
            times.plot(1e-6 * at, np.degrees(scan.angles), color=colour, lw=1.6)
    errors.set_ylim(0.0, 33.0)
    errors.legend(fontsize=7, loc="center left", bbox_to_anchor=(0.0, 0.72))
    _label(errors, "distance [m]", "sigma [mm]", "statistical error")
    _label(times, "time after the first beam [ms]", "beam angle [deg]", "beam times of one scan")
    for text, place, colour in (
        ("LMS-200: even beams ...", (1.0, 105.0), _COLOURS[0]),
        ("... then odd ones", (19.0, -75.0), _COLOURS[0]),
        ("UTM-30LX", (19.2, 120.0), _COLOURS[3]),
        ("LMS111", (22.5, 45.0), _COLOURS[2]),
    ):
        times.annotate(text, place, fontsize=7, color=colour)
    return figure


def mixing() -> Figure:
    """A post before a wall, seen by thin beams, by an LMS111 and by an LMS-200."""
    figure, panels = _figure(3, height=3.2)
    bench = OpticalBench(box_xml(4.55, 0.0, (0.05, 0.25, 2.0), "wall") + wall_xml(5.0))
    cases = (
        ("thin beams", Beam(), NO_EFFECTS),
        ("LMS111: spot 83 mm at 5 m", LIDARS["sick_lms111"].beam, Effects(mixing=Mixing())),
        ("LMS-200: spot 32 mm at 5 m", LIDARS["sick_lms200"].beam, Effects(mixing=Mixing())),
    )
    for axes, (title, beam, effects) in zip(panels, cases, strict=True):
        scanner = bench_scanner(
            beam=beam,
            effects=effects,
            field_of_view=math.radians(30.0),
            resolution=math.radians(0.25),
        )
        for scan in bench.sweeps(8, scanner):
            x, y = _points(scan)
            between = (x > 4.53) & (x < 4.97)
            axes.scatter(y[~between], x[~between], s=4, color=_COLOURS[0], linewidths=0)
            axes.scatter(y[between], x[between], s=6, color=_COLOURS[1], linewidths=0)
        axes.set_xlim(0.8, -0.8)
        axes.set_ylim(4.3, 5.2)
        _label(axes, "y [m]", "x [m]", title)
    return figure


def spreading() -> Figure:
    """Sigma over the angle of incidence: measured beams and the formula."""
    figure, (sigmas, seen) = _figure(2)
    incidence = np.array([0.0, 30.0, 50.0, 60.0, 70.0, 75.0, 80.0, 83.0])
    fine = np.linspace(0.0, 85.0, 200)
    effect = Spreading()
    for colour, distance in zip(_COLOURS, (2.0, 5.0, 10.0), strict=False):
        measured = []
        for degrees in incidence:
            slab = box_xml(distance, 0.0, (1e-6, 40.0, 5.0), "wall", yaw=math.radians(degrees))
            scanner = bench_scanner(
                sigma=0.012,
                effects=Effects(spreading=effect),
                field_of_view=_NARROW[0],
                resolution=_NARROW[1],
            )
            (scan,) = OpticalBench(slab).sweeps(1, scanner)
            measured.append(1e3 * scan.ranges.std())
        depth = footprint_depth(Beam(), np.full(200, distance), np.cos(np.radians(fine)))
        sigmas.plot(fine, 1e3 * np.hypot(0.012, effect.gain * depth), color=colour, lw=1.0)
        sigmas.plot(incidence, measured, "o", ms=3, color=colour, label=f"{distance:g} m")
    sigmas.set_ylim(0.0, 80.0)
    sigmas.legend(fontsize=7, title="LMS111, white wall", title_fontsize=7)
    _label(
        sigmas, "incidence [deg]", "sigma [mm]", "spread of ranges (dots: beams, lines: formula)"
    )
    bench = OpticalBench(box_xml(0.0, -1.0, (40.0, 0.001, 2.0), "asphalt"))
    both = Effects(spreading=effect, sensitivity=Sensitivity())
    narrow = {"field_of_view": math.radians(180.0), "resolution": math.radians(0.1)}
    (plain,) = bench.sweeps(1, bench_scanner(**narrow))
    scans = bench.sweeps(30, bench_scanner(effects=both, **narrow))
    share = np.isfinite([scan.ranges for scan in scans]).mean(axis=0)
    right = np.isfinite(plain.ranges) & (plain.angles < 0.0)
    along = plain.ranges[right] * np.cos(plain.angles[right])
    seen.plot(along, share[right], ".", ms=3, color=_COLOURS[1])
    _label(seen, "metres along a side wall 1 m off", "share measured", "grazed asphalt drops out")
    return figure


def sensitivity() -> Figure:
    """Largest ranges of surfaces: beams and the formula."""
    figure, (axes,) = _figure(1, width=6.5, height=3.2)
    fine = np.linspace(1.0, 30.0, 300)
    effect = Sensitivity()
    for colour, name in zip(_COLOURS, ("wall", "asphalt", "dark_fabric", "rubber"), strict=False):
        rho = MATERIALS[name].reflectivity
        power = received_power(np.full(300, rho), fine)
        axes.plot(fine, detection_chances(power, effect, 0.0), color=colour, lw=1.0)
        distances = np.arange(2.0, 30.0, 1.5)
        shares = [
            np.isfinite(_ahead(x, name, Effects(sensitivity=effect), range_max=40.0)).mean()
            for x in distances
        ]
        axes.plot(distances, shares, "o", ms=3, color=colour, label=f"{name}, {100 * rho:g} %")
    axes.axvline(18.0, color=_GREY, lw=0.8, ls="--")
    axes.annotate("data sheet:\n10 % at 18 m", (18.2, 0.05), fontsize=7, color=_GREY)
    axes.legend(fontsize=7, loc="lower left")
    _label(axes, "distance [m]", "share of beams measured", "LMS111 (dots: beams, lines: formula)")
    return figure


def panes() -> Figure:
    """A glass front and a mirror from above."""
    figure, (glass, mirror) = _figure(2, height=3.8)
    sides = box_xml(-1.3, 4.1, (2.7, 0.1, 2.0), "wall") + box_xml(
        -1.3, -4.1, (2.7, 0.1, 2.0), "wall"
    )
    around = sides + box_xml(6.1, 1.5, (0.1, 3.0, 2.0), "wall")
    scanner = bench_scanner(
        effects=replace(LIDARS["sick_lms111"].effects(), bias=None), sigma=0.012
    )
    for axes, material in ((glass, "glass"), (mirror, "mirror")):
        bench = OpticalBench(pane_xml(1.5, material=material) + around)
        for scan in bench.sweeps(4, scanner):
            x, y = _points(scan)
            own, wall_behind = np.abs(x - 1.497) < 0.08, np.abs(x - 6.0) < 0.15
            own &= np.abs(y) < 3.8
            ghost = ~own & (x > 1.5) & ~(wall_behind & (material == "glass"))
            for chosen, colour, size in (
                (~own & ~ghost, _COLOURS[0], 4),
                (ghost, _COLOURS[1], 6),
                (own, _COLOURS[2], 9),
            ):
                axes.scatter(y[chosen], x[chosen], s=size, color=colour, linewidths=0)
        axes.plot([-4.0, 4.0], [1.5, 1.5], color=_COLOURS[5], lw=1.0)
        for across in (-4.0, 4.0):
            axes.plot([across, across], [-4.0, 1.4], color="#cccccc", lw=4, zorder=0)
        axes.plot([-1.5, 4.5], [6.0, 6.0], color="#cccccc", lw=4, zorder=0)
        axes.plot(0.0, 0.0, "k^", ms=6)
        axes.set_xlim(5.5, -5.5)
        axes.set_ylim(-4.5, 7.5)
        axes.set_aspect("equal")
        _label(axes, "y [m]", "x [m]", f"{material} at x = 1.5 m")
    for colour, text in (
        (_COLOURS[0], "walls, some through the pane"),
        (_COLOURS[2], "the pane itself: glint, or dust near by"),
        (_COLOURS[1], "ghosts by mirroring"),
    ):
        mirror.plot([], [], "o", ms=3, color=colour, label=text)
    mirror.legend(fontsize=6.5, loc="lower center", framealpha=1.0)
    return figure


def sunlight() -> Figure:
    """An open yard in the shade and in full sun, and the largest range of a dark wall."""
    figure, (yard, reach) = _figure(2, height=3.4)
    things = box_xml(6.0, 2.0, (0.1, 2.0, 2.0), "wall") + box_xml(
        3.0, -3.0, (1.5, 0.2, 2.0), "brick"
    )
    bench = OpticalBench(things)
    for level, colour, size in ((1.0, _COLOURS[1], 5), (0.0, _COLOURS[0], 5)):
        effects = Effects(sensitivity=Sensitivity(), sunlight=Sunlight(level))
        scans = bench.sweeps(15, bench_scanner(sigma=0.012, effects=effects))
        x, y = np.hstack([_points(scan) for scan in scans])
        name = "full sun: made-up echoes in the open" if level else "shade"
        yard.scatter(y, x, s=size, color=colour, linewidths=0, label=name)
    yard.plot(0.0, 0.0, "k^", ms=6)
    yard.set_xlim(20, -20)
    yard.set_ylim(-15, 20)
    yard.legend(fontsize=7, loc="upper right")
    _label(yard, "y [m]", "x [m]", "an open yard, 15 sweeps each")
    distances = np.arange(8.0, 26.0, 0.75)
    for level, colour in ((0.0, _COLOURS[0]), (0.5, _COLOURS[4]), (1.0, _COLOURS[1])):
        effects = Effects(sensitivity=Sensitivity(), sunlight=Sunlight(level, false_echoes=0.0))
        shares = [
            np.isfinite(_ahead(x, "dark_fabric", effects, range_max=40.0)).mean() for x in distances
        ]
        power = received_power(np.full(100, 0.1), np.linspace(8.0, 26.0, 100))
        line = detection_chances(power, Sensitivity(), level)
        reach.plot(np.linspace(8.0, 26.0, 100), line, color=colour, lw=1.0)
        reach.plot(distances, shares, "o", ms=3, color=colour, label=f"sun {level:g}")
    reach.legend(fontsize=7)
    _label(reach, "distance [m]", "share measured", "a surface of 10 % remission, LMS111")
    return figure


@dataclass(frozen=True)
class _Walker:
    """A plate 0.5 m wide that moves straight ahead."""

    velocity: tuple[float, float]
    name: str = "walker"

    def pose_at(self, times: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return positions (N, 3) [m] and yaws (N,) [rad] at ``times`` (N,) [ns]."""
        x, y = (v * 1e-9 * times for v in self.velocity)
        return np.stack([2.0 + x, y, 0.0 * x], axis=1), np.zeros(len(times))


def moving() -> Figure:
    """A plate that approaches or passes while the mirror turns."""
    figure, (nearing, passing) = _figure(2)
    plate = '<body name="walker" mocap="true" pos="2 0 0">'
    plate += '<geom type="box" size="0.05 0.25 0.9" pos="0.05 0 0"/></body>'
    scanner = bench_scanner(field_of_view=math.radians(60.0), resolution=math.radians(0.02))
    for speed, colour in ((1.4, _COLOURS[0]), (0.0, _GREY), (-1.4, _COLOURS[1])):
        (scan,) = OpticalBench(plate, [_Walker((speed, 0.0))]).sweeps(1, scanner)
        x, y = _points(scan)
        at = scan.offsets[np.isfinite(scan.ranges)]
        nearing.plot(y, 1e3 * speed * 1e-9 * at, color=colour, lw=0.8)
        label = f"{speed:g} m/s along x"
        nearing.plot(y[::25], 1e3 * (x[::25] - 2.0), ".", ms=4, color=colour, label=label)
        (scan,) = OpticalBench(plate, [_Walker((0.0, speed))]).sweeps(1, scanner)
        _, y = _points(scan)
        row = speed / 1.4
        passing.plot(1e3 * y[::20], np.full(len(y[::20]), row), ".", ms=3, color=colour)
        text = f"{speed:g} m/s along y: {1e3 * np.ptp(y):.0f} mm wide"
        passing.annotate(text, (240.0, row + 0.15), fontsize=7)
    nearing.legend(fontsize=7, loc="upper center", ncols=1)
    nearing.set_ylim(-18.0, 34.0)
    nearing.set_xlim(0.3, -0.3)
    _label(nearing, "y [m]", "x - 2 m [mm]", "a plate that comes or goes, 10 Hz")
    passing.set_xlim(300.0, -300.0)
    passing.set_ylim(-1.5, 1.7)
    passing.set_yticks([])
    _label(passing, "y [mm]", "", "a plate 500 mm wide that goes past")
    return figure


def bias_and_steps() -> Figure:
    """Errors of units of each model on a white wall at 5 m."""
    figure, panels = _figure(len(LIDARS), width=9.0, height=2.6)
    for axes, model in zip(panels, LIDARS.values(), strict=True):
        effects = replace(NO_EFFECTS, bias=model.effects().bias)
        effects = replace(effects, quantisation=model.effects().quantisation)
        for colour, seed in zip(_COLOURS, (1, 3, 4), strict=False):
            scanner = bench_scanner(
                effects=effects,
                sigma=model.sigma,
                field_of_view=_NARROW[0],
                resolution=_NARROW[1],
            )
            (scan,) = OpticalBench(wall_xml(5.0)).sweeps(1, scanner, seed=seed)
            steps = 1e3 * max(model.quantum, 0.002)
            bins = np.arange(-80.0 - 500.0 * model.quantum, 80.0, steps)
            axes.hist(1e3 * (scan.ranges - 5.0), bins=bins.tolist(), color=colour, histtype="step")
        bound = 1e3 * model.systematic
        axes.axvspan(-bound, bound, color="#eeeeee", zorder=0)
        axes.set_yticks([])
        _label(axes, "error [mm]", "", model.name)
    panels[0].set_ylabel("three units' beams")
    return figure


def allan() -> Figure:
    """Allan deviation of simulated units at rest, and of their data sheets."""
    figure, panels = _figure(2, height=3.4)
    times = np.geomspace(0.04, 2000.0, 26)
    hours = 4
    for colour, model in zip(_COLOURS, INERTIAL_UNITS.values(), strict=False):
        unit = InertialUnit(InertialConfig.of(model.name), np.random.SeedSequence(1))
        still = np.zeros((round(3600.0 / READING_SECONDS), 2, 3))
        readings = np.vstack([unit.readings(still) for _ in range(hours)])
        for kind, (axes, drift, scale) in enumerate(
            ((panels[0], model.gyro, math.degrees(3600.0)), (panels[1], model.force, 1e6 / 9.80665))
        ):
            measured = allan_deviation(readings[:, kind], READING_SECONDS, times)
            axes.loglog(times, scale * drift.allan_deviation(times), color=colour, lw=1.0)
            axes.loglog(times, scale * measured, ".", ms=3, color=colour)
            axes.loglog([], [], "o-", ms=3, color=colour, label=model.title.split(",")[0])
            axes.axhline(scale * drift.instability, color=colour, lw=0.7, ls=":")
    panels[0].legend(fontsize=7)
    title = f"{hours} h at rest (dots: three axes; line: sheet)"
    _label(panels[0], "averaging time [s]", "gyro [deg/h]", title)
    _label(panels[1], "averaging time [s]", "accelerometer [ug]", "dotted: bias instability")
    return figure


PLOTS: Final[dict[str, Callable[[], Figure]]] = {
    "sensors-models": models,
    "sensors-mixing": mixing,
    "sensors-spreading": spreading,
    "sensors-sensitivity": sensitivity,
    "sensors-panes": panes,
    "sensors-sunlight": sunlight,
    "sensors-moving": moving,
    "sensors-bias": bias_and_steps,
    "sensors-allan": allan,
}
"""Figures by the name of their file."""


def draw(folder: Path) -> list[Path]:
    """Draw all figures into ``folder`` and return their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    with rc_context({"font.size": 8}):
        for name, plot in PLOTS.items():
            paths.append(folder / f"{name}.png")
            plot().savefig(paths[-1], dpi=90)
    return paths


if __name__ == "__main__":
    draw(Path(sys.argv[1] if len(sys.argv) > 1 else "docs/images"))
