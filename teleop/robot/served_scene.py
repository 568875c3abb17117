"""A robot that is served in a scene, until Ctrl-C or until somebody in the playground wants another one."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, replace

from localization.cli.terminal import say
from localization.maps.prepared_map import default_cache
from teleop.console.browser import NO_BROWSER, open_in_browser
from teleop.robot.playground.playground import WorldChoice
from teleop.robot.serve import serve
from teleop.robot.serving.address import Address
from teleop.robot.serving.greeting import greeting
from teleop.robot.serving.lan_access import LanAccess
from teleop.robot.serving.other_map import load_other_map
from teleop.robot.serving.page_invitation import local_page_address
from teleop.robot.serving.serve_config import ServeConfig
from teleop.robot.world_control.spares import SPARE_BOXES, SPARE_PEOPLE
from teleop.scene_clouds import load_scene_cloud, scene_cloud_path


@dataclass(frozen=True, slots=True)
class NextRobot:
    """The robot that is to be served instead of one."""

    choice: WorldChoice
    """Its world."""
    address: Address
    """Where its clients look for it."""


def serve_scene(
    scene: str, config: ServeConfig, access: LanAccess | None
) -> tuple[float, NextRobot | None]:
    """Serve a robot; return the achieved real-time factor, and the robot that is wanted instead, if one is.

    Args:
        scene: Name of the scene.
        config: Settings.
        access: What was made for the network; None without ``--lan``.
    """
    boxes, people = (SPARE_BOXES, SPARE_PEOPLE) if config.playground else ((), 0)
    world = config.robot.world(scene, config.seed, spare_boxes=boxes, spare_people=people)
    if config.map is None:
        cloud, path = load_scene_cloud(scene), scene_cloud_path(scene)
    else:
        cloud, path = load_other_map(config.map, world), config.map
    say(*(f"note: {note}" for note in world.notes))
    wanted: list[NextRobot] = []

    def ready(address: Address) -> None:
        say(greeting(address, world, cloud, path, config, access))
        if config.open and address.page and not open_in_browser(local_page_address(address)):
            say(NO_BROWSER)

    factor = asyncio.run(
        serve(
            world,
            cloud,
            config,
            cache=default_cache(),
            map_file=path,
            ready=ready,
            again=lambda choice, address: wanted.append(NextRobot(choice, address)),
        )
    )
    return factor, wanted[0] if wanted else None


def anew(config: ServeConfig, wish: NextRobot) -> ServeConfig:
    """Return the settings of the next robot, at the same address.

    What belongs to the first one only is left out: its record, its times of slip, and in another scene its map.
    """
    choice = wish.choice
    return replace(
        config,
        port=wish.address.port,
        open=False,
        robot=replace(config.robot, alive=choice.people, rearranged=choice.rearranged),
        record=None,
        slip=(),
        map=None if choice.scene else config.map,
    )
