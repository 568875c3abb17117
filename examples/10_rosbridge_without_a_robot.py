"""The rosbridge library alone: a server with a topic and a service of your own, and a client that uses both."""

import argparse
import asyncio
from typing import Any

from teleop.rosbridge import Client, Protocol, Server, TypeRegistry


def add(client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
    return {"sum": request["a"] + request["b"]}


async def main() -> None:
    async with Server(Protocol(TypeRegistry()), port=0) as server:  # 0: any free port
        server.protocol.topics.advertise("/greeting", "std_msgs/String", latch=True)
        server.protocol.topics.publish("/greeting", {"data": "hello"}, 0)
        server.protocol.services.serve("/add", "example_interfaces/AddTwoInts", add)
        async with Client(server.url) as client:
            received: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
            await client.subscribe("/greeting", "std_msgs/String", received.put_nowait)
            print("topic:", (await received.get())["data"])
            print("service:", (await client.call("/add", {"a": 2, "b": 3}))["sum"])


if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__).parse_args()
    asyncio.run(main())
