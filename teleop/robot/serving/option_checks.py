"""What ``farsteer serve`` can refuse at once, before it loads a world and its map for many seconds."""

from __future__ import annotations

import os
from dataclasses import replace

from robot_sim.cameras import camera_named
from teleop.robot.audit.audit_file import open_audit_file
from teleop.robot.serving.serve_config import ServeConfig
from teleop.robot.serving.server_setup import build_server, token_file


async def check_options(config: ServeConfig) -> None:
    """Try everything that needs no robot: files of tokens, messages and certificates, origins, camera and address.

    A server is built and listens for a moment, so that each fault is found, and named, by the code that would
    meet it later.

    Args:
        config: Settings, with what ``--lan`` adds to them.

    Raises:
        ServerError: If tokens, certificate or origins are invalid, or the address is not available.
        AuditError: If the audit log cannot be written.
        CameraError: If there is no camera of that name.
    """
    if config.camera is not None:
        camera_named(config.camera)
    if config.audit is not None:
        os.close(open_audit_file(config.audit))
    # A server in lockstep leaves the interpreter's settings as they are.
    server = build_server(
        replace(config, lockstep=True, playground=False), token_file(config), lambda: 0
    )
    await server.start()
    await server.close()
