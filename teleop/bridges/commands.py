"""The commands of the bridges: to Kafka, to a board of servos, and to a motion base."""

from __future__ import annotations

from dataclasses import dataclass, field

import tyro

from localization.cli.terminal import say
from localization.extras import require
from teleop.bridges.broker_options import BrokerOptions
from teleop.bridges.kafka.bridge_config import BridgeConfig
from teleop.bridges.motion_platform.bridge_config import (
    MotionPlatformConfig,
    MotionReceiverConfig,
)
from teleop.bridges.rest.rest_config import RestConfig
from teleop.bridges.servos.bridge_config import ServoBridgeConfig


@dataclass(frozen=True)
class KafkaBridge:
    """Drive a robot by the step commands of a Kafka topic, each once and in order.

    Each command is answered on another topic. A bridge that is killed and started again goes on where it was, and
    answers the command that it was cut off in as interrupted.
    """

    broker: tyro.conf.OmitArgPrefixes[BrokerOptions]
    """The broker."""
    bridge: tyro.conf.OmitArgPrefixes[BridgeConfig] = field(default_factory=BridgeConfig)
    """Robot, topics and rules."""

    def __call__(self) -> int:
        """Run until Ctrl-C."""
        require("aiokafka", "the bridge to Kafka")
        from teleop.bridges.kafka.bridge import run_bridge
        from teleop.bridges.until_ended import run_until_ended

        return run_until_ended(run_bridge(self.broker, self.bridge, say))


@dataclass(frozen=True)
class KafkaRest:
    """Serve Kafka over HTTP as the Confluent REST proxy does (version 2), for clients that cannot speak Kafka."""

    broker: tyro.conf.OmitArgPrefixes[BrokerOptions]
    """The broker."""
    rest: tyro.conf.OmitArgPrefixes[RestConfig] = field(default_factory=RestConfig)
    """Where it listens, and to whom."""

    def __call__(self) -> int:
        """Serve until Ctrl-C."""
        for library in ("aiokafka", "tornado"):
            require(library, "the REST proxy of Kafka")
        from teleop.bridges.rest.server import serve_rest
        from teleop.bridges.until_ended import run_until_ended

        return run_until_ended(serve_rest(self.broker, self.rest, say))


@dataclass(frozen=True)
class ServoBridge:
    """Lead the servos of a second arm as a robot's arm moves, and send their angles back.

    The board is an Arduino with the sketch in examples/servo_board, or `farsteer servo-board`. It may be unplugged and
    plugged in again; its servos hold meanwhile.
    """

    bridge: tyro.conf.OmitArgPrefixes[ServoBridgeConfig] = field(default_factory=ServoBridgeConfig)
    """Robot and board."""

    def __call__(self) -> int:
        """Run until Ctrl-C."""
        for library in ("serial", "websockets"):
            require(library, "the bridge to a board of servos")
        from teleop.bridges.servos.bridge import run_servo_bridge
        from teleop.bridges.until_ended import run_until_ended

        return run_until_ended(run_servo_bridge(self.bridge, say))


@dataclass(frozen=True)
class MotionPlatform:
    """Tilt a motion base as a robot tilts: a chair on six legs, whose driver takes a datagram each 10 ms.

    Its position, rate and acceleration keep their limits whatever the robot does. Where the robot is silent, or its
    emergency stop is latched, it settles level.
    """

    bridge: tyro.conf.OmitArgPrefixes[MotionPlatformConfig] = field(
        default_factory=MotionPlatformConfig
    )
    """Robot and motion base."""

    def __call__(self) -> int:
        """Run until Ctrl-C."""
        require("websockets", "the bridge to a motion base")
        from teleop.bridges.motion_platform.bridge import run_motion_platform
        from teleop.bridges.until_ended import run_until_ended

        return run_until_ended(run_motion_platform(self.bridge, say))


@dataclass(frozen=True)
class MotionReceiver:
    """Check the datagrams for a motion base as its driver should: their order, rate, limits and legs.

    Without a motion base it shows what one would be asked for.
    """

    receiver: tyro.conf.OmitArgPrefixes[MotionReceiverConfig] = field(
        default_factory=MotionReceiverConfig
    )
    """Platform, and where to listen."""

    def __call__(self) -> int:
        """Run until Ctrl-C."""
        require("websockets", "the bridge to a motion base")
        from teleop.bridges.motion_platform.bridge import run_motion_receiver
        from teleop.bridges.until_ended import run_until_ended

        return run_until_ended(run_motion_receiver(self.receiver, say))
