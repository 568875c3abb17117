"""The commands ``farsteer serve`` and ``farsteer validate``."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from pathlib import Path

import tyro

from localization.cli.run_folder import check_file
from localization.cli.terminal import Progress, fitted, say, say_json
from localization.extras import require
from teleop.robot.serving.serve_config import ServeConfig


@dataclass(frozen=True)
class Serve:
    """Serve a robot in real time until Ctrl-C; any rosbridge client can drive it.

    It listens on this machine only, unless --host gives another address.
    """

    scene: str = "office"
    """Scene in which the robot drives."""
    server: tyro.conf.OmitArgPrefixes[ServeConfig] = field(default_factory=ServeConfig)
    """Address, robot, access and records."""

    def __call__(self) -> int:
        """Serve until Ctrl-C."""
        config = self.server
        if config.record is not None:
            check_file(config.record, overwrite=None, option="--record")
        if config.camera is not None:
            require("OpenGL", "--camera")
        if config.webrtc:
            require("aiortc", "--webrtc")
        if config.robot.arm is not None:
            require("daqp", "--arm")
            require("ruckig", "--arm")

        import asyncio

        from localization.maps.prepared_map import default_cache
        from teleop.console.browser import NO_BROWSER, open_in_browser
        from teleop.robot.real_time.process_name import name_process
        from teleop.robot.serve import serve
        from teleop.robot.serving.address import Address
        from teleop.robot.serving.greeting import greeting
        from teleop.robot.serving.lan_access import lan_access
        from teleop.robot.serving.option_checks import check_options
        from teleop.robot.serving.other_map import load_other_map
        from teleop.robot.serving.page_invitation import local_page_address
        from teleop.scene_clouds import load_scene_cloud, scene_cloud_path

        if not config.lockstep:
            name_process("control")
        config, access = lan_access(config) if config.lan else (config, None)
        asyncio.run(check_options(config))
        world = config.robot.world(self.scene, config.seed)
        if config.map is None:
            cloud, path = load_scene_cloud(self.scene), scene_cloud_path(self.scene)
        else:
            cloud, path = load_other_map(config.map, world), config.map
        say(*(f"note: {note}" for note in world.notes))

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
            )
        )
        say("\nended" if config.lockstep else f"\nended; kept {factor:.2f} of real time")
        return 0


@dataclass(frozen=True)
class Validate:
    """Measure how the robot turns, rolls, stands and responds, against published figures and theory.

    Prints each quantity with its target, its tolerance and the target's source. There is no scene and no
    seed: the figures are the same each time.
    """

    write: Path | None = None
    """Update the tables of this page, which is docs/sheets/robot.md."""
    json: bool = False
    """Print the rows as JSON."""

    def __call__(self) -> int:
        """Measure, and print the table."""
        from robot_sim.validation import validate
        from robot_sim.validation.report import plain, verdict, write_report

        bar = Progress()
        rows = validate(bar)
        bar.end()
        if self.json:
            judgement = [{**asdict(r), "passed": r.passed, "result": r.result} for r in rows]
            say_json({"rows": judgement, "passed": all(row.passed for row in rows)})
        else:
            say(plain(rows), "", *fitted(verdict(rows)))
        if self.write is not None:
            write_report(self.write, rows)
            say(f"tables written to {self.write}")
        return int(not all(row.passed for row in rows))
