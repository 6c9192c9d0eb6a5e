"""Fuzzing: seeded random inputs for everything that reads what others wrote. See `__main__`."""
