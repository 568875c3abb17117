"""The topic and the services of a robot's video, for the documentation."""

from __future__ import annotations

from typing import Final

from teleop.robot.topics.topic_table import Interface
from teleop.video.cam_sources import CAM_SOURCES
from teleop.video.photographs.photo_pages import SERVICE
from teleop.video.viewer_access import TICKET_SERVICE

VIDEO_TOPICS: Final = (
    Interface(
        CAM_SOURCES,
        "std_msgs/msg/String",
        "JSON object of names and addresses of the video streams; latched",
    ),
)
"""Topics of a robot with a camera, beside those of the pictures."""

VIDEO_SERVICES: Final = (
    Interface(
        SERVICE,
        "farsteer_msgs/srv/TakePhoto",
        "take a photograph and store it with the robot's pose; for those who may drive",
    ),
    Interface(
        TICKET_SERVICE,
        "std_srvs/srv/Trigger",
        "the message is a ticket that stands for a token in the address of a stream, for 60 s",
    ),
)
"""Services of a robot with a camera."""
