"""The look of worlds in pictures: textures, sky, lights, and the model that is drawn."""
