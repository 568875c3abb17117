"""The rosbridge server beside others, and commands through Kafka."""
