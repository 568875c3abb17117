"""Command lines of the localiser: localise, calibrate and map logs; and the table of settings."""
