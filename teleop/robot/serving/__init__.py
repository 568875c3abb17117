"""The program that serves a robot: settings, server, greeting."""
