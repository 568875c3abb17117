"""The interface of an emulated link between the clients and the server."""

from __future__ import annotations


class FrameDelay:
    """When frames get through an emulated link; this one is without any delay.

    Every time is in [ns] of the protocol's clock. A protocol asks once for each frame, in their
    order; of one client and direction, no frame gets through before an earlier one. Pings and pongs
    are asked about as such: they take their bytes' time of the link, and delay no frame otherwise.
    What an address sends and receives by HTTP is that of a client whose id is the address.
    """

    def bypasses(self, payload: str | bytes) -> bool:
        """Return whether a frame does not take the link, as the calls that advance simulated time."""
        return False

    def arrival(self, client: int | str, size: int, now: int, *, ping: bool = False) -> int:
        """Return when the server receives a frame of ``size`` bytes that a client sent at ``now``."""
        return now

    def departure(self, client: int | str, size: int, now: int, *, ping: bool = False) -> int:
        """Return when a client receives a frame of ``size`` bytes that the server sends at ``now``."""
        return now

    def free(self, client: int | str, now: int) -> int:
        """Return from when on the link takes another frame for a client; ``now`` if it is free.

        A link of limited rate returns when the frames that it took will have left. Until then
        further ones wait in a queue in which newer messages replace older ones.
        """
        return now
