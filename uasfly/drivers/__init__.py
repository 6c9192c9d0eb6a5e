"""The drivers of the pure step: live over MAVSDK, rehearsal in one process."""
