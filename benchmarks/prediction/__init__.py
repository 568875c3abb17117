"""How well the predicted path says where the robot will be."""
