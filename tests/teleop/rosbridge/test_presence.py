from __future__ import annotations

from teleop.rosbridge.presence import announce_clients
from tests.teleop.rosbridge.support import Wire


def test_clients_hear_how_many_they_are_and_from_where() -> None:
    wire = Wire(clients=0)
    announce_clients(wire.protocol)
    wire.now += 7
    wire.clients = [wire.protocol.connect(wire.now, "10.0.0.5:1234")]
    for topic in ("/client_count", "/connected_clients"):
        wire.send({"op": "subscribe", "topic": topic})
    count, clients = wire.heard()
    assert count["msg"] == {"data": 1}
    (only,) = clients["msg"]["clients"]
    assert only["ip_address"] == "10.0.0.5"
    assert (only["connection_time"]["sec"], only["connection_time"]["nanosec"]) == (1, 7)
    other = wire.protocol.connect(wire.now, "::1:9")
    assert wire.heard()[0]["msg"] == {"data": 2}
    wire.protocol.disconnect(other, wire.now)
    assert wire.heard()[0]["msg"] == {"data": 1}
