"""Drawing in rerun, shared by the recording of a localised log and the operator's display."""
