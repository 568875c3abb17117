"""From a client to the wheels over the wire: delay, watchdog, soak."""
