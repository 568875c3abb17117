"""The Confluent REST proxy's HTTP interface, version 2, in front of any Kafka broker."""
