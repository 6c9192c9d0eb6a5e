"""The child that `uasfly.sim.mavlink.process.start_process` starts; for a vehicle by hand there is `uasfly sim`."""

from uasfly.sim.mavlink.child import main

if __name__ == "__main__":
    main()
