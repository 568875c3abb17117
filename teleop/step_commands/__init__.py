"""Step commands as JSON, as headsets and scripts send them: pure parsing, without a robot."""
