"""The simulated vehicle on MAVLink: speaks over UDP as PX4 does on its onboard link.

`server.serve` runs a vehicle in this process, `process.start_process` in a process of its own.
"""
