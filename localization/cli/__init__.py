"""The commands `farsteer localize` and `farsteer calibrate`, and the table of settings."""
