"""``python -m benchmarks failures FOLDER [TRIALS] [--out FILE]``: what fails while a robot is driven, and whether it stands in time.

Each of 1000 trials has a seed, a driver (plain WebSocket, roslibpy, roslib for JavaScript, the console in Chromium), a
speed, and a failure at a random moment of its drive: of the driver's process, of what it sends, of the link, of the
robot's gateway or estimator. The wheels' rates in the robot's log judge it. Every trial appends a line to
``FOLDER/trials.jsonl``; those that are there are not made again.
"""

from __future__ import annotations

import asyncio
import json
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from benchmarks.common.figures import Figure, say
from benchmarks.common.progress import with_progress
from benchmarks.common.sheet import measure
from benchmarks.failures.judgement import LAG, REQUEST, Wheels
from benchmarks.failures.trials import Plan, Trial, made, planned
from benchmarks.wire.served_robot import served_robot

TAKES_WORDS = True
TRIALS = 1000
_LOT = 20
"""Trials with one robot, whose log is then read."""


def main(words: Sequence[str] = (), out: Path | None = None) -> int:
    """Make the trials that are missing, and print the figures of all."""
    if len(words) not in (1, 2) or not all(map(str.isdecimal, words[1:])):
        print(
            "failures FOLDER [TRIALS]: name a folder for the trials, and how many", file=sys.stderr
        )
        return 2
    file, bad = Path(words[0]) / "trials.jsonl", list[dict[str, object]]()

    def figures() -> Iterator[Figure]:
        done = _trials(file, int(words[1]) if len(words) > 1 else TRIALS)
        bad.extend(line for line in done if line.get("failed"))
        yield from _figures(done)

    measure({"failures": figures}, out, whole=False)
    for line in bad:
        say(f"  FAILED seed {line['seed']}, {line['driver']}, {line['failure']}: {line['failed']}")
    return int(bool(bad))


def _trials(file: Path, count: int) -> list[dict[str, object]]:
    """Make the trials that a file does not hold yet, and return all that it holds."""
    file.parent.mkdir(parents=True, exist_ok=True)
    lines = file.read_text().splitlines() if file.exists() else []
    done = [json.loads(line) for line in lines]
    known = {line["seed"] for line in done}
    missing = [seed for seed in range(count) if seed not in known]
    lots = [missing[i : i + _LOT] for i in range(0, len(missing), _LOT)]
    with file.open("a") as kept:
        for lot in with_progress(lots, len(lots), f"lots of {_LOT} trials"):
            for line in asyncio.run(_lot([planned(seed) for seed in lot])):
                done.append(line)
                kept.write(json.dumps(line) + "\n")
            kept.flush()
    return done


async def _lot(plans: list[Plan]) -> list[dict[str, object]]:
    """Make trials with one robot, and judge them by its log."""
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "log.mcap"
        options = ("--scene", "courtyard", "--playground", "--record", str(log))
        trials: list[Trial] = []
        async with served_robot(*options) as (url, pid):
            for plan in plans:
                trials.append(await made(plan, url, pid))
        wheels = Wheels(log.parent.glob("*.mcap"))
        lines = []
        for trial in trials:
            stop = None if trial.why else wheels.stop(trial.failed, trial.until)
            plan = trial.plan
            line = {"seed": plan.seed, "driver": plan.driver, "failure": plan.failure}
            if stop is None:
                lines.append({**line, "void": trial.why or "it hardly moved"})
                continue
            lines.append(
                {
                    **line,
                    "speed": round(stop.speed, 3),
                    "braked_after": round(stop.braked_after, 3),
                    "way": round(stop.way, 3),
                    "bound": round(stop.bound, 3),
                    "failed": stop.failed,
                }
            )
        return lines


def _figures(done: list[dict[str, object]]) -> Iterator[Figure]:
    counted = [line for line in done if "void" not in line]
    case, method, longest = "something fails", "all", REQUEST + LAG
    yield Figure(case, method, "trials", len(counted), n=len(done), least=TRIALS)
    failed = sum(bool(line["failed"]) for line in counted)
    yield Figure(case, method, "not in time, or too far", failed, n=len(counted), most=0)
    for driver in sorted({str(line["driver"]) for line in counted}):
        n = sum(line["driver"] == driver for line in counted)
        yield Figure(case, driver, "trials", n, n=n, least=50 if driver == "page" else None)
    for failure in sorted({str(line["failure"]) for line in counted}):
        times = [float(str(x["braked_after"])) for x in counted if x["failure"] == failure]
        middle, most = float(np.median(times)), max(times)
        yield Figure(case, failure, "braked after, middle", middle, "s", len(times))
        yield Figure(case, failure, "braked after, most", most, "s", len(times), most=longest)
