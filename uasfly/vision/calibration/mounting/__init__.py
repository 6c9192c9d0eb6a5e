"""Camera mounting from a log: rotation, lever arm and time offset, with what the motion leaves unknown."""
