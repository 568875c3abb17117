"""``python -m teleop.rosbridge``: a rosbridge server without a robot, which relays between clients."""

from __future__ import annotations

import argparse
import asyncio
import signal
import sys
from pathlib import Path

from teleop.rosbridge.auth.origins import LOOPBACK
from teleop.rosbridge.compat.client_traffic import publish_client_traffic
from teleop.rosbridge.compat.standard_services import serve_standard
from teleop.rosbridge.errors import RosbridgeError
from teleop.rosbridge.messages.type_registry import TypeRegistry
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.server.server import Server


def main(arguments: list[str] | None = None) -> int:
    """Serve until interrupted; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m teleop.rosbridge", description=__doc__)
    parser.add_argument("--host", default="127.0.0.1", help="address to listen on")
    parser.add_argument(
        "--port", type=int, default=9090, help="port to listen on; 0 selects a free one"
    )
    parser.add_argument(
        "--messages",
        type=Path,
        action="append",
        default=[],
        metavar="FOLDER",
        help="add the .msg, .srv and .action files of a package's folder; may be repeated",
    )
    parser.add_argument("--ros1", action="store_true", help="report ROS 1 to clients")
    options = parser.parse_args(arguments)
    try:
        asyncio.run(_serve(options))
    except RosbridgeError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    return 0


async def _serve(options: argparse.Namespace) -> None:
    protocol = Protocol(
        TypeRegistry(options.messages), ros_version="ros1" if options.ros1 else "ros2"
    )
    server = Server(protocol, options.host, options.port)
    serve_standard(protocol)
    publish_client_traffic(server)
    stop = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, stop.set)
    async with server:
        sys.stdout.write(f"rosbridge at {server.url}; Ctrl-C ends\n")
        if options.host not in LOOPBACK:
            sys.stdout.write("warning: any program that can reach this address can connect\n")
        sys.stdout.flush()
        await stop.wait()


if __name__ == "__main__":
    sys.exit(main())
