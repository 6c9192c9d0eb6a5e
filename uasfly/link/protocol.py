"""The vehicle as the flight sees it: one protocol with two ends, MAVSDK and in-process."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol

from uasfly.messages import Array, Request, Sample, Setpoint
from uasfly.wind_messages import WindEstimate


class VehicleLink(Protocol):
    """What every end of the link offers to a driver. All times are the host's, see `messages`."""

    def poll(self) -> tuple[Sample, ...]:
        """Samples that have arrived since the last call, oldest first; never blocks."""
        ...

    def send(self, setpoint: Setpoint) -> bool:
        """Send one setpoint, once; False where it is too old to leave.

        Raises:
            ValueError: when a field is not finite or the thrust is outside 0..1: such a setpoint never leaves.
        """
        ...

    def request(self, request: Request) -> None:
        """Ask the vehicle for something; the answer comes as a RequestResult in a later `poll`."""
        ...

    def send_text(self, severity: int, text: str) -> None:
        """Send a status text for the ground station; severity as in MAVLink, 0 emergency .. 7 debug."""
        ...

    def send_wind(self, wind: WindEstimate) -> None:
        """Tell the ground station the wind."""
        ...


class InspectedLink(VehicleLink, Protocol):
    """A link that also tells what a preflight check asks for."""

    async def read_parameters(self, names: Iterable[str]) -> dict[str, float | None]:
        """Parameters of the vehicle by name; None for one that it does not tell."""
        ...

    async def home(self) -> Array | None:
        """Home in PX4's local frame, (3,) m, ENU; None where it is not told."""
        ...

    def message_rates(self) -> dict[str, float]:
        """Rates [Hz] at which messages arrive, by name."""
        ...

    def losses(self) -> dict[str, int]:
        """What was lost, by cause."""
        ...

    @property
    def round_trip_s(self) -> float:
        """Smallest recent TIMESYNC round trip [s]; NaN before the first answer."""
        ...


class LiveLink(VehicleLink, Protocol):
    """What a driver in real time needs beside that."""

    async def wait_for_motion(self, timeout_s: float) -> bool:
        """Wait until the next motion sample arrives, at most so long [s]; whether one has."""
        ...
