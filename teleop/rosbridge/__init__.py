"""A rosbridge v2 library: the protocol without sockets, its messages, a server, a client."""
