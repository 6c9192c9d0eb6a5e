"""The simulated vehicle: plant, wind, sensors, a PX4-like autopilot and its MAVLink server."""
