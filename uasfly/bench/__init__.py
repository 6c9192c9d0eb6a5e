"""How fast this computer is: solver, observer, whole cycle and link, and what an airframe file should set for it."""
