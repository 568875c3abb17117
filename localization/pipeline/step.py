"""One step of the localiser: the next state from a state and a reading, and the events that come of it.

Wheels and gyro predict, or their substitutes. When a sweep is complete it is deskewed and registered against
the cloud with the prediction as prior, and the filter takes over what the registration constrains. Hints and
loss begin a search that runs in parallel, a little each tick.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum, auto
from typing import TypeAlias

import numpy as np

from localization.config import LocalizerConfig
from localization.filter.covariance import horizontal_sigma
from localization.filter.ekf import with_pose
from localization.filter.pose_error import difference
from localization.monitoring.belief import evidence_unmoved, new_evidence, probably_carried
from localization.monitoring.health import HealthMonitor
from localization.monitoring.jump_detection import Change, JumpDetector
from localization.monitoring.silence_detection import SourceTimes, is_silence, with_reading
from localization.motion.deskew import deskew
from localization.motion.motion_model import Increment
from localization.pipeline.events import (
    Events,
    PlacementUndone,
    RobotPlaced,
    ScanDropped,
    SweepProcessed,
)
from localization.pipeline.motion_prediction import predict_motion
from localization.pipeline.registration_cache import SweepRecord
from localization.pipeline.resources import Resources
from localization.pipeline.state import State
from localization.pipeline.sweep_update import Registration, corrected_by_sweep
from localization.pipeline.undo import ReplacedEstimate
from localization.relocalization.relocalizer import Placement
from localization.relocalization.verification import SETTLING_SIGMA, same_place
from localization.types import (
    SECOND,
    Hint,
    Inertial,
    PointScan,
    Pose,
    Reading,
    Scan,
    Verdict,
    WheelSpeeds,
)


class Command(Enum):
    """What an operator may order."""

    SEARCH_MAP = auto()
    """Search the whole map with the next sweep."""
    UNDO = auto()
    """Undo the last placement."""


@dataclass(frozen=True, slots=True)
class LeftOut:
    """A scan that came, but is not processed, so that the localiser keeps up with its robot."""

    scan: Scan | PointScan
    """The scan."""


Input: TypeAlias = Reading | LeftOut | Command | Placement
"""What a step takes: a reading, a scan that is left out, an operator's command, or a pose to take over."""


def step(state: State, item: Input, r: Resources) -> tuple[State, Events]:
    """Return the state after a reading or a command, and the events.

    Args:
        state: before; it stays as it is.
        item: a reading, in the order of time, or a command.
        r: map, settings and methods.
    """
    match item:
        case Command.SEARCH_MAP:
            # An operator asks where the robot is: it may be anywhere.
            health = state.health.unwitnessed()
            return state._replace(search=state.search.with_request(), health=health), ()
        case Command.UNDO:
            return _undone(state, r.config)
        case Placement():
            return _placed(state, item, r)
        case Hint():
            return _hinted(state, item, r)
        case LeftOut():
            received = _noted(state, item.scan)
            return state._replace(received=received, left_out=state.left_out + 1), ()
    state, increment = _received(state, item)
    if increment is None:
        return state, ()
    state = _predicted(state, increment, r)
    state, record, events = _next_sweep(state, r)
    if record is not None:
        blind, before = _drove_blind(state, record, r), state
        state, registration = corrected_by_sweep(state, record, r)
        state = _judged(before, state, record, registration, r, blind=blind)
        if not record.reported:
            record.reported, event = True, _processed(state, record, registration, r.config)
            events += (event,)
        state, placed = _disambiguated(state, record, r)
        events += placed
        if not _from_two_places(state, before, record):
            state = _with_search_begun(state, record, r)
    state, found = _searched(state, r)
    return _with_certainty_checked(state), events + found


def _received(state: State, reading: Reading) -> tuple[State, Increment | None]:
    """Keep a reading, and return the increment of motion if it advances time."""
    scans, received, listened = state.scans, state.received, state.listening.total
    if isinstance(reading, Scan | PointScan):
        scans = scans.received(reading)
        received = _noted(state, reading)
    elif isinstance(reading, WheelSpeeds):
        received = with_reading(received, "wheels", reading.stamp, listened)
    elif isinstance(reading, Inertial):
        received = with_reading(received, "gyro", reading.stamp, listened)
    motion, increment = state.motion.take(reading, state.wheels.velocity)
    return state._replace(motion=motion, scans=scans, received=received), increment


def _noted(state: State, scan: Scan | PointScan) -> Mapping[str, SourceTimes]:
    """Return when readings of each source came, after a scan."""
    return with_reading(state.received, scan.scanner, scan.stamp, state.listening.total)


def _predicted(state: State, increment: Increment, r: Resources) -> State:
    """Move the filter on as wheels and gyro measured."""
    now = increment.stamp
    # Without any motion sensor, scanners that end at the same time advance time only once.
    if state.stamp and now <= state.stamp:
        return state
    if not state.stamp:
        return state._replace(stamp=now, track=state.track.extended(now, state.odom_from_base))
    dt = (now - state.stamp) / SECOND
    state = state._replace(listening=state.listening.advanced(now - state.stamp))
    with r.stage("predict"):
        filter_, wheels, motion = predict_motion(state.filter, state.wheels, increment, dt)
        odom = state.odom_from_base @ motion
        track = state.track.extended(now, odom)
        return state._replace(
            stamp=now, odom_from_base=odom, track=track, filter=filter_, wheels=wheels
        )


def _next_sweep(state: State, r: Resources) -> tuple[State, SweepRecord | None, Events]:
    """Put the next sweep together, if its scans and their motion are complete, and deskew it."""
    span = state.track.span
    scans = state.scans.advanced(span)
    if not scans.complete(span):
        scans, late = scans.without_stale(span, state.stamp)
        unchanged = scans is state.scans
        return (
            state if unchanged else state._replace(scans=scans),
            None,
            tuple(map(ScanDropped, late)),
        )
    state = state._replace(scans=scans.released(), left_out=0)
    path = _way_since(state, min(scan.stamp for scan in scans.scans))
    record = r.cache.find(scans.scans, state.stamp, path)
    if record is None:
        with r.stage("deskew"):
            sweep = deskew(scans.scans, state.track, r.mounts, state.stamp)
            sweep = state.filter.range_bias.removed(sweep)
        record = SweepRecord(scans.scans, path, sweep)
        r.cache.keep(record)
    return state, record, ()


def _way_since(state: State, stamp: int) -> Pose:
    """Return ``base_then_from_base_now`` since a stamp [ns], or the last reading before it."""
    return state.track.before(stamp).inverse() @ state.odom_from_base


def _drove_blind(state: State, record: SweepRecord, r: Resources) -> bool:
    """Return whether the wheels turned while all scanners were silent: slip would have gone unobserved."""
    last, stamp = state.last, record.sweep.stamp
    gap = min(stamp - last.stamp, state.listening.total - last.listened)
    silence = r.config.health.silence
    if gap <= silence or not last.stamp:
        return False
    usual = min(state.received[name].interval for name in {scan.scanner for scan in record.scans})
    moved = last.odom_from_base.inverse() @ state.odom_from_base
    return new_evidence(moved, r.config.belief) and is_silence(gap, usual, silence)


def _judged(
    before: State,
    state: State,
    record: SweepRecord,
    registration: Registration,
    r: Resources,
    *,
    blind: bool,
) -> State:
    """Return the state with what the sweep says of the pose, and a search of the map requested if it needs a check.

    Args:
        before: without the sweep.
        state: corrected by it.
        record: of the sweep.
        registration: of it.
        r: settings.
        blind: whether the robot drove without a sweep before, and may be anywhere.
    """
    # Wheels without a gyro turn too roughly to say where a surface was seen before; the filter has been
    # corrected by the scanner.
    pose = state.filter.pose if r.config.sensors.displaced else state.odom_from_base
    health, search, match = state.health, state.search, registration.match
    mapped = None if match is None else match.mapped(r.config.registration.inlier_distance)
    jump, change = state.jump.compared(record.sweep, pose, mapped)
    if match is not None:
        last = before.last
        elapsed = (record.sweep.stamp - last.stamp) / SECOND
        moved = state.odom_from_base.position - last.odom_from_base.position
        driven = float(np.hypot(*moved[:2]))
        health = health.after_sweep(
            match, state.filter.pose, registration.refusal, elapsed, driven,
            registration.consistency, change, blind,
            state.wheels.slipping,
        )  # fmt: skip
        if not search.checking:
            health = health.after_distance(driven)
    if state.placed and (_newly_carried(before, health) or health.needs_check):
        search = search.with_doubt()
    elif change is not None and not r.config.sensors.displaced and _left(change, r.config):
        search = search.carried_off()
    return state._replace(jump=jump, health=health, search=search)


def _left(change: Change, config: LocalizerConfig) -> bool:
    """Return whether a robot that knows no pose was probably carried off between two sweeps."""
    unmoved = evidence_unmoved(change.unexpected, config.belief)
    return probably_carried(change.seconds, unmoved, config.belief)


def _newly_carried(before: State, health: HealthMonitor) -> bool:
    return health.carried and not before.health.carried


def _processed(
    state: State, record: SweepRecord, registration: Registration, config: LocalizerConfig
) -> SweepProcessed:
    match = registration.match
    explained = match is not None and match.inlier_ratio >= config.good_inlier_ratio
    return SweepProcessed(
        scans=record.scans,
        track=state.track,
        sweep=record.sweep,
        match=match,
        nis=registration.nis,
        consistency=registration.consistency,
        map_from_base=state.filter.pose,
        odom_from_base=state.odom_from_base,
        trusted=explained and not state.health.doubtful,
    )


def _disambiguated(state: State, record: SweepRecord, r: Resources) -> tuple[State, Events]:
    """Compare the places where the robot may be, if there are several, by the sweep."""
    if not state.search.hypotheses.places:
        return state, ()
    with r.stage("hypotheses"):
        search, placement = r.relocalizer.disambiguate(
            state.search, record.sweep, state.odom_from_base, state.current
        )
    checked = state.search.checking and not search.checking and placement is None
    health = state.health.after_check() if checked else state.health
    state = state._replace(search=search, health=health)
    if placement is None:
        return state, ()
    if state.placed and not state.health.lost and not _possible(state, placement, r.config):
        step = placement.map_from_base.position - state.filter.pose.position
        health = replace(state.health, ruled_out=float(np.hypot(*step[:2])))
        return state._replace(health=health), ()
    return _placed(state, placement, r)


def _possible(state: State, placement: Placement, config: LocalizerConfig) -> bool:
    """Return whether the robot can be at a place that is not where it is believed to be.

    It can if it may have been moved without its sensors noticing, or if the place is its own, from which a shove may have
    put the pose by decimetres, or one that the pose's uncertainty allows. Otherwise wheels, gyro and scanner, which have
    led from one pose to the next, outweigh any number of points that another place explains.
    """
    own = same_place(state.filter.pose, placement.map_from_base, config.search)
    if own or state.health.unconfirmed > 0.0:
        return True
    axes = [0, 1, 5]
    off = difference(state.filter.pose, placement.map_from_base)[axes]
    spread = state.filter.covariance + np.diag(np.square(SETTLING_SIGMA))
    return float(off @ np.linalg.solve(spread[np.ix_(axes, axes)], off)) <= config.ekf.gate(3)


def _from_two_places(state: State, before: State, record: SweepRecord) -> bool:
    """Return whether the robot may have been carried, or was placed by hand, while the sweep was made.

    Its first beams are of where the robot was, and a search that begins with it would find that place. The next
    sweep will do. Of scanners that pause for longer than they turn, a sweep is hardly ever of two places.

    Args:
        state: with the sweep.
        before: without it.
        record: the sweep.
    """
    began, ended = min(scan.stamp for scan in record.scans), record.sweep.stamp
    waiting = state.search.search.waiting
    if waiting is not None and began < waiting[0].stamp <= state.stamp:
        return True
    return _newly_carried(before, state.health) and ended - began >= began - before.jump.stamp


def _with_search_begun(state: State, record: SweepRecord, r: Resources) -> State:
    search = r.relocalizer.begin(state.search, record.sweep, state.odom_from_base, state.current)
    return state._replace(search=search)


def _searched(state: State, r: Resources) -> tuple[State, Events]:
    """Compute one tick's share of the search under way."""
    if state.search.search.task is None:
        return state, ()
    with r.stage("search"):
        search, placement, answers = r.relocalizer.advance(
            state.search, state.stamp, state.odom_from_base, state.current
        )
    state = state._replace(search=search)
    if any(answer.verdict is Verdict.AMBIGUOUS for answer in answers):
        # An operator doubts the pose: the motion that led to it rules out no place.
        state = state._replace(health=state.health.unwitnessed())
    if placement is None:
        return state, answers
    state, events = _placed(state, placement, r)
    return state, answers + events


def _with_certainty_checked(state: State) -> State:
    """Return the state, which is lost if the pose has become too uncertain."""
    if not state.placed:
        return state
    health = state.health.after_prediction(horizontal_sigma(state.filter.full_covariance))
    return state if health is state.health else state._replace(health=health)


def _hinted(state: State, hint: Hint, r: Resources) -> tuple[State, Events]:
    odom = state.track.pose_at(hint.stamp) or state.odom_from_base
    search, answers = r.relocalizer.receive(state.search, hint, state.stamp, odom, state.current)
    return state._replace(search=search), answers


def _placed(state: State, placement: Placement, r: Resources) -> tuple[State, Events]:
    """Begin anew at the pose where the robot was found; the estimate before is kept for an undo."""
    replaced = ReplacedEstimate(
        state.stamp,
        placement.reason,
        state.placed,
        state.filter,
        state.health,
        state.odom_from_base,
    )
    health = HealthMonitor.placed(r.config.health, r.config.belief)
    covariance = np.diag(np.square(SETTLING_SIGMA))
    if placement.unseen is not None:
        covariance += placement.unseen
    filter_ = with_pose(state.filter, placement.map_from_base, covariance)
    placed = state._replace(
        filter=filter_,
        placed=True,
        health=health,
        last=state.last.before(filter_.pose, state.odom_from_base),
        agreed=state.last.before(filter_.pose, state.odom_from_base),
        replaced=replaced,
        jump=_without_memory(state, r.config),
    )
    return placed, (RobotPlaced(state.stamp, placement.reason),)


def _without_memory(state: State, config: LocalizerConfig) -> JumpDetector:
    """Return a detector that remembers no pose in the map that was replaced."""
    return JumpDetector(config.jump_detection) if config.sensors.displaced else state.jump


def _undone(state: State, config: LocalizerConfig) -> tuple[State, Events]:
    """Go back to the estimate that the last placement replaced, if it is still known."""
    if state.replaced is None:
        return state, ()
    attitude = state.last.carried(state.replaced.odom_from_base).rotation
    before = state.replaced.extended(
        state.odom_from_base, state.filter.motion_covariance, attitude, None
    )
    filter_ = before.restored(state.filter)
    undone = state._replace(
        filter=filter_,
        placed=before.placed,
        health=before.health,
        last=state.last.before(filter_.pose, state.odom_from_base),
        agreed=state.last.before(filter_.pose, state.odom_from_base),
        replaced=None,
        search=state.search.with_pause(),
        jump=_without_memory(state, config),
    )
    event = PlacementUndone((state.stamp - before.stamp) / SECOND, before.reason)
    return _with_certainty_checked(undone), (event,)
