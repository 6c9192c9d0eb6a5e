"""Calibration of a camera: its lens, from pictures of a ChArUco board."""
