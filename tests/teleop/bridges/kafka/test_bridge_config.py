"""Options of the bridge: what is refused, and the sizes of steps that they make."""

from __future__ import annotations

import math
from typing import Any

import pytest

from teleop.bridges.kafka.bridge_config import BridgeConfig
from teleop.errors import SettingError


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"commands": "a b"}, "commands must be a topic of letters.*'a b'"),
        ({"results": ""}, "results must be a topic"),
        ({"results": "turtle_control"}, "results need a topic of their own"),
        ({"partition": -1}, "partition must be 0 or more, got -1"),
        ({"max_age": math.nan}, "max_age must be 0 or more, got nan"),
        ({"announce": -1.0}, "announce must be 0 or more"),
        ({"speed": math.inf}, "speed must be 0 or more, got inf"),
    ],
)
def test_an_option_that_cannot_be_used_is_refused_by_name(options: Any, message: str) -> None:
    with pytest.raises(SettingError, match=message):
        BridgeConfig(**options)


def test_topics_of_telemetry_may_be_left_out_and_turns_are_in_radians_inside() -> None:
    config = BridgeConfig(location="", cameras="", speed=0.2, turn_speed=90.0)
    assert (config.sizes.speed, config.sizes.turn_speed) == (0.2, math.pi / 2)
    assert config.sizes.distance is config.sizes.angle is None
