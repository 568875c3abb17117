"""Drives on all cores, whose outcomes a file keeps: those that it holds are not driven again."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, fields
from multiprocessing import Pool
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from benchmarks.common.progress import with_progress

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

P = TypeVar("P", bound="DataclassInstance")
R = TypeVar("R", bound="DataclassInstance")


def resumed(file: Path, plan: Sequence[P], drive: Callable[[P], R], kind: type[R]) -> list[R]:
    """Make the drives that a file does not hold yet, and return all that it holds.

    Args:
        file: A line of JSON for each drive.
        plan: The drives.
        drive: Makes one.
        kind: Of what it returns, which has the fields of a plan.
    """
    file.parent.mkdir(parents=True, exist_ok=True)
    lines = file.read_text().splitlines() if file.exists() else []
    done = [json.loads(line) for line in lines]
    names = [field.name for field in fields(plan[0])]
    known = {json.dumps([one[name] for name in names]) for one in done}
    missing = [one for one in plan if json.dumps(list(asdict(one).values())) not in known]
    with file.open("a") as kept, Pool() as cores:
        each = cores.imap_unordered(drive, missing)
        for outcome in with_progress(each, len(missing), "drives"):
            line = json.dumps(asdict(outcome))
            done.append(json.loads(line))
            kept.write(line + "\n")
            kept.flush()
    return [kind(**one) for one in done]
