"""Who may release a latched e-stop."""

from __future__ import annotations

from collections.abc import Iterable

from teleop.robot.inbox import EStop, EStopReset, InboxMessage


def reset_rejection(latched: EStop | None, reset: EStopReset) -> str | None:
    """Return why an e-stop may not be reset by a client; None if it may.

    The holder of the token that latched it may reset it, and an administrator. An e-stop that somebody
    without a token latched may be reset by everybody who may drive, since nobody else could.

    Args:
        latched: The latched e-stop; None if there is none.
        reset: The request.
    """
    if latched is None or reset.admin or reset.holder == latched.holder:
        return None
    if not latched.holder and reset.operator:
        return None
    who = latched.holder or latched.client
    may = "that token or an admin" if latched.holder else "an operator or an admin"
    return f"{who} stopped the robot; only {may} resets it"


def estop_after(latched: EStop | None, messages: Iterable[InboxMessage]) -> EStop | None:
    """Return the e-stop that is latched once pending messages have taken effect.

    Args:
        latched: The e-stop that is latched now; None if there is none.
        messages: Pending messages, in order.
    """
    for message in messages:
        if isinstance(message, EStop):
            latched = latched or message
        elif isinstance(message, EStopReset) and reset_rejection(latched, message) is None:
            latched = None
    return latched
