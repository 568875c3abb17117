"""WebSocket server of the protocol: listener, handshake, send queues, HTTP pages."""
