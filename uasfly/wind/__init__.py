"""What the wind does to the vehicle: disturbance observers for forces and torques, and a split into bands."""
