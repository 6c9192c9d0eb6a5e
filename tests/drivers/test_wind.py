"""The wind that a flight tells, against the true one."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import chi2

from tests.drivers.test_live_faults import HoveringLink
from tests.winds import wind_estimate
from uasfly.drivers.live import _LiveFlight
from uasfly.drivers.plan import load_plan
from uasfly.drivers.rehearse import rehearse
from uasfly.flight.tracking_errors import MarkerDatum
from uasfly.messages import Phase, Sample, Status, TruthSample, VehicleSample
from uasfly.wind_messages import WindEstimate


class Flown:
    """A rehearsal's winds in the legs, the true one around them, and the summary."""

    def __init__(self, airframe: str, settings: list[str]) -> None:
        self.statuses: list[Status] = []
        self.airborne_s = math.inf
        self._truths: list[TruthSample] = []
        plan = load_plan("hover", airframe, scenario="gusty", seed=3, settings=settings)
        self.summary: dict[str, Any] = rehearse(plan, witness=self._see)
        self._times = np.array([truth.time_s for truth in self._truths])
        self._winds = np.array([truth.wind_in_world[:2] for truth in self._truths])
        self.winds: list[WindEstimate] = []
        self.shown_s: list[float] = []  # when each was first told
        for status in self.statuses:
            wind = status.wind
            if status.phase is Phase.LEGS and wind is not None and not (self.winds and wind is self.winds[-1]):
                self.winds.append(wind)
                self.shown_s.append(status.time_s)

    def _see(self, status: Status, samples: tuple[Sample, ...], _: MarkerDatum | None) -> None:
        self.statuses.append(status)
        for sample in samples:
            if isinstance(sample, TruthSample):
                self._truths.append(sample)
            elif isinstance(sample, VehicleSample) and sample.in_air:
                self.airborne_s = min(self.airborne_s, sample.time_s)

    def at(self, time_s: float) -> NDArray[np.float64]:
        """The true wind."""
        return np.array([np.interp(time_s, self._times, axis) for axis in self._winds.T])

    def mean(self, wind: WindEstimate) -> NDArray[np.float64]:
        """The true mean over the time that a mean is about."""
        begin, end = np.searchsorted(self._times, (wind.time_s - wind.averaged_s, wind.time_s))
        mean: NDArray[np.float64] = self._winds[begin:end].mean(axis=0)
        return mean


@pytest.mark.parametrize("airframe", ["f550", "aurelia_x6"])
def test_the_wind_in_a_gusty_hover_is_the_true_one(airframe: str) -> None:
    """8 m/s at 10 m with Dryden gusts, all sensors noisy: mean of 10 s, direction, gusts and sigmas.

    Speed to 0.3 m/s and direction to 4 degrees RMS, the present wind to 0.6 m/s (0.7 m/s when it is shown, some 60 ms
    later), known within 5 s in the air and before offboard. The normalised errors stay below the upper bound of
    chi-square; errors of the attitude last, so that half a minute is about four independent samples of the mean's.
    """
    flown = Flown(airframe, ["mission.legs[0].duration_s=25"])
    assert flown.summary["outcome"] == "completed"
    first = next(status for status in flown.statuses if status.wind is not None)
    assert first.phase is Phase.TAKEOFF
    assert first.time_s - flown.airborne_s < 5.0
    present = np.array([wind.velocity_in_world - flown.at(wind.time_s) for wind in flown.winds])
    assert np.sqrt((present**2).sum(axis=1).mean()) < 0.6
    shown = np.array([wind.velocity_in_world - flown.at(s) for wind, s in zip(flown.winds, flown.shown_s, strict=True)])
    assert np.sqrt((shown**2).sum(axis=1).mean()) < 0.7
    assert flown.summary["wind"]["error_rms_m_s"] == pytest.approx(np.sqrt((present**2).sum(axis=1).mean()), abs=0.02)
    normalised = [e @ np.linalg.solve(wind.covariance, e) for e, wind in zip(present, flown.winds, strict=True)]
    assert 0.3 < np.mean(normalised) < chi2.ppf(0.975, 2 * 25) / 25
    means = [wind for wind in flown.winds if wind.averaged_s > 9.9]
    true = np.array([flown.mean(wind) for wind in means])
    speeds = np.array([wind.mean_speed_m_s for wind in means]) - np.hypot(*true.T)
    assert np.sqrt(np.mean(speeds**2)) < 0.3
    origin = np.degrees(np.arctan2(-true[:, 0], -true[:, 1]))
    turned = (np.array([wind.mean_from_deg for wind in means]) - origin + 180.0) % 360.0 - 180.0
    assert np.sqrt(np.mean(turned**2)) < 4.0
    errors = [wind.mean_in_world - mean for wind, mean in zip(means, true, strict=True)]
    normalised = [e @ np.linalg.solve(wind.mean_covariance, e) for e, wind in zip(errors, means, strict=True)]
    assert np.mean(normalised) < chi2.ppf(0.975, 2 * 4) / 4
    assert 0.5 * np.hypot(*true.T).max() < means[-1].gust_m_s - 1.0 < 10.0
    assert flown.statuses[-1].wind is None  # landed


def test_the_ground_station_hears_the_wind_once_a_second() -> None:
    """However often the cycle runs; nothing while it is not known."""
    link = HoveringLink("")
    flight = _LiveFlight(None, link, None, None, None, None)  # type: ignore[arg-type]
    for k in range(101):
        wind = wind_estimate() if k >= 50 else None
        flight._tell_ground(Status(k * 0.02, Phase.LEGS, 0, True, 0.5, None, None, wind=wind))
    assert len(link.winds) == 2
