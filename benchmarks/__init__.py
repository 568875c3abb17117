"""How fast are we, and how fast are others who do the same?"""
