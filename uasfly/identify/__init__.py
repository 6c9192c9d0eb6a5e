"""Figures of an airframe from the logs of its flights."""
