"""Reference trajectories: position, velocity, acceleration and yaw at any time.

`MissionTrajectory` turns a mission file into one reference; `check_mission` says what an airframe cannot do of it.
"""
