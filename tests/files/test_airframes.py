"""The shipped airframes are what their sources say, and can hold the wind that they name."""

from __future__ import annotations

import math

import numpy as np
import pytest

from uasfly.airframe import GRAVITY_M_S2, Airframe
from uasfly.files import find_file, load_file, shipped_names
from uasfly.sim.plant import Plant
from uasfly.trajectories.feasibility import check_airframe, hover_wind_limit_m_s

NAMES = ("aurelia_x6", "f550", "iris", "px4_sih")


def airframe(name: str) -> Airframe:
    """A shipped airframe."""
    return load_file(find_file("airframe", name), Airframe)


def test_the_four_airframes_are_shipped() -> None:
    """Neither more nor less than the documentation says."""
    assert tuple(shipped_names("airframe")) == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_file_and_airframe_have_one_name_and_a_plant(name: str) -> None:
    """The plant is a shipped one of the same mass and rotor count."""
    frame = airframe(name)
    plant = load_file(find_file("plant", frame.plant), Plant)
    assert frame.name == name
    assert plant.mass_kg == frame.mass_kg
    assert plant.rotors.count == frame.rotors


@pytest.mark.parametrize(
    ("name", "hover"),
    [
        ("f550", 0.3436),
        ("aurelia_x6", 0.3012),
        ("iris", 0.7081),
    ],
)
def test_the_papers_airframes_hover_where_the_paper_says(name: str, hover: float) -> None:
    """k_thrust is the paper's."""
    assert airframe(name).model.hover_thrust == pytest.approx(hover, abs=1e-4)


@pytest.mark.parametrize("name", NAMES)
def test_the_limits_hold_the_wind_that_they_name_with_a_margin(name: str) -> None:
    """Unlike the paper's +-0.1 rad, which its own blower overpowers."""
    frame = airframe(name)
    assert check_airframe(frame) == []
    assert hover_wind_limit_m_s(frame) > frame.limits.wind_m_s


def test_the_f550_holds_the_strongest_jet_in_all_directions() -> None:
    """14.8 m/s push with 0.0155 v^2 = 3.4 m/s^2; a third of the tilt is left."""
    frame = airframe("f550")
    push = 0.0155 * 14.8**2
    assert push / (GRAVITY_M_S2 * math.tan(frame.limits.tilt_rad)) < 0.67
    lifted, pressed = GRAVITY_M_S2 - push, math.hypot(push, GRAVITY_M_S2 + push)
    assert frame.limits.thrust_min < lifted / frame.model.k_thrust_m_s2
    assert pressed / frame.model.k_thrust_m_s2 < frame.limits.thrust_max


@pytest.mark.parametrize("name", NAMES)
def test_the_backup_pids_are_stable_with_the_airframes_lag_and_delay(name: str) -> None:
    """The loop gain crosses one once, 45 degrees and 10 dB are spare; 30 ms are added for estimation."""
    frame = airframe(name)
    s = 1j * np.logspace(-3, 2, 50_000)
    for gains, lag, delay in (
        (frame.backup.horizontal, frame.model.pitch.tau_s, frame.model.command_delay_s + 0.03),
        (frame.backup.vertical, 0.06, 0.06),
    ):
        loop = (gains.kd * s + gains.kp + gains.ki / s) * np.exp(-delay * s) / (s**2 * (lag * s + 1.0))
        (crossing,) = np.flatnonzero((np.abs(loop[:-1]) >= 1.0) & (np.abs(loop[1:]) < 1.0))
        assert math.degrees(np.angle(-loop[crossing])) > 45.0
        turned = np.flatnonzero((np.diff(np.sign(loop.imag)) != 0) & (loop.real[:-1] < 0) & (np.abs(loop[:-1]) < 1.0))
        assert np.abs(loop[turned[0]]) < 10 ** (-10 / 20)


def test_an_airframe_that_cannot_hold_its_wind_is_told() -> None:
    """The answer names what can be held."""
    frame = airframe("f550")
    strong = frame.model_copy(update={"limits": frame.limits.model_copy(update={"wind_m_s": 20.0})})
    (warning,) = check_airframe(strong)
    assert (warning.severity, warning.field) == ("warning", "limits.wind_m_s")
    assert "21.7 m/s" in warning.text
    assert "lower it to 18" in warning.text
    (error,) = check_airframe(frame.model_copy(update={"limits": frame.limits.model_copy(update={"wind_m_s": 25.0})}))
    assert error.severity == "error"
