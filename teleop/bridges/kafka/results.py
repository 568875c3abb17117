"""What became of a command of the log."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from typing import Final

DONE: Final = "done"
"""Everything that the command asks for was done."""
SET: Final = "set"
"""The command moves nothing: it set sizes."""
INVALID: Final = "invalid"
"""The command cannot be followed; the message names the field."""
TOO_OLD: Final = "too_old"
"""The command is older than the age limit."""
REPEATED: Final = "repeated"
"""The command was driven already, before the log began again."""
SKIPPED: Final = "skipped"
"""The command was in the log already when a step before it ended badly."""
INTERRUPTED: Final = "interrupted"
"""The bridge, or its connection to the robot, ended while the command was carried out."""
REFUSED: Final = "refused"
"""The robot did not take the step or the photograph."""
LOST: Final = "lost"
"""Not of a command: the broker's log has lost commands."""


@dataclass(frozen=True, slots=True)
class Result:
    """The answer to one command; partition and offset are its id, within one life of the log."""

    partition: int
    """Partition of the command."""
    offset: int
    """Offset of the command; of a loss, where the log was read on."""
    log: int
    """How often the log was found to have begun again: 0 until the broker loses it."""
    outcome: str
    """One of the constants of this module, or the outcome of ``farsteer_msgs/action/Move``."""
    message: str = ""
    """For people: the reason."""
    distance: float = 0.0
    """Driven by the measure that the bridge was given [m]."""
    angle: float = 0.0
    """Turned by the measure that the bridge was given [rad]."""
    lost: int = 0
    """Of a loss: how many commands are known to be gone."""

    @property
    def key(self) -> str:
        """Key of the published record, the same if it is published twice."""
        kind = "lost" if self.outcome == LOST else "command"
        return f"{kind}/{self.log}/{self.partition}/{self.offset}"

    @property
    def value(self) -> bytes:
        """Value of the published record; ``lost`` is only in that of a loss."""
        fields = asdict(self)
        fields |= {"distance": round(self.distance, 4), "angle": round(self.angle, 5)}
        if self.outcome != LOST:
            del fields["lost"]
        return json.dumps(fields).encode()
