"""The protocol on WebSockets: listener, connections, send queues, HTTP pages."""
