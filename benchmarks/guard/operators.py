"""What the guard is worth to the library's operators over slow links: contacts and time, with and without it.

After Luck et al., HRI 2006, and Storms, Vejdemo-Johansson and Tilbury, IJRR 2017: guarded driving gains by delay. Furniture
has moved since the operator's map was made, and old commands are neither slowed nor refused, so that the delay shows.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from itertools import product
from multiprocessing import Pool
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from benchmarks.common.figures import Figure
from benchmarks.common.progress import with_progress
from teleop.scenario.files.scenario import SCHEMA
from teleop.scenario.session.run import run_scenario

DELAYS: Final = (0.0, 0.3, 0.6, 1.0)
"""Round trips [s]."""
_ROUTES: Final = (
    ("office", "corridor_east"),
    ("office", "kitchen"),
    ("glasshouse", "west_aisle_north"),
    ("warehouse", "aisle_2_west"),
)
"""Scenes, and where to."""
_SEEDS: Final = 3
_LONGEST: Final = 120.0
"""Time after which a drive counts as not arrived [s]."""


def campaign(folder: Path) -> list[Figure]:
    """Drive what is missing in ``FOLDER/operators.jsonl``, and return the figures."""
    file = folder / "operators.jsonl"
    lines = file.read_text().splitlines() if file.exists() else []
    done = [json.loads(line) for line in lines]
    known = {(*d["route"], d["delay"], d["seed"], d["guarded"]) for d in done}
    plan = list(product(_ROUTES, DELAYS, range(_SEEDS), (True, False)))
    missing = [one for one in plan if (*one[0], *one[1:]) not in known]
    with file.open("a") as kept, Pool() as cores:
        each = cores.imap_unordered(_drive, missing)
        for one in with_progress(each, len(missing), "drives"):
            done.append(one)
            kept.write(json.dumps(one) + "\n")
            kept.flush()
    return list(_figures(done))


def _drive(one: tuple[tuple[str, str], float, int, bool]) -> dict[str, object]:
    route, delay, seed, guarded = one
    scene, goal = route
    link = {"kind": "link", "at": 0, "lasting": _LONGEST, "delay": 0.5 * delay}
    scenario = SCHEMA.validate_python(
        {
            "format": 1,
            "name": "guard-by-delay",
            "seed": seed,
            "world": {
                "scene": scene,
                "rearranged": seed + 1,
                "stale_limits": False,
                "guard": guarded,
            },
            "mission": {"goals": [{"at": goal, "within": 1.0}], "time_limit": _LONGEST},
            "operator": {"kind": "steering", "speed": 0.7},
            "fault": [link] if delay else [],
        }
    )
    with TemporaryDirectory() as runs:
        outcome = run_scenario(scenario, Path(runs) / "run")
    return {
        "route": route,
        "delay": delay,
        "seed": seed,
        "guarded": guarded,
        "seconds": outcome.robot_seconds,
        "arrived": outcome.figures["goals"],
        "contacts": outcome.figures["contacts"],
    }


def _figures(done: list[dict[str, object]]) -> Iterator[Figure]:
    for delay, guarded in product(DELAYS, (True, False)):
        mine = [d for d in done if d["delay"] == delay and d["guarded"] is guarded]
        case, method = f"round trip {delay:g} s", f"{'with' if guarded else 'without'} guard"
        for quantity, key, unit in (
            ("arrived", "arrived", ""),
            ("contacts", "contacts", ""),
            ("time", "seconds", "s"),
        ):
            total = sum(float(str(d[key])) for d in mine)
            yield Figure(case, method, quantity, total, unit, len(mine))
