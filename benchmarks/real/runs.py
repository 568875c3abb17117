"""What is measured on an excerpt of a real log: drives by each method, kidnaps, starts."""

from __future__ import annotations

import gc
import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.common.figures import OURS, Figure, say
from benchmarks.common.progress import note, with_progress
from benchmarks.common.sheet import Sheet
from benchmarks.real import failure_rules, hints, kidnaps
from benchmarks.real.log_tracks import planar
from benchmarks.real.logs import Excerpt, RealDrive, again
from benchmarks.real.peers import PEERS, peer_answers
from benchmarks.real.scores import (
    Answer,
    RealScore,
    answered,
    errors_of,
    mean_score,
    score_real,
)
from benchmarks.real.submissions import Submission, submitted_answers
from benchmarks.real.tables import (
    HINTS,
    KIDNAPS,
    RULES,
    markdown,
    of_hints,
    of_kidnaps,
    of_noticed,
    of_score,
)
from benchmarks.real.yardstick import run_yardstick
from localization.geometry import FloatArray
from localization.pipeline.localizer import Localizer, LocalizerConfig

YARDSTICK = "yardstick"
"""Name of a script of somebody else in tables."""
HEAD = (
    f"{'log':<34} {'method':<20}{'scans':>6}{'mean m':>8}{'p95 m':>7}{'max m':>7}{'wrong':>8}{'times':>6}{'trusted':>8}"
    f"{'relations m':>15}{'in 95 %':>8}{'NEES(3)':>9}{'tracking':>9}{'CPU ms p50/p99/max':>20}"
)
"""Of the rows that are printed."""


@dataclass(frozen=True, slots=True)
class Wanted:
    """What is to be measured on each excerpt beside our own localiser's drive."""

    folder: Path
    """Of the logs."""
    peers: bool = False
    """Whether other methods are replayed the same."""
    yardstick: Path | None = None
    """Script of another localiser."""
    submissions: tuple[Submission, ...] = ()
    """Poses that others handed in."""
    kidnaps: int = 0
    """Number of times that a robot is carried off."""
    hints: int = 0
    """Number of starts for each kind of hint."""
    runs: int = 1
    """Number of replays, each with ranges that differ by a millionth."""
    seed: int = 0
    """Of the places, and of the hints' errors."""
    keep: Path | None = None
    """Folder for our poses at each scan."""


def parts(
    wanted: Wanted, excerpt: Excerpt, drive: RealDrive, config: LocalizerConfig
) -> Iterator[tuple[str, Iterator[Figure]]]:
    """Yield the parts of a sheet that are measured on an excerpt, each by its name."""
    yield excerpt.case, _scores(wanted, excerpt, drive, config)
    if wanted.kidnaps:
        yield f"{KIDNAPS}{excerpt.case}", _carried_off(wanted, drive, config)
        yield f"{RULES}{excerpt.case}", _ruled(wanted, drive)
    if wanted.hints:
        yield f"{HINTS}{excerpt.case}", _started(wanted, drive, config)


def keep(sheet: Sheet, part: str, figures: Iterator[Figure]) -> None:
    """Put figures into a sheet as they come, so that a run that is ended keeps what it has."""
    begun, found = time.process_time(), list[Figure]()
    for figure in figures:
        if found and figure.method != found[-1].method:
            sheet.put(part, found, seconds=time.process_time() - begun)
        found.append(figure)
    sheet.put(part, found, seconds=time.process_time() - begun)
    if sheet.path is not None:
        sheet.path.with_suffix(".md").write_text(markdown(sheet), encoding="utf-8")


def _scores(
    wanted: Wanted, excerpt: Excerpt, drive: RealDrive, config: LocalizerConfig
) -> Iterator[Figure]:
    """Replay an excerpt to each method."""
    # As where a robot runs: nothing that was loaded before is looked through for garbage during a scan.
    gc.collect()
    gc.freeze()
    runs = [again(drive, run) for run in range(wanted.runs)]
    found = [_whole(run, OURS, _ours(run, config)) for run in runs]
    if wanted.keep is not None:
        _keep_poses(wanted.keep, drive, found[0])
    yield from _scored(drive, OURS, found)
    for name in PEERS if wanted.peers else ():
        theirs = [_whole(run, name, peer_answers(run, name)) for run in runs]
        yield from _scored(drive, name, theirs)
    if wanted.yardstick is not None and excerpt.yaw == 1.0 and excerpt.stamps == "logged":
        note(f"{excerpt.case}: {wanted.yardstick.name} runs, and says nothing until its end")
        track, ms = run_yardstick(wanted.yardstick, wanted.folder, excerpt.name, drive.scans_to_end)
        yield from _scored(drive, YARDSTICK, [submitted_answers(drive, track)], ms)
    for poses in wanted.submissions:
        yield from _scored(drive, poses.path.stem, [submitted_answers(drive, poses)])


def _ours(drive: RealDrive, config: LocalizerConfig) -> Iterator[Answer]:
    localizer = Localizer(drive.world, drive.log.mounts, config)
    return answered(drive.readings, localizer, start=drive.start, mount=drive.mount)


def _whole(drive: RealDrive, name: str, found: Iterator[Answer]) -> list[Answer]:
    return list(with_progress(found, len(drive.track), f"{drive.case}: {name}"))


def _scored(
    drive: RealDrive, name: str, runs: Sequence[list[Answer]], mean_ms: float | None = None
) -> Iterator[Figure]:
    """Yield the mean figures of a method's replays."""
    score = mean_score([score_real(drive, found) for found in runs])
    say(row(drive.case, name, score))
    each = [answer.seconds for found in runs for answer in found]
    mean = 1e3 * float(np.mean(each)) if mean_ms is None else mean_ms
    yield from of_score(drive.case, name, score, mean)


def _carried_off(wanted: Wanted, drive: RealDrive, config: LocalizerConfig) -> Iterator[Figure]:
    pairs = list(kidnaps.pairs(drive, count=wanted.kidnaps, seed=wanted.seed))
    if len(pairs) < wanted.kidnaps:
        note(f"{drive.case}: too short for {wanted.kidnaps} kidnaps, {len(pairs)} are run")
    trials = (kidnaps.kidnap(drive, config, *pair) for pair in pairs)
    done = list(with_progress(trials, len(pairs), f"{drive.case}: kidnaps"))
    yield from _said(of_kidnaps(drive.case, done), "kidnaps")


def _ruled(wanted: Wanted, drive: RealDrive) -> Iterator[Figure]:
    """Ask others' rules about the same robots."""
    pairs = list(kidnaps.pairs(drive, count=wanted.kidnaps, seed=wanted.seed))
    trials = (failure_rules.judged(drive, *pair) for pair in pairs)
    done = list(with_progress(trials, len(pairs), f"{drive.case}: others' rules"))
    for rule in failure_rules.RULES:
        yield from _said(of_noticed(drive.case, rule, [said[rule] for said in done]), rule)


def _started(wanted: Wanted, drive: RealDrive, config: LocalizerConfig) -> Iterator[Figure]:
    places = list(hints.beginnings(drive, count=wanted.hints, seed=wanted.seed))
    if len(places) < wanted.hints:
        note(f"{drive.case}: too short for {wanted.hints} starts, {len(places)} are run")
    for kind in hints.KINDS:
        trials = (hints.start_at(drive, config, scan, kind, seed=wanted.seed) for scan in places)
        done = list(with_progress(trials, len(places), f"{drive.case}: {kind.name}"))
        yield from _said(of_hints(drive.case, kind.name, done), kind.name)


def _said(figures: Iterator[Figure], what: str) -> Iterator[Figure]:
    """Print figures on one line."""
    found = list(figures)
    told = ", ".join(f"{f.quantity} {f.text}" for f in found if math.isfinite(f.value))
    say(f"{found[0].case if found else '':<34} {what}: {told}")
    yield from found


def _keep_poses(folder: Path, drive: RealDrive, found: Sequence[Answer]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    np.savez(
        folder / f"{drive.case.replace(',', '').replace(' ', '_')}.npz",
        pose=np.array([_placed(f) for f in found]),
        covariance=np.array([f.covariance for f in found]),
        health=np.array([str(f.health) for f in found]),
        seconds=np.array([f.seconds for f in found]),
        error=errors_of(drive, found),
        track=drive.track,
    )


def _placed(answer: Answer) -> FloatArray:
    """Return x, y [m] and yaw [rad]; NaN without a pose."""
    here = answer.map_from_scanner
    return np.full(3, np.nan) if here is None else planar(here)


def row(case: str, method: str, s: RealScore) -> str:
    """Return two lines of the table: figures, and the share of each state; one of a method without states."""
    states = " ".join(f"{k} {100 * v:.1f} %" for k, v in s.states.items() if v >= 0.0005)
    relation = f"{s.relation:.3f}±{s.relation_std:.3f}"
    cpu = "/".join(f"{v:.0f}" for v in s.cpu)
    return (
        (
            f"{case:<34} {method:<20}{s.n:>6}{s.mean:>8.3f}{s.p95:>7.3f}{s.max:>7.2f}{s.wrong:>8.2%}{s.excursions:>6}"
            f"{s.trusted:>8.2%}{relation:>15}{s.covered:>8.0%}{s.nees:>9.1f}{s.tracking:>9.0%}{cpu:>20}"
            + (f"\n{'':<8}{states}" if states else "")
        )
        .replace("nan%", "   -")
        .replace("nan", "  -")
    )
