"""Drivetrain: motor commands, tyres, encoders, motor controller, contacts and condition."""
