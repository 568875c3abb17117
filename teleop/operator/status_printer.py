"""Status lines for the operator's terminal: changes of health and control, and hint verdicts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any


class StatusPrinter:
    """Prints a line when health or control changes, and for each hint verdict."""

    def __init__(self, say: Callable[[str], None]) -> None:
        """Start with nothing printed; ``say`` prints a line."""
        self._say = say
        self._printed: dict[str, str] = {}

    def receive(self, topic: str, message: Mapping[str, Any]) -> None:
        """Print what a message changes; messages of other topics change nothing."""
        match topic:
            case "/localization/status":
                reasons = "; ".join(message["reasons"])
                self._changed("health", message["health"], f" ({reasons})" if reasons else "")
            case "/teleop/state":
                self._changed("control", message["state"], f" ({message['reason']})")
            case "/localization/hint_verdict":
                self._say(f"hint {message['verdict']}: {message['reason']}")

    def _changed(self, what: str, state: str, details: str) -> None:
        if self._printed.get(what) != state:
            self._printed[what] = state
            self._say(f"{what}: {state}{details}")
