"""The command log: step commands from Kafka to a robot, and what it answers."""
