from __future__ import annotations

from dataclasses import replace

from uasfly.sim.land_detector import LandDetector, LandEvidence
from uasfly.sim.parameters import ParameterTable

STANDING = LandEvidence(True, 0.0, 0.5, (0.0, 0.0, 0.0), 0.0, 9.8, True, False)
FLYING = replace(STANDING, thrust=0.5)
LANDING = replace(STANDING, thrust=0.3, wants_down=True)


def watch(detector: LandDetector, evidence: LandEvidence, start_s: float, seconds: float) -> float:
    """Show the same evidence for a while; gives the time after it."""
    for step in range(round(seconds / 0.04)):
        detector.update(start_s + 0.04 * step, evidence)
    return start_s + seconds


def flying_detector() -> tuple[LandDetector, float]:
    """A detector that has seen a take-off."""
    detector = LandDetector(ParameterTable())
    return detector, watch(detector, FLYING, 0.0, 2.0)


def test_thrust_means_take_off() -> None:
    """Landed at first; thrust near hover ends it at once."""
    detector = LandDetector(ParameterTable())
    assert detector.landed
    watch(detector, STANDING, 0.0, 5.0)
    assert detector.landed
    detector.update(5.0, FLYING)
    assert not detector.landed
    assert not detector.ground_contact


def test_landing_goes_through_its_stages() -> None:
    """Low thrust, meant to sink, not moving: contact; no thrust: landed; each a third of a second later."""
    detector, now = flying_detector()
    now = watch(detector, LANDING, now, 0.3)
    assert not detector.ground_contact
    now = watch(detector, LANDING, now, 0.2)
    assert detector.ground_contact
    assert not detector.maybe_landed
    idle = replace(LANDING, thrust=0.0)
    now = watch(detector, idle, now, 0.45)
    assert detector.maybe_landed
    assert not detector.landed
    watch(detector, idle, now, 0.4)
    assert detector.landed


def test_a_low_thrust_glide_is_no_landing() -> None:
    """Moving down, sideways fast, or without wanting to, is not contact."""
    for evidence in (
        replace(LANDING, velocity=(0.0, 0.0, -0.5)),
        replace(LANDING, velocity=(2.0, 0.0, 0.0)),
        replace(LANDING, wants_down=False),
    ):
        detector, now = flying_detector()
        watch(detector, evidence, now, 5.0)
        assert not detector.ground_contact


def test_free_fall_and_turning_are_no_landing() -> None:
    """Falling with motors off, or tumbling, never counts as landed."""
    for evidence in (
        replace(LANDING, thrust=0.0, specific_force_m_s2=0.5),
        replace(LANDING, thrust=0.0, tilt_rate_rad_s=2.0),
    ):
        detector, now = flying_detector()
        watch(detector, evidence, now, 5.0)
        assert not detector.maybe_landed


def test_in_offboard_low_thrust_alone_lands() -> None:
    """Without a mode that controls the climb nobody says it wants down."""
    detector, now = flying_detector()
    watch(detector, replace(STANDING, thrust=0.05, controls_climb=False), now, 1.2)
    assert detector.landed


def test_disarmed_is_landed() -> None:
    """A disarmed vehicle counts as landed after its second."""
    detector, now = flying_detector()
    watch(detector, replace(FLYING, armed=False), now, 1.2)
    assert detector.landed
