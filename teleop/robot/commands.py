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

        from teleop.robot.real_time.process_name import name_process
        from teleop.robot.served_scene import anew, serve_scene
        from teleop.robot.serving.lan_access import lan_access
        from teleop.robot.serving.option_checks import check_options

        if not config.lockstep:
            name_process("control")
        config, access = lan_access(config) if config.lan else (config, None)
        asyncio.run(check_options(config))
        scene = self.scene
        factor, wish = serve_scene(scene, config, access)
        while wish is not None:
            scene, config = wish.choice.scene or scene, anew(config, wish)
            say(f"\nstarts anew in {scene}, as somebody in the playground wants")
            factor, wish = serve_scene(scene, config, access)
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
