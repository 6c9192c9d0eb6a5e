"""Papers flown again: their experiments on the built-in simulation, figure beside figure."""
