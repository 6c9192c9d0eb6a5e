"""The vehicle as seen from a companion computer."""
