"""The Scene screen: the choice of a scene, and the images and clouds of its camera nodes."""
