"""The controllers that a flight can choose from, and what it may expect of any of them."""

from uasfly.control.nmpc_controller import NmpcController
from uasfly.control.pid_controller import PidController
from uasfly.control.pid_dd_controller import PidDdController
from uasfly.control.protocol import Controller, ControlResult, ReferenceAt, Timer

__all__ = ["ControlResult", "Controller", "NmpcController", "PidController", "PidDdController", "ReferenceAt", "Timer"]
