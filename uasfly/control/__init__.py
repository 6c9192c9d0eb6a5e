"""The controllers: NMPC, yaw PID, backup PID and the thrust map.

Reading order for the NMPC: `problem` (weights, bounds, grid), `transcription` (one interval and its Jacobian),
`references` (what flies the path in wind), `qp` with `riccati`, `qp_riccati` and `interior_point` (the quadratic
program), `iteration` (real-time iteration on one of two backends, `compiled` and `virtual_machine`), `nmpc_controller`
(the cycle around it).
"""
