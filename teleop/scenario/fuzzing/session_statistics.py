"""What single sessions cannot show: shares over all of them, each tested on both sides."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from typing import TypeAlias

import numpy as np
from scipy.stats import binomtest

from teleop.package_data import assets
from teleop.scenario.fuzzing.judged_session import JudgedSession

_ALARM = 1e-4
"""Probability below which a share or a mean is no accident."""
_NEES = (0.1, 50.0)
"""A session's NEES counts as no less and no more than this: one that went astray shall not hide the others."""
_TICK = 0.02
"""Times count as no less [s]."""
_FEWEST = 8
"""Least number of sessions that are compared."""


@dataclass(frozen=True, slots=True)
class Reference:
    """What the robot has shown in many sessions; ``assets/fuzzing/reference.json``."""

    sessions: int
    """Number of sessions."""
    carried: int
    """How often the robot was carried off."""
    noticed: float
    """Share of these times of which it said so within two seconds."""
    log_said_after: float
    """Mean of the logarithms of the time after which it said so [ln s], where it did within two seconds."""
    log_said_after_sigma: float
    """Their standard deviation."""
    log_nees: float
    """Mean of the logarithms of the sessions' median NEES in quiet times."""
    log_nees_sigma: float
    """Their standard deviation."""
    tracking: float
    """Mean of the sessions' shares of quiet times in which the robot says ``tracking``."""
    tracking_sigma: float
    """Their standard deviation."""


@dataclass(frozen=True, slots=True)
class Comparison:
    """A figure of a campaign beside the reference."""

    name: str
    """Name of the figure."""
    value: float
    """The figure."""
    expected: float
    """That of the reference."""
    count: int
    """Number of values that it was computed from."""
    probability: float
    """Probability of a difference as large as this one, by chance."""

    @property
    def differs(self) -> bool:
        """Whether it differs, on either side."""
        return self.count >= _FEWEST and self.probability < _ALARM


def reference() -> Reference:
    """Return the shipped reference."""
    text = (assets() / "fuzzing" / "reference.json").read_text(encoding="utf-8")
    return Reference(**json.loads(text))


def reference_of(sessions: Iterable[JudgedSession]) -> Reference:
    """Return the reference that sessions give."""
    judged = list(sessions)
    logs, said = _log_nees(judged), _log_said_after(judged)
    carried = sum(len(each.said_after) for each in judged)
    tracking = _tracking(judged)
    return Reference(
        len(judged),
        carried,
        # Laplace's rule of succession: what was never seen to fail may fail.
        (len(said) + 1) / (carried + 2),
        float(said.mean()),
        float(said.std(ddof=1)),
        float(logs.mean()),
        float(logs.std(ddof=1)),
        float(tracking.mean()),
        float(tracking.std(ddof=1)),
    )


def to_json(of: Reference) -> str:
    """Return a reference as the text of its file."""
    return json.dumps(asdict(of), indent=2) + "\n"


def compare(sessions: Iterable[JudgedSession], expected: Reference) -> tuple[Comparison, ...]:
    """Compare sessions with the reference."""
    judged, was = list(sessions), expected
    carried, said = sum(len(each.said_after) for each in judged), _log_said_after(judged)
    share = len(said) / carried if carried else math.nan
    chance = binomtest(len(said), carried, was.noticed).pvalue if carried else 1.0
    time = (said, was.log_said_after, was.log_said_after_sigma, was.carried)
    nees = (_log_nees(judged), was.log_nees, was.log_nees_sigma, was.sessions)
    tracking = (_tracking(judged), was.tracking, was.tracking_sigma, was.sessions)
    return (
        Comparison("carried off and said so", share, was.noticed, carried, float(chance)),
        _compared("seconds until it said so", *time, shown=math.exp),
        _compared("NEES in quiet times", *nees, shown=math.exp),
        _compared("tracking in quiet times", *tracking, shown=float),
    )


Values: TypeAlias = np.ndarray[tuple[int], np.dtype[np.float64]]


def _compared(
    name: str,
    values: Values,
    mean: float,
    sigma: float,
    count: int,
    *,
    shown: Callable[[float], float],
) -> Comparison:
    """Compare the mean of values with that of so many others."""
    if not len(values):
        return Comparison(name, math.nan, shown(mean), 0, 1.0)
    found = float(values.mean())
    spread = max(sigma, 1e-3) * math.sqrt(1.0 / len(values) + 1.0 / count)
    chance = math.erfc(abs(found - mean) / spread / math.sqrt(2.0))
    return Comparison(name, shown(found), shown(mean), len(values), chance)


def _log_said_after(sessions: Iterable[JudgedSession]) -> Values:
    """Return the logarithms of the times after which robots said that they were carried off [ln s]."""
    values = [time for each in sessions for time in each.said_after if math.isfinite(time)]
    return np.log(np.maximum(np.array(values, dtype=np.float64), _TICK))


def _tracking(sessions: Iterable[JudgedSession]) -> Values:
    """Return the shares of tracking of the sessions that have one."""
    values = [each.tracking for each in sessions if math.isfinite(each.tracking)]
    return np.array(values, dtype=np.float64)


def _log_nees(sessions: Iterable[JudgedSession]) -> Values:
    """Return the logarithms of the median NEES of the sessions that have one."""
    values = [each.nees for each in sessions if math.isfinite(each.nees)]
    return np.log(np.clip(np.array(values, dtype=np.float64), *_NEES))
