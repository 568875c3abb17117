"""What clients of other rosbridge servers expect besides the protocol: rosapi, rosout, actionlib, tf2."""
