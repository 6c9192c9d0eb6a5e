"""The preflight check as the step sees it: it listens while the flight gets ready, and judges once."""

from __future__ import annotations

from collections import deque

from uasfly.airframe import Airframe
from uasfly.flight.choices import Engage
from uasfly.flight.preflight.gathered import Gathered
from uasfly.flight.preflight.judging import judge
from uasfly.flight.view import VehicleView
from uasfly.messages import Array, FactsSample, Sample, StateEstimate
from uasfly.mission import Mission
from uasfly.observer.diagnosis import Diagnosis
from uasfly.preflight_messages import PreflightCheck

AGES_KEPT = 100  # cycles
FACTS_PATIENCE_S = 4.0  # the driver is done within three; without its facts much is not known, and told so


class Preflight:
    """Collects what the checks look at.

    Args:
        mission, airframe: what is to be flown.
        engage: who brings the vehicle into offboard.
    """

    def __init__(self, mission: Mission, airframe: Airframe, engage: Engage) -> None:
        self._mission = mission
        self._airframe = airframe
        self._engage = engage
        self._facts: FactsSample | None = None
        self._ages: deque[float] = deque(maxlen=AGES_KEPT)
        self._waiting_since_s: float | None = None

    def look(self, time_s: float, samples: tuple[Sample, ...], view: VehicleView) -> None:
        """Take in one step; call it until the vehicle is ready."""
        self._ages.append(view.odometry_age_s(time_s))
        for sample in samples:
            if isinstance(sample, FactsSample):
                self._facts = sample

    def has_facts(self, time_s: float) -> bool:
        """Whether all is there that will come; called in each step from when nothing else is waited for."""
        if self._waiting_since_s is None:
            self._waiting_since_s = time_s
        return self._facts is not None or time_s - self._waiting_since_s > FACTS_PATIENCE_S

    def judge(
        self, view: VehicleView, estimate: StateEstimate | None, diagnosis: Diagnosis | None, origin: Array | None
    ) -> tuple[PreflightCheck, ...]:
        """The checks, from what is known now."""
        self._waiting_since_s = None
        return judge(
            Gathered(
                mission=self._mission,
                airframe=self._airframe,
                engage=self._engage,
                view=view,
                estimate=estimate,
                diagnosis=diagnosis,
                origin=origin,
                ages_s=tuple(self._ages),
                facts=self._facts,
            )
        )
