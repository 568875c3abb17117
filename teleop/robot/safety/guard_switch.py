"""Who may switch the guard off."""

from __future__ import annotations

from teleop.robot.inbox import GuardSwitch


def switch_rejection(message: GuardSwitch, driver: str) -> str | None:
    """Return why a client may not switch the guard; None if it may.

    Anybody may switch it on. Off it is for the driver, and for as long as it drives: the one who answers for the robot
    sees what it does.

    Args:
        message: The request.
        driver: Client that holds the lease; empty if none does.
    """
    if message.on or message.client == driver:
        return None
    who = f"{driver} drives" if driver else "nobody drives"
    return f"{who}; only the driver may switch the guard off"
