"""Whether the client under test still takes part in a run."""

from __future__ import annotations

from collections.abc import Callable

from teleop.scenario.session.client_process import ClientProcess
from teleop.scenario.session.client_watch import ClientWatch

_LONGEST = 200
"""Characters of a line of a client's output that are repeated."""


class Attendance:
    """Judges the client's connections and its process; owns since when it has been away."""

    def __init__(
        self,
        watch: ClientWatch,
        client: ClientProcess | None,
        patience: float,
        time: Callable[[], float],
    ) -> None:
        """Begin, with a client that is not connected yet.

        Args:
            watch: Sees who is connected.
            client: The client's processes; None if somebody else has started it.
            patience: Time within which it must connect, and come back if it leaves [s].
            time: Returns the time by which it goes [s].
        """
        self._watch, self._client = watch, client
        self._patience, self._time = patience, time
        self._away_since: float | None = time()

    @property
    def ended(self) -> bool:
        """Whether the client's command has ended; also if nobody but the scenario has ended it."""
        if self._client is None:
            return True
        self._client.look()
        return self._client.status is not None or self._client.killed

    def absent(self) -> str:
        """Return why the client takes part no more; empty while it does."""
        client, present = self._client, self._watch.present
        if client is not None:
            client.look()
            if client.killed:
                return ""  # by the scenario, which goes on to see what the robot does
            if client.status:
                return self.failure()
            # A command may leave others behind that drive, here or elsewhere.
            if client.empty and not present:
                return f"the client ended before {self._what_was_due()}{self._last_words()}"
        if present:
            self._away_since = None
            return ""
        now = self._time()
        if self._away_since is None:
            self._away_since = now
        if now - self._away_since <= self._patience:
            return ""
        if not self._watch.ever:
            return f"no client connected within {self._patience:g} s{self._last_words()}"
        return f"the client left, and did not come back within {self._patience:g} s"

    def failure(self) -> str:
        """Return how the client's command failed; empty if it has not."""
        client = self._client
        if client is None or not client.status or client.killed:
            return ""
        status = client.status
        how = f"signal {-status}" if status < 0 else f"status {status}"
        return f"the client ended with {how}{self._last_words()}"

    def at_the_end(self) -> str:
        """Return why the client has failed, if it has, of a run whose time is up."""
        if self._client is not None and self._client.killed:
            return ""
        return self.failure() or ("" if self._watch.present else "the client left before the end")

    def _what_was_due(self) -> str:
        return "the end of the run" if self._watch.ever else "it connected"

    def _last_words(self) -> str:
        lines = [] if self._client is None else self._client.tail(1)
        return f": {lines[0].strip()[:_LONGEST]}" if lines else ""
