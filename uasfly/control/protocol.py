"""What the flight wants of any controller, and what a controller's step gives back."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from uasfly.message_class import message
from uasfly.messages import Array, ReferenceHorizon, Setpoint, StateEstimate

ReferenceAt = Callable[[Array], ReferenceHorizon]  # reference at absolute times (n,) [s], on the clock of the estimates
Timer = Callable[[], float]  # seconds; time.perf_counter where a driver measures


@message
class ControlResult:
    """One step's outcome.

    Attributes:
        setpoint: finite and inside the airframe's limits, always.
        fallback: what replaced the solver's answer: "plan" (the last plan, moved along), "backup" (PIDs), "" nothing.
        solve_ms: time the solver took, 0 where no timer was handed in.
        status: of the solver, `uasfly.control.qp.SolveStatus`.
        predicted_positions: (N + 1, 3) m, the plan in the world; None where there is none.
        text: something new to announce, "" otherwise.
    """

    setpoint: Setpoint
    fallback: str
    solve_ms: float
    status: int
    predicted_positions: Array | None
    text: str


class Controller(Protocol):
    """Turns an estimate and a reference into a setpoint, once a cycle; its clock is the one of its arguments."""

    def reset(self, time_s: float, setpoint: Setpoint | None) -> None:
        """Take over at `time_s` from whatever gave `setpoint` (None: not known), without a bump."""
        ...

    def step(
        self,
        time_s: float,
        estimate: StateEstimate,
        reference_at: ReferenceAt,
        battery_voltage_v: float | None,
    ) -> ControlResult:
        """One cycle at `time_s`; never raises on bad numbers."""
        ...

    def k_thrust_m_s2(self, battery_voltage_v: float | None) -> float:
        """Thrust acceleration at full command that the controller reckons with [m/s^2]."""
        ...

    def trim_thrust(self, trim: float) -> float:
        """The thrust is (1 + trim) times what airframe file and voltage say; returns the trim that is reckoned with.

        One whose integral finds the thrust anyway may return 0.
        """
        ...

    @property
    def fallback_steps(self) -> dict[str, int]:
        """How many steps each fallback has replaced the solver's answer in, by name."""
        ...
