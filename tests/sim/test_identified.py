"""Every plant, flown and fitted as an airframe is, comes out near its airframe's figures (REFERENCE section 2)."""

from __future__ import annotations

import pytest

from tests.sim.excitation import fit_attitude, fit_translation, fly_doublets
from tests.sim.plants import plant

# hover thrust, tau of roll and pitch [s], k_thrust [m/s^2], drag [1/s] of the reference; dead time [s] of our own loops
REFERENCE = {
    "f550": (0.3436, (0.14115, 0.14199), 28.54209, 0.26057, 0.032),
    "aurelia_x6": (0.3012, (0.23424, 0.25646), 32.56196, 0.10628, 0.058),
    "iris": (0.7081, (0.15478, 0.15057), 13.85007, 0.37189, 0.051),
}


@pytest.mark.parametrize("name", REFERENCE)
def test_a_flown_plant_has_its_airframes_figures(name: str) -> None:
    """Time constants and drag within 4 %, k_thrust within 0.3 %, at the reference voltage; gains are 0.99.

    The reference's gains (0.994 and 1.002, 0.965 and 0.964, 1.036 and 1.013) are not reproduced vehicle by vehicle: a
    rate loop with an integral part has gain 1 in the end, and what a fit over short doublets leaves of it is 0.99.
    """
    hover, taus, k_thrust, drag, dead_time = REFERENCE[name]
    flight = fly_doublets(plant(name, {"battery.lowers_thrust": False}), hover, seed=1)
    for axis, tau in enumerate(taus):
        fitted_tau, fitted_gain, fitted_dead_time = fit_attitude(flight.commands[:, axis], flight.angles[:, axis])
        assert fitted_tau == pytest.approx(tau, rel=0.04)
        assert fitted_gain == pytest.approx(0.99, abs=0.01)
        assert fitted_dead_time == pytest.approx(dead_time, abs=0.006)
    fitted_thrust, fitted_drag = fit_translation(flight)
    assert fitted_thrust == pytest.approx(k_thrust, rel=3e-3)
    assert fitted_drag == pytest.approx(drag, rel=0.04)


def test_the_sih_quadrotor_has_the_simulators_figures() -> None:
    """k_thrust 20.0 and drag 1.0 of PX4's simulator are found again from a flight."""
    k_thrust, drag = fit_translation(fly_doublets(plant("px4_sih"), 0.4905, seed=1, doublets=6))
    assert k_thrust == pytest.approx(20.0, rel=2e-3)
    assert drag == pytest.approx(1.0, rel=5e-3)
