"""The command ``farsteer servo-board``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from localization.cli.terminal import say
from localization.extras import require


@dataclass(frozen=True)
class ServoBoardCommand:
    """Run a second arm: a board with servos behind a serial port of this machine.

    It takes and sends the lines of the Arduino sketch in examples/servo_board, and has the errors of real servos.
    `farsteer servo-bridge` connects it to a robot.
    """

    arm: str = "s2"
    """The arm: its name, or a .toml file."""
    link: Path | None = None
    """Name to give to the port besides the system's, as a link; it stays when the board is started again."""
    resolution: Literal["degree", "microsecond"] = "degree"
    """What its pulses are rounded to."""
    feedback: bool = True
    """Whether its servos have feedback wires; without, the board answers what it writes."""

    def __call__(self) -> int:
        """Run until Ctrl-C."""
        require("mujoco", "the simulated arm")
        from robot_sim.arm.arm_table import load_arm
        from robot_sim.arm.board_port import BoardPort, run_board
        from robot_sim.arm.servo_board import ServoBoard
        from teleop.clock import monotonic

        board = ServoBoard(load_arm(self.arm), self.resolution, feedback=self.feedback)
        with BoardPort(self.link) as port:
            say(
                f"a board with six servos is at {self.link or port.name}; for a robot with an arm:",
                f"  farsteer servo-bridge ws://127.0.0.1:9090 --port {self.link or port.name}",
            )
            try:
                run_board(board, port, monotonic, lambda: False)
            except KeyboardInterrupt:
                say("\nended")
        return 0
