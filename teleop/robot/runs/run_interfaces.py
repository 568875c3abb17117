"""What the robot offers about runs: services, and the topic that says whether one is recorded."""

from __future__ import annotations

from typing import Final

from teleop.robot.topics.topic_table import Interface

START: Final = Interface(
    "/runs/start", "std_srvs/srv/Trigger", "record what is published as a run; answers its name"
)
STOP: Final = Interface("/runs/stop", "std_srvs/srv/Trigger", "complete the run")
DELETE: Final = Interface("/runs/delete", "farsteer_msgs/srv/DeleteRun", "delete a run")
KEEP: Final = Interface(
    "/runs/keep", "farsteer_msgs/srv/KeepRun", "keep a run when room is made, or no longer"
)
STATE: Final = Interface(
    "/runs/state",
    "std_msgs/msg/String",
    'the run that is recorded, as JSON: `{"recording": "run-20261124-193000.mcap", "ended": "", "removed": []}`; `ended`: why the last ended by itself; `removed`: runs that made room',
)
"""Latched, and published at each change."""
