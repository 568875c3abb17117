"""Correction of the state by one sweep.

KISS-ICP observes how the robot moved since the last sweep, and the wheels are compared with it. The sweep is
registered against the cloud with the prediction as prior; where no gyro accompanies the wheels, KISS-ICP's
motion is part of the prediction. A sweep that fits the map but contradicts the prediction is tried again with wider
priors while the wheels slip or the pose is doubtful; a sweep that does not fit is rejected; all others correct the
filter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from localization.config import LocalizerConfig
from localization.filter.ekf import FilterState, mark
from localization.filter.pose_error import LEVER, difference
from localization.filter.updates import (
    CORRELATION,
    between,
    match_nis,
    relative_nis,
    update_height,
    update_level,
    update_match,
    update_relative,
    update_tilt,
    widen,
)
from localization.matching.matchers import MatchSweep
from localization.matching.scan_consistency import explanation
from localization.monitoring.health import Refusal, unobservable_axes
from localization.motion.kiss_odometry import ObservedMotion
from localization.pipeline.registration_cache import SweepRecord
from localization.pipeline.resources import Resources
from localization.pipeline.state import LastSweep, State
from localization.types import SECOND, Match, Pose, ScanConsistency

_GROUND = 0.05
"""Error of a robot's height over the mapped ground, one sigma [m]: a third of a kerb, a small ramp, and the noise of the
ground's cells on a slope."""
_SAMPLING = 0.02
"""The share of a sweep that the map explains differs by this much between poses that are equally good."""
_HARMLESS = 0.05
"""A match from a wider prior may depart by this much in directions that the sweep does not observe [m]."""
_NEARLY = 0.05
"""With a wider prior a share of the sweep must be explained that is larger than before, or as large, by this much at least
or at most."""
_TURNS = (0.0, -0.4, 0.4, -1.0, 1.0, -2.0, 2.0)
"""Headings that are tried for a sweep that does not fit, in sigma of the widest prior: registration finds what
is half of that away between walls a few metres off, and less between those far away."""
_NONE_USED = np.zeros((0, 6))
"""No direction of a match was used."""


@dataclass(frozen=True, slots=True, eq=False)
class Registration:
    """The result of registering a sweep; all None if it was not registered."""

    match: Match | None = None
    """The match."""
    nis: float | None = None
    """Its normalised innovation squared."""
    consistency: ScanConsistency | None = None
    """Agreement of the sweep with the map."""
    refusal: Refusal | None = None
    """Why it was rejected, if it was."""


def corrected_by_sweep(
    state: State, record: SweepRecord, r: Resources
) -> tuple[State, Registration]:
    """Return the state corrected by a sweep, and the sweep's registration.

    Args:
        state: predicted to the sweep's stamp.
        record: of the sweep; what it holds already is not computed again, and what is computed is added.
        r: map, settings and methods.
    """
    config, sweep, before = r.config, record.sweep, state.last
    elapsed = (sweep.stamp - before.stamp) / SECOND
    with r.stage("ekf"):
        if config.sensors.flat:
            filter_ = update_level(state.filter, config.ekf)
        else:
            filter_ = update_tilt(state.filter, config.ekf, elapsed)
            if state.placed and r.world.ground.seen:
                (under,) = r.world.ground.heights(filter_.pose.position[None, :2])
                above = float(filter_.pose.position[2] - under)
                filter_ = update_height(filter_, above, _GROUND)
    # After it: what slip adds to the covariance is taken away by the motion that is observed, and by nothing between.
    state, observed = _observed_motion(state._replace(filter=filter_), record, elapsed, r)
    registration = Registration()
    if state.placed and r.match is not None:
        state, registration = _matched(state, record, observed, r.match, elapsed, r)
    elif state.placed and observed is not None:
        filter_ = update_relative(state.filter, before.map_from_base, *observed, _NONE_USED)
        state = state._replace(filter=filter_)
    state = _with_way_since_placement(state, observed, sweep.stamp, config)
    way = before.map_from_base.inverse() @ state.filter.pose
    rates = np.array([*way.position[:2], way.yaw]) / max(elapsed, 1e-3)
    last = LastSweep(
        sweep.stamp,
        state.odom_from_base,
        state.filter.pose,
        state.listening.total,
        tuple(rates.tolist()),
    )
    agreed = state.agreed if state.wheels.slipping else last
    return state._replace(filter=mark(state.filter), last=last, agreed=agreed), registration


def _observed_motion(
    state: State, record: SweepRecord, elapsed: float, r: Resources
) -> tuple[State, ObservedMotion | None]:
    """Observe the motion since the last sweep by KISS-ICP, and compare the wheels with it."""
    wheels, kiss, filter_ = state.wheels, state.kiss, state.filter
    if not r.config.kiss_odometry:
        return state._replace(wheels=wheels.after_sweep()), None
    with r.stage("kiss odometry"):
        if record.view is not None and record.view.map_id is kiss.map_id:
            kiss, observed = r.kiss.repeat(kiss, record.view)
        else:
            moved = state.last.odom_from_base.inverse() @ state.odom_from_base
            kiss, observed, record.view = r.kiss.add(kiss, record.sweep, moved)
    if observed is None:
        return state._replace(kiss=kiss, wheels=wheels.after_sweep()), None
    if r.config.sensors.displaced:
        # Wheels without a gyro and KISS-ICP are weighed against each other when the sweep is registered.
        return state._replace(kiss=kiss, wheels=wheels.after_sweep()), observed
    elapsed = max(elapsed, 1e-3)
    if wheels.plausible(observed, elapsed):
        wheels, misled = wheels.compared(observed, elapsed, filter_)
        for sigma in r.config.retry_sigma[:1] if misled else ():
            filter_ = widen(filter_, *sigma)
    else:
        # The next alignment would start from there, and be worse: people who walk past the scanner can
        # make KISS-ICP follow them.
        kiss, observed = kiss.restarted(), None
    return state._replace(kiss=kiss, wheels=wheels.after_sweep(), filter=filter_), observed


def _matched(
    state: State,
    record: SweepRecord,
    observed: ObservedMotion | None,
    matcher: MatchSweep,
    elapsed: float,
    r: Resources,
) -> tuple[State, Registration]:
    """Register a sweep, decide whether to believe it, and correct the filter."""
    config, ekf, wheels, filter_ = r.config, r.config.ekf, state.wheels, state.filter
    share, relative = _share(state, elapsed, config), observed
    contradicted = observed is not None and _contradicts(state, observed, config)
    # A witness that begins where wheels lead that were wrong a moment ago may copy them.
    copied = config.sensors.displaced and wheels.slipping
    if observed is not None and (contradicted or copied):
        wheels, relative = wheels.contradicted() if contradicted else wheels, None
        filter_, match, nis = _registered_by_witnesses(state, observed, record, matcher, share, r)
    else:
        if observed is not None and config.sensors.displaced:
            relative = None
            filter_ = update_relative(filter_, state.last.map_from_base, *observed, _NONE_USED)
        match, nis = _registered(filter_, record, matcher, share, r)
    refusal = _refusal(match, nis, r)
    misled = config.sensors.displaced or wheels.slipping
    fits = match.inlier_ratio >= config.good_inlier_ratio
    elsewhere = refusal is not None and fits and (misled or state.health.doubtful)
    badly = config.sensors.displaced and match.inlier_ratio < config.retry_below
    if elsewhere or badly:
        starts = _starts(state, filter_, contradicted=contradicted) if badly else ()
        least = match.inlier_ratio + (-_NEARLY if elsewhere else _NEARLY)
        wider = _registered_wider(filter_, record, matcher, share, least, starts, r)
        if wider is not None:
            (filter_, match, nis), refusal = wider, None
            wheels = wheels.contradicted() if misled else wheels
    with r.stage("ekf"):
        if relative is not None:
            used = match.observable_directions if refusal is None else _NONE_USED
            filter_ = update_relative(filter_, state.last.map_from_base, *relative, used)
        if refusal is None:
            filter_ = update_match(filter_, ekf, match, r.map_noise)
    with r.stage("scan consistency"):
        if record.consistency is None:
            record.consistency = r.beams.classify(record.sweep, filter_.pose, match.distances)
    if refusal is None and "forward" not in unobservable_axes(match, filter_.pose):
        way = state.last.map_from_base.inverse() @ filter_.pose
        sigma = _sigma_along(filter_)
        wheels = wheels.shown_by_map(float(way.position[0]), max(elapsed, 1e-3), sigma)
    elif refusal is not None and not refusal.elsewhere:
        reason = explanation(match.inlier_ratio, record.consistency)
        refusal = replace(refusal, reason=reason)
    state = state._replace(wheels=wheels, filter=filter_)
    return state, Registration(match, nis, record.consistency, refusal)


def _share(state: State, elapsed: float, config: LocalizerConfig) -> float:
    """Return the share of a sweep's information that counts.

    Sweeps from one place share the errors of the map there. Where motion comes as displacements, stamps may
    be bursts, and a sweep counts in full once the robot has moved on.
    """
    share = elapsed / CORRELATION
    if config.sensors.displaced:
        moved = state.last.odom_from_base.inverse() @ state.odom_from_base
        distance = float(np.hypot(*moved.position[:2])) + LEVER * abs(moved.yaw)
        share = max(share, distance / config.sweep_distance)
    return min(1.0, share)


def _contradicts(state: State, observed: ObservedMotion, config: LocalizerConfig) -> bool:
    """Return whether KISS-ICP contradicts wheels that no gyro accompanies, by more than both allow."""
    if not config.sensors.displaced:
        return False
    return relative_nis(state.filter, state.last.map_from_base, *observed) > config.ekf.gate(3)


def _registered_by_witnesses(
    state: State,
    observed: ObservedMotion,
    record: SweepRecord,
    matcher: MatchSweep,
    share: float,
    r: Resources,
) -> tuple[FilterState, Match, float]:
    """Register a sweep from where the wheels say the robot is, from where KISS-ICP says so, and as if it had gone on.

    One of the two is wrong, and neither knows which; where wheels stall in a turn, KISS-ICP may have begun too far off, and
    once they have caught up they lead from where both agreed last. The difference of the two is a possible error of all, and
    the map decides; that which nobody observed must clearly fit better.

    Returns:
        The filter that predicts the best of the matches, the match and its NIS.
    """
    best: tuple[FilterState, Match, float] | None = None
    last = state.last
    rolled, seen = between(state.filter, last.map_from_base, observed[0])
    on = last.map_from_base @ last.moved_on((record.sweep.stamp - last.stamp) / SECOND)
    tried = [rolled, seen, replace(rolled, pose=on)]
    if state.agreed.stamp != last.stamp:
        caught_up = state.agreed.carried(state.odom_from_base)
        tried.insert(2, replace(rolled, pose=caught_up))
    for filter_ in tried:
        match, nis = _registered(filter_, replace(record, match=None), matcher, share, r)
        if best is None or match.inlier_ratio > best[1].inlier_ratio + _SAMPLING:
            best = filter_, match, nis
    assert best is not None
    return best


def _starts(state: State, filter_: FilterState, *, contradicted: bool) -> tuple[Pose, ...]:
    """Return where motion sensors may have led: there headings are tried for a sweep that does not fit.

    Loggers stall: one pose comes for a second, and then all of the motion at once, which scanner and map have seen
    already. It leads from where the wheels agreed with them last.
    """
    starts = (filter_.pose, state.filter.pose) if contradicted else (filter_.pose,)
    if state.agreed.stamp == state.last.stamp:
        return starts
    return (*starts, state.agreed.carried(state.odom_from_base))


def _registered_wider(
    filter_: FilterState,
    record: SweepRecord,
    matcher: MatchSweep,
    share: float,
    least: float,
    starts: Sequence[Pose],
    r: Resources,
) -> tuple[FilterState, Match, float] | None:
    """Register a sweep again with wider priors; None if the map does not explain at least a share of it there.

    With a gyro only sweeps that are rejected though they fit well are tried again, and only while the wheels slip or once
    the pose is doubtful: of a robot that was carried off, a sweep may fit near its old place by chance. Wheels that no
    gyro accompanies may be wrong by any amount: a sweep that fits badly is tried with other headings, too.

    Args:
        filter_: the prediction.
        record: of the sweep.
        matcher: registers it.
        share: of its information that counts.
        least: share of it that must fit.
        starts: where motion sensors say that the robot is; the headings around are tried there.
        r: settings.
    """
    wide, near = filter_, None
    for sigma in r.config.retry_sigma:
        wide = widen(filter_, *sigma)
        match, nis = _registered(wide, replace(record, match=None), matcher, share, r)
        found = match.inlier_ratio >= least and _refusal(match, nis, r) is None
        if found and _unobserved_shift(filter_, match) < _HARMLESS:
            near = wide, match, nis
            if not starts or match.inlier_ratio >= r.config.retry_below:
                return near
            least = match.inlier_ratio + _SAMPLING
    least = max(least, r.config.good_inlier_ratio)
    return _registered_turned(wide, record, matcher, share, least, starts, r) or near


def _registered_turned(
    wide: FilterState,
    record: SweepRecord,
    matcher: MatchSweep,
    share: float,
    least: float,
    starts: Sequence[Pose],
    r: Resources,
) -> tuple[FilterState, Match, float] | None:
    """Register a sweep from several headings at several places; None if no such share of it fits from any.

    Wheels that no gyro accompanies miss tens of degrees of a quick turn, and between walls that a robot sees
    turned by as much, registration ends at a pose that explains less than half of the sweep.
    """
    best: tuple[FilterState, Match, float] | None = None
    sigma = float(wide.covariance[5, 5]) ** 0.5
    for turns, start in product(_TURNS, starts):
        at = replace(wide, pose=start @ Pose.planar(0.0, 0.0, turns * sigma))
        match, _ = _registered(at, replace(record, match=None), matcher, share, r)
        if match.inlier_ratio < least or not len(match.observable_directions):
            continue
        # Whether the robot can be there is asked of the place that the heading was tried at.
        prior = replace(wide, pose=start)
        nis = match_nis(prior, match)
        better = best is None or match.inlier_ratio > best[1].inlier_ratio
        if better and _refusal(match, nis, r) is None:
            best = prior, match, nis
            if match.inlier_ratio >= r.config.retry_below:
                break
    return best


def _unobserved_shift(filter_: FilterState, match: Match) -> float:
    """Return how far a match departs from the prediction in directions that it does not observe [m, LEVER]."""
    off = difference(filter_.pose, match.map_from_base) * np.repeat([1.0, LEVER], 3)
    w = match.observable_directions
    return float(np.linalg.norm(off - w.T @ (w @ off)))


def _registered(
    filter_: FilterState, record: SweepRecord, matcher: MatchSweep, share: float, r: Resources
) -> tuple[Match, float]:
    """Return the match of a sweep, with a share of its information, and its NIS."""
    prior, match = filter_.pose, record.match
    same = r.config.late_readings.same
    if match is None or record.prior is None or not same(record.prior, prior):
        with r.stage("registration"):
            match = matcher(record.sweep, prior, filter_.covariance)
        record.prior, record.match, record.consistency = prior, match, None
    if share != 1.0:
        ranges = match.ranges and match.ranges.counted(share)
        match = replace(match, information=share * match.information, ranges=ranges)
    constrained = len(match.observable_directions) > 0
    return match, match_nis(filter_, match) if constrained else 0.0


def _refusal(match: Match, nis: float, r: Resources) -> Refusal | None:
    """Return why a match is rejected; None if it is believed."""
    k = len(match.observable_directions)
    if k == 0 or match.inlier_ratio < r.config.min_inlier_ratio:
        return Refusal("the map does not explain the sweep")
    gate = r.config.ekf.gate(k)
    if nis > gate:
        where = "the sweep fits the map where the robot cannot be"
        return Refusal(f"{where} (NIS {nis:.0f} of {gate:.0f})", nis - gate)
    return None


def _sigma_along(filter_: FilterState) -> float:
    """Return the standard deviation of the position along the robot's heading [m]."""
    forward = filter_.pose.rotation[:, 0]
    return float(np.sqrt(forward @ filter_.covariance[:3, :3] @ forward))


def _with_way_since_placement(
    state: State, observed: ObservedMotion | None, now: int, config: LocalizerConfig
) -> State:
    """Carry the estimate before the last placement on, while the placement can be undone."""
    replaced = state.replaced
    if replaced is None:
        return state
    if now - replaced.stamp > config.undo_memory:
        return state._replace(replaced=None)
    # The first sweep after a placement observed more than the way since then.
    seen = observed if replaced.steps is not None else None
    attitude = state.last.carried(replaced.odom_from_base).rotation
    return state._replace(
        replaced=replaced.extended(
            state.odom_from_base, state.filter.motion_covariance, attitude, seen
        ),
    )
