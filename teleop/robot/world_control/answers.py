"""Answers to calls of ``simulation_interfaces``: fields of the response, or the result that says what failed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

from teleop.robot.world_control.results import Code, ControlError, result

Request: TypeAlias = dict[str, Any]
Answer: TypeAlias = Callable[[Request], Request]


def answered(answer: Answer, request: Request) -> Request:
    """Return the response to a request, with its result."""
    try:
        values = answer(request)
    except ControlError as error:
        return {"result": result(error.code, str(error))}
    return {"result": result(), **values} if "features" not in values else values


def refuser(name: str) -> Answer:
    """Return what answers a service that is not offered."""

    def refuse(request: Request) -> Request:
        raise ControlError(
            Code.UNSUPPORTED, f"{name} is not offered; GetSimulatorFeatures says what is"
        )

    return refuse
