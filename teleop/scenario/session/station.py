"""The station that a scenario asks for: its process, and what it is given to go by."""

from __future__ import annotations

import json
import shlex
import sys
from pathlib import Path
from typing import Final

import numpy as np

from localization.extras import has
from localization.types import Hint, Pose
from teleop.scenario.files.operator_settings import Station
from teleop.scenario.session.session import SECOND, Session

COMMAND: Final = f"exec {shlex.quote(sys.executable)} -m teleop.scenario.tour.station"
"""Command line of the station's process."""
ORDERS: Final = "FARSTEER_STATION"
"""Environment variable of its orders, as JSON."""
RECORDING: Final = "operator.rrd"
"""What the station has seen, in the run's folder."""
PATIENCE: Final = 120.0
"""Real time within which the station must connect, and call for each step [s]."""
HINT_STAMP: Final = SECOND
"""Robot time at which the hint is given [ns]."""


def station_environment(session: Session, station: Station, folder: Path) -> dict[str, str]:
    """Return the environment of a station's process, besides what each client gets to know.

    Args:
        session: The session.
        station: Its settings.
        folder: Folder of the run.
    """
    scenario = session.scenario
    hint = station_hint(station, scenario.seed, session.simulation.truth().map_from_base)
    orders = {
        "speed": station.speed,
        "hint_stamp": hint.stamp,
        "hint_position": hint.map_from_base.position.tolist(),
        "hint_quaternion_wxyz": hint.map_from_base.quaternion_wxyz.tolist(),
        "hint_covariance": hint.covariance.ravel().tolist(),
        "recording": str(folder.resolve() / RECORDING) if has("rerun") else None,
        "camera": session.camera is not None,
    }
    return {ORDERS: json.dumps(orders), "OPENBLAS_NUM_THREADS": "1", "RUST_LOG": "error"}


def station_hint(station: Station, seed: int, true: Pose) -> Hint:
    """Return the hint of a station: the true first pose, displaced and turned in a direction given by the seed.

    Args:
        station: The station's settings.
        seed: Seed of the scenario.
        true: The true first pose, ``map_from_base``.
    """
    rng = np.random.default_rng(np.random.SeedSequence([seed, 1]))
    bearing = rng.uniform(-np.pi, np.pi)
    turn = np.deg2rad(station.turned) * rng.choice([-1.0, 1.0])
    x = float(true.position[0] + station.off * np.cos(bearing))
    y = float(true.position[1] + station.off * np.sin(bearing))
    variances = np.zeros(6)
    variances[:2] = station.sigma**2
    variances[5] = np.deg2rad(station.sigma_heading) ** 2
    return Hint(HINT_STAMP, Pose.planar(x, y, true.yaw + turn), np.diag(variances))
