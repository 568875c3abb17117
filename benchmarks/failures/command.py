"""``python -m benchmarks failures FOLDER [TRIALS]``: what fails while a robot is driven, and whether it stands in time.

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
from collections import defaultdict
from pathlib import Path

import numpy as np

from benchmarks.common.progress import with_progress
from benchmarks.failures.judgement import LAG, REQUEST, Wheels
from benchmarks.failures.trials import Plan, Trial, made, planned
from benchmarks.wire.served_robot import served_robot

TAKES_WORDS = True
TRIALS = 1000
_LOT = 20
"""Trials with one robot, whose log is then read."""


def main(words: list[str] | None = None) -> int:
    """Make the trials that are missing, and print the figures of all."""
    if not words:
        print("failures FOLDER [TRIALS]: name a folder for the trials", file=sys.stderr)
        return 2
    file = Path(words[0]) / "trials.jsonl"
    file.parent.mkdir(parents=True, exist_ok=True)
    lines = file.read_text().splitlines() if file.exists() else []
    done = [json.loads(line) for line in lines]
    known = {line["seed"] for line in done}
    missing = [
        seed for seed in range(int(words[1]) if len(words) > 1 else TRIALS) if seed not in known
    ]
    lots = [missing[i : i + _LOT] for i in range(0, len(missing), _LOT)]
    with file.open("a") as out:
        for lot in with_progress(lots, len(lots), f"lots of {_LOT} trials"):
            for line in asyncio.run(_lot([planned(seed) for seed in lot])):
                done.append(line)
                out.write(json.dumps(line) + "\n")
            out.flush()
    return _print(done)


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


def _print(done: list[dict[str, object]]) -> int:
    by_failure = defaultdict(list)
    for line in done:
        by_failure[str(line["failure"])].append(line)
    print(f"  allowed: {REQUEST:.2f} s until the command is zero, and {LAG:.2f} s of the servos")
    print(f"  {'failure':16s} {'trials':>6s} {'void':>5s} {'braked after s: p50':>20s} {'max':>6s}")
    for failure, lines in sorted(by_failure.items()):
        good = [line for line in lines if "void" not in line]
        times = [float(str(line["braked_after"])) for line in good] or [np.nan]
        print(
            f"  {failure:16s} {len(good):6d} {len(lines) - len(good):5d} {np.median(times):20.3f} {max(times):6.3f}"
        )
    bad = [line for line in done if line.get("failed")]
    for line in bad:
        print(
            f"  FAILED seed {line['seed']}, {line['driver']}, {line['failure']}: {line['failed']}"
        )
    counted = [line for line in done if "void" not in line]
    drivers = {
        d: sum(line["driver"] == d for line in counted)
        for d in {str(line["driver"]) for line in done}
    }
    print(f"  {len(bad)} of {len(counted)} failed; drivers: {drivers}")
    return 1 if bad else 0
