"""Entry of the simulated camera's own process."""

from uasfly.sim.camera.child import main

main()
