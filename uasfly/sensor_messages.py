"""What sensors say: PX4's estimate of its motion, accelerometer, rotor speeds, marker poses, attitude targets, battery.

They flow like the other messages, and everybody takes them from `uasfly.messages`; frames, units and times as there.
"""

from __future__ import annotations

from uasfly.message_class import Array, message


@message
class OdometrySample:
    """PX4's own estimate of its motion (ODOMETRY); the position is GNSS-like: it may carry a slow bias.

    Attributes:
        time_s: when it was true.
        position_in_world: (3,) m, ENU from PX4's local origin.
        velocity_in_world: (3,) m/s.
        quaternion_body_to_world: (4,) unit quaternion.
        angular_rate_in_body: (3,) rad/s.
        reset_counter: grows by one when PX4's estimator jumps.
    """

    time_s: float
    position_in_world: Array
    velocity_in_world: Array
    quaternion_body_to_world: Array
    angular_rate_in_body: Array
    reset_counter: int = 0


@message
class AccelerometerSample:
    """What the accelerometer reads (HIGHRES_IMU): the mean of the readings since the sample before.

    Attributes:
        time_s: the middle of that time.
        specific_force_in_body: (3,) m/s^2, all forces but gravity over the mass; at rest (0, 0, 9.81).
    """

    time_s: float
    specific_force_in_body: Array


@message
class RotorSample:
    """Speeds of the rotors (ESC_STATUS), where the speed controllers tell them.

    Attributes:
        time_s: when they were true.
        speeds_rad_s: (n,) in PX4's motor order; n may be more than there are rotors, the rest says nothing.
    """

    time_s: float
    speeds_rad_s: Array


@message
class MarkerSample:
    """Pose of a marker (or bundle) relative to the body, from a camera frame exposed at `time_s`.

    Attributes:
        marker_id: which marker or bundle.
        position_in_body: (3,) m, marker origin seen from the body origin.
        quaternion_marker_to_body: (4,).
        covariance: (6, 6) of position [m^2, body axes] and rotation [rad^2, marker axes: true = measured * exp(error)].
    """

    time_s: float
    marker_id: int
    position_in_body: Array
    quaternion_marker_to_body: Array
    covariance: Array


@message
class AttitudeTargetSample:
    """What PX4's attitude controller is being asked for (ATTITUDE_TARGET), by whichever mode flies; thrust 0..1."""

    time_s: float
    quaternion_body_to_world: Array
    thrust: float


@message
class BatterySample:
    """Battery as PX4 reports it; `remaining` is 0..1, NaN where unknown."""

    time_s: float
    voltage_v: float
    remaining: float
