"""The airframe that the observer's tests fly: the f550 of Kalaitzakis & Vitzilaios 2023 under motion capture."""

from __future__ import annotations

from uasfly.airframe import (
    Airframe,
    Backup,
    Battery,
    ControllerSettings,
    FirstOrder,
    Limits,
    ModelParameters,
    ObserverNoise,
    Pid,
    Weights,
)

F550_NOISE = ObserverNoise(
    acceleration_density=0.05,
    attitude_density=0.01,
    force_density=1.0,
    gnss_bias_density=0.01,
    velocity_wander_m_s=0.005,
    attitude_wander_rad=0.0005,  # the recorded flight goes 76 m away: more would hide all else in where the marker is
    wander_time_s=4.0,
    position_sigma_m=0.01,
    attitude_sigma_rad=0.0035,
    velocity_sigma_m_s=0.05,
    matching_window_s=2.0,
)


def f550(**noise: float) -> Airframe:
    """The f550; keyword arguments replace fields of its observer noise."""
    pid = Pid(kp=1.0, ki=0.1, kd=1.0, integral_limit=1.0)
    return Airframe(
        name="f550",
        mass_kg=1.8,
        rotors=6,
        plant="f550",
        model=ModelParameters(
            k_thrust_m_s2=28.54209,
            drag_1_s=(0.26057, 0.26057, 0.0),
            roll=FirstOrder(tau_s=0.14115, gain=0.99386),
            pitch=FirstOrder(tau_s=0.14199, gain=1.00199),
            command_delay_s=0.03,
        ),
        limits=Limits(
            wind_m_s=12.0,
            tilt_deg=25.0,
            thrust_min=0.1,
            thrust_max=0.7,
            speed_m_s=5.0,
            climb_m_s=2.0,
            descent_m_s=1.5,
            acceleration_m_s2=3.0,
            yaw_rate_deg_s=90.0,
        ),
        controller=ControllerSettings(
            rate_hz=50.0,
            horizon_s=3.0,
            nodes=30,
            first_interval_s=0.05,
            weights=Weights(
                position=(25.0, 25.0, 17.0),
                velocity=(11.0, 11.0, 11.0),
                tilt=(1.0, 1.0),
                roll=135.0,
                pitch=135.0,
                thrust=750.0,
                terminal=600.0,
            ),
        ),
        yaw_pid=Pid(kp=0.3, ki=0.0, kd=0.4, integral_limit=0.0),
        backup=Backup(horizontal=pid, vertical=pid),
        observer=F550_NOISE.model_copy(update=noise),
        battery=Battery(reference_voltage_v=14.8, thrust_exponent=1.0),
    )
