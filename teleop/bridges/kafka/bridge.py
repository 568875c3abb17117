"""The bridge as a whole: a broker on one side, a robot on the other."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path

from teleop.bridges.broker_check import why_unusable
from teleop.bridges.broker_options import BrokerOptions
from teleop.bridges.client_life import FAILURES
from teleop.bridges.endless import endless
from teleop.bridges.kafka import results
from teleop.bridges.kafka.bridge_config import BridgeConfig
from teleop.bridges.kafka.command_driver import CommandDriver
from teleop.bridges.kafka.journal import Journal
from teleop.bridges.kafka.log_reader import LogReader
from teleop.bridges.kafka.result_publisher import ResultPublisher
from teleop.bridges.kafka.robot_link import RobotLink
from teleop.bridges.kafka.telemetry import (
    LatestToTopic,
    Locations,
    subscribe_cameras,
    subscribe_locations,
)
from teleop.bridges.kafka.topics import make_topics, partition_of
from teleop.console.lan.state_files import state_folder
from teleop.ros_types import registry
from teleop.rosbridge import Client
from teleop.secret_files import read_secret, trust

Say = Callable[[str], object]
"""Takes a line for the user."""


async def run_bridge(broker: BrokerOptions, config: BridgeConfig, say: Say) -> None:
    """Run a bridge until it is cancelled.

    Raises:
        SettingError: If an option cannot be used with this broker.
        ClientError: If the robot's address is no robot's, or it does not accept the token.
        RobotRefusesError: If the token is an admin's.
        JournalError: If the journal cannot be written.
        PartEndedError: If a part of the bridge has ended without an error.
    """
    settings = broker.settings()
    token = read_secret(config.token_file, "token")
    client = Client(config.robot, registry=registry(), token=token, tls=trust(config.ca))
    if (warning := broker.warning()) is not None:
        say(f"warning: {warning}")
    partition = await _find_topics(broker, config, say)
    path = config.journal or _default_journal(config, partition)
    log = f"{config.commands}/{partition}" + (f" of {config.key}" if config.key else "")
    with Journal(path, log) as journal:
        if journal.state.begun is not None:
            say(f"interrupted: the command at {journal.state.begun}; it is not driven again")
        await _run(settings, config, partition, journal, client, say)


async def _run(
    settings: dict[str, object],
    config: BridgeConfig,
    partition: int,
    journal: Journal,
    client: Client,
    say: Say,
) -> None:
    reader = LogReader(settings, config.commands, partition, journal.state)
    robot = RobotLink(client, config.measure_by)
    driver = CommandDriver(
        journal,
        reader,
        robot,
        partition=partition,
        key=config.key,
        max_age=config.max_age,
        sizes=config.sizes,
    )
    reader.on_change = robot.on_change = lambda text: say(_with_counts(text, driver))
    publisher = ResultPublisher(journal, settings, config.results)
    key = (config.key or "robot").encode()
    parts = {
        "reader": reader.run(),
        "link to the robot": robot.run(),
        "driver": driver.run(),
        "publisher": publisher.run(),
    }
    if config.location:
        positions = LatestToTopic(settings, config.location, key)
        locations = Locations(positions.put, nested=config.nested_json, file=config.odometry_file)
        await subscribe_locations(client, locations)
        parts["sender of positions"] = positions.run()
    if config.cameras:
        cameras = LatestToTopic(settings, config.cameras, key, repeat=config.announce)
        await subscribe_cameras(client, cameras.put)
        parts["sender of video streams"] = cameras.run()
    try:
        async with asyncio.TaskGroup() as group:
            for name, part in parts.items():
                group.create_task(endless(name, part))
    except* Exception as errors:
        raise errors.exceptions[0] from None
    finally:
        await client.close()
        say(_with_counts("ended", driver))


async def _find_topics(broker: BrokerOptions, config: BridgeConfig, say: Say) -> int:
    """Make what is missing and return the partition of the commands, as soon as there is a broker."""
    settings, waiting = broker.settings(), False
    wanted = filter(None, (config.commands, config.results, config.location, config.cameras))
    topics = list(wanted)
    while True:
        try:
            await make_topics(settings, topics)
            return await partition_of(settings, config.commands, config.partition, config.key)
        except FAILURES as error:
            if not waiting:
                why = await why_unusable(broker) or str(error) or "no answer"
                say(f"no broker at {broker.brokers}: {why}; trying again")
            waiting = True
            await asyncio.sleep(1.0)


def _default_journal(config: BridgeConfig, partition: int) -> Path:
    name = f"{config.commands}-{partition}" + (f"-{config.key}" if config.key else "")
    safe = "".join(c if c.isalnum() or c in "._-" else "_" for c in name)
    return state_folder() / "kafka" / f"{safe}.jsonl"


def _with_counts(text: str, driver: CommandDriver) -> str:
    """Add what became of the commands so far: how many are done, interrupted, too old, lost ..."""
    order = (results.DONE, results.SET, results.INTERRUPTED, results.TOO_OLD, results.LOST)
    names = [*order, *sorted(driver.counts.keys() - {*order})]
    counts = ", ".join(f"{driver.counts[name]} {name}" for name in names if driver.counts[name])
    return f"{text} ({counts})" if counts else text
