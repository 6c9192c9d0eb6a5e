"""uasfly flies PX4 multirotors accurately where GNSS is poor and the wind gusts."""

__version__ = "0.1.0"
