"""What the robot offers about runs: services, and the topic that says whether one is recorded."""

from __future__ import annotations

from typing import Final

from teleop.robot.topics.topic_table import Interface

START: Final = Interface(
    "/runs/start", "std_srvs/srv/Trigger", "record what is published as a run; answers its name"
)
STOP: Final = Interface("/runs/stop", "std_srvs/srv/Trigger", "complete the run")
STATE: Final = Interface(
    "/runs/state",
    "std_msgs/msg/String",
    'the run that is recorded, as JSON: `{"recording": "run-20261124-193000.mcap", "ended": ""}`; `ended`: why the last ended by itself',
)
"""Latched, and published at each change."""
