"""What a person drives with: keyboard and gamepad."""
