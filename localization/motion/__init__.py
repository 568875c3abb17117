"""How the robot moves between sweeps: motion model, deskewing, KISS-ICP odometry, slip and standstill."""
