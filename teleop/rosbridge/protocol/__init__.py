"""The rosbridge protocol without sockets: connections, dispatch of operations, observers."""
