"""The simulated camera: a bundle of markers rendered from the true pose, with what a real camera does to a picture."""
