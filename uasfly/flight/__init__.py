"""The pure step: phases, safety monitors, summary."""
