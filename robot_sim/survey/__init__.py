"""Views of a world from outside: a total station, rendered pictures, and its static surfaces."""
