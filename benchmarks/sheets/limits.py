"""Tables of the wire's limits, from the dataclasses that hold them, and of the fuzzer's rules."""

from __future__ import annotations

from localization.cli.settings_table import settings_of
from teleop.joystick import JoystickLayout
from teleop.rosbridge import ClientLimits, Keepalive, QueueLimits
from teleop.scenario.referee.rules.rule_book import RULES


def joystick() -> str:
    """Return the table of the joystick's layout."""
    return _table("joystick", JoystickLayout)


def queues() -> str:
    """Return the table of what waits for a client, and for how long."""
    return _table("bound", QueueLimits, Keepalive)


def clients() -> str:
    """Return the table of what a client may request."""
    return _table("limit", ClientLimits)


def rules() -> str:
    """Return the table of what must hold in every run."""
    rows = (f"| `{rule.name}` | {rule.sentence} |" for rule in RULES)
    return "\n".join(("| rule | what holds |", "|---|---|", *rows))


def _table(head: str, *configs: type) -> str:
    lines = [f"| {head} | value | meaning |", "|---|---|---|"]
    for config in configs:
        for setting in settings_of(config):
            if isinstance(setting.default, int | float):
                text = setting.text.replace("``", "`")
                lines.append(f"| `{setting.name}` | {_short(setting.default)} | {text} |")
    return "\n".join(lines)


def _short(value: float) -> str:
    return f"{value:.0f}" if value == int(value) else f"{value:g}"
