"""The ROS graph of one server: topics, services, actions, parameters."""
