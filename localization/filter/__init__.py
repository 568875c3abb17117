"""The error-state Kalman filter of a skid-steer robot."""
