"""Where the scanners are mounted: watched while driving, estimated from a drive."""
