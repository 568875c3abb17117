"""Losing it at full speed, in all the ways there are: how long until the robot's command is zero."""

from __future__ import annotations

from collections.abc import Iterator

from benchmarks._figures import Figure


def losing(trials: int = 200) -> Iterator[Figure]:
    raise SystemExit("losing: not there")
    yield
