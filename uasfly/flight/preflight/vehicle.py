"""Health, estimate and GNSS: what the vehicle says of itself, and whether the observer agrees."""

from __future__ import annotations

import math
from collections.abc import Iterator

from uasfly.flight.monitors.gnss import FIX
from uasfly.flight.preflight.gathered import Gathered, Subject
from uasfly.flight.readiness import unready
from uasfly.preflight_messages import PreflightCheck

NIS_WARNING = 3.0  # about 1 when consistent: errors 1.7 times as large as the airframe file says
REJECTED_WARNING = 0.1  # gates refuse half a per cent of good measurements

_HEALTH = Subject("health", "PX4's take-off, hold and landing need its attitude, velocity and position")
_ESTIMATE = Subject("estimate", "the controller flies by velocity and position as the observer knows them")
_CONSISTENCY = Subject("consistency", "measurements that contradict each other mean a sensor or the model is wrong")
_GNSS = Subject("gnss", "poor GNSS moves the whole mission and takes PX4's hold and return away")


def vehicle_checks(gathered: Gathered) -> Iterator[PreflightCheck]:
    """All checks of this file."""
    yield _health(gathered)
    yield _estimate(gathered)
    yield _consistency(gathered)
    yield _gnss(gathered)


def _health(gathered: Gathered) -> PreflightCheck:
    health = gathered.view.health
    if health is None:
        return _HEALTH.warning("not told", "ESTIMATOR_STATUS does not arrive: look at PX4's health in a ground station")
    flags = {"attitude": health.attitude_ok, "velocity": health.velocity_ok, "position": health.position_ok}
    bad = [name for name, fine in flags.items() if not fine]
    if bad:
        return _HEALTH.stop(f"no valid {', '.join(bad)}", "wait for PX4's estimator, or see what it complains about")
    return _HEALTH.ok("attitude, velocity and position are valid")


def _estimate(gathered: Gathered) -> PreflightCheck:
    estimate = gathered.estimate
    missing = unready(gathered.view, estimate)
    if missing or estimate is None:
        remedy = "keep the vehicle still and under the open sky, and see that ODOMETRY arrives"
        return _ESTIMATE.stop(missing, remedy)
    position, velocity = float(estimate.position_sigma_m.max()), float(estimate.velocity_sigma_m_s.max())
    return _ESTIMATE.ok(f"position to {position:.2f} m, velocity to {velocity:.2f} m/s")


def _consistency(gathered: Gathered) -> PreflightCheck:
    diagnosis = gathered.diagnosis
    if diagnosis is None:
        return _CONSISTENCY.warning("not known", "the observer has seen no odometry")
    remedy = "calibrate the sensors, keep still, and compare the sigmas in the airframe file with PX4's noise"
    shares = {name: share for name, share in diagnosis.rejected_share.items() if not math.isnan(share)}
    errors = {name: nis for name, nis in diagnosis.nis_mean.items() if not math.isnan(nis)}
    sensor, share = max(shares.items(), key=lambda item: item[1], default=("", 0.0))
    if share > REJECTED_WARNING:
        value = f"{share * 100.0:.0f} % of PX4's {sensor} contradicts the estimate"
        if share > gathered.mission.monitors.estimate.rejected_share:
            return _CONSISTENCY.stop(value, remedy)
        return _CONSISTENCY.warning(value, remedy)
    sensor, nis = max(errors.items(), key=lambda item: item[1], default=("", 0.0))
    value = f"errors squared {nis:.1f} times the expected" + (f" ({sensor})" if sensor else "")
    return _CONSISTENCY.warning(value, remedy) if nis > NIS_WARNING else _CONSISTENCY.ok(value)


def _gnss(gathered: Gathered) -> PreflightCheck:
    health, settings = gathered.view.health, gathered.mission.monitors.gnss_degraded
    if health is None:
        return _GNSS.warning("not told", "look at the satellites in a ground station")
    if health.gnss_fix < FIX:
        if health.position_ok:
            return _GNSS.warning("no fix", "see that PX4's position comes from somewhere else (motion capture, vision)")
        return _GNSS.stop("no fix", "wait for a 3D fix, or give PX4 another source of its position")
    known = math.isfinite(health.horizontal_accuracy_m)
    accuracy = f"accurate to {health.horizontal_accuracy_m:.1f} m" if known else "accuracy not told"
    satellites = f"{health.gnss_satellites} satellites" if health.gnss_satellites else "satellites not told"
    value = f"{satellites}, {accuracy}"
    if known and health.horizontal_accuracy_m > settings.accuracy_m:
        return _GNSS.warning(value, f"wait until it is within {settings.accuracy_m:g} m, or move into the open")
    if 0 < health.gnss_satellites < settings.satellites:
        return _GNSS.warning(value, f"wait for {settings.satellites} satellites, or move into the open")
    return _GNSS.ok(value)
