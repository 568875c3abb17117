"""Services and topics of other rosbridge servers that clients expect: rosapi, rosout, actionlib, tf2."""
