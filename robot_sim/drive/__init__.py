"""From commands to wheels and back: motors, tyres, encoders, firmware, and what the robot ran into."""
