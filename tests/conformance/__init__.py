"""The simulated vehicle held to PX4: one table of what differs; `python -m tests.conformance` prints it."""
