"""One sensor of the odometry, number by number: its gate, its matched noise, and what it does when it jumps."""

from __future__ import annotations

import casadi as ca

from uasfly.observer import measurements as me
from uasfly.observer import states as s
from uasfly.observer import update as up
from uasfly.observer.matrices import by_numbers

# A sensor whose mean innovation exceeds this many configured sigmas has jumped; the state then follows it at about this
# speed (see `SensorLogic._recovery`), in the order of states.SENSORS: rad/s, m/s, m/s^2.
JUMP_SIGMAS = 2.0
RECOVERY_RATES = (1.0, 50.0, 30.0)  # the position's goes into the GNSS bias, which nothing flies by; a gust is fast
FOLLOW_RATE_M_S = 3.0  # the state's way back to a position that it has lost


def innovations(core: ca.SX, inputs: ca.SX) -> list[ca.SX]:
    """Measured minus expected, (3,) each, in the order of states.SENSORS [rad], [m], [m/s]."""
    return [
        me.attitude_innovation(core, inputs[s.IN_QUATERNION]),
        inputs[s.IN_POSITION] - me.measure_position(core),
        inputs[s.IN_VELOCITY] - me.measure_velocity(core),
    ]


class SensorLogic:
    """What one sensor decides, as functions; `inputs` are the odometry step's, `mean` (3,) is its mean innovation.

    Args:
        sensor: index into states.SENSORS.
        layout: of the state.

    Attributes:
        jacobian: core -> H (3, n).
        recovery: mean, inputs -> noise (n, n), see `_recovery`.
        test: matched covariance (9,), mean, innovation (3,), H P H', inputs -> see `_test`.
    """

    def __init__(self, sensor: int, layout: s.Layout) -> None:
        self._sensor = sensor
        self._layout = layout
        name, inputs = s.SENSORS[sensor], s.ODOMETRY_INPUTS
        self.jacobian = by_numbers(f"{name}_jacobian", self._jacobian, s.CORE_NOMINAL)
        self.recovery = by_numbers(f"{name}_recovery", self._recovery, 3, inputs)
        self.test = by_numbers(f"{name}_test", self._test, 9, 3, 3, (3, 3), inputs)

    def _jacobian(self, core: ca.SX) -> list[ca.SX]:
        others = ca.SX(3, self._layout.errors - s.CORE_ERROR)
        return [ca.horzcat(me.odometry_jacobian(core, self._sensor), others)]

    def _recovery(self, mean: ca.SX, inputs: ca.SX) -> list[ca.SX]:
        """Noise (n, n) that lets the state follow a sensor that has jumped and stays there.

        After a jump by e the matched R is about e e'. A state with process noise q then closes the gap at e / tau,
        tau = sqrt(r / q), r = R dt: with q = rate^2 dt that is `rate`, whatever the size of the jump and the sample
        rate. So the estimate glides to the new place instead of stepping there, and a jump that returns soon has hardly
        moved it. A jump of the position that is no motion is GNSS's: the noise goes to the bias, which is free
        meanwhile, so that it takes the jump. There the mean counts only innovations outside the gate: what the filter
        expected (after silence) is no jump. One that is motion is where the vehicle is: the state has lost it (in a
        silence), and glides back to it. A velocity that is no motion is not followed.
        """
        sensor = self._sensor
        use, interval, correlation = inputs[s.IN_USE][sensor], inputs[s.IN_INTERVAL], inputs[s.IN_CORRELATION][sensor]
        jumped, motion = self._jumped(mean, inputs), self._is_motion(inputs)
        variance = use * jumped * (interval * RECOVERY_RATES[sensor]) ** 2 * correlation
        diagonal = ca.SX(self._layout.errors, 1)
        match sensor:
            case s.ATTITUDE_SENSOR:
                diagonal[s.D_ATTITUDE] = variance
            case s.POSITION_SENSOR:
                diagonal[s.D_BIAS] = variance * (1.0 - motion)
                diagonal[s.D_POSITION] = use * jumped * motion * (interval * FOLLOW_RATE_M_S) ** 2 * correlation
            case _:
                diagonal[s.D_VELOCITY] = variance * motion
        return [ca.diag(diagonal)]

    def _test(self, matched: ca.SX, mean: ca.SX, residual: ca.SX, expected: ca.SX, inputs: ca.SX) -> list[ca.SX]:
        """What becomes of an innovation (3,) whose covariance is `expected` (H P H') and the sensor's noise.

        Returns:
            The noise (3, 3) to update with, what is allowed of the gain (n, n), the next matched covariance (9,) and
            mean innovation (3,), the normalised innovation squared, and 1 where the innovation is used, else 0.
        """
        sensor, is_position = self._sensor, self._sensor == s.POSITION_SENSOR
        use, jumped, motion = inputs[s.IN_USE][sensor], self._jumped(mean, inputs), self._is_motion(inputs)
        matrix = up.symmetric(ca.reshape(matched, 3, 3))
        noise = up.bounded(matrix, inputs[s.IN_VARIANCE][sensor])
        value, passed, inverse = up.innovation_test(residual, expected, noise, use)
        shortened = ca.sqrt(up.GATE_3 / ca.fmax(value, up.GATE_3)) * residual
        used, taken, free = inputs[s.IN_CORRELATION][sensor] * noise, passed, inputs[s.IN_BIAS_FREE]
        if is_position:  # the state has lost its place: back to the measured one, but not in one step
            lost = use * jumped * motion * (1.0 - passed)
            used, taken = used + lost * ca.dot(residual, residual) * ca.SX.eye(3), passed + lost
            free = ca.fmax(free, jumped * (1.0 - motion))
        # what contradicts everything else is no noise, and must not talk itself in as such
        weight = use * inputs[s.IN_MATCHING_WEIGHT] * (1.0 - jumped * (1.0 - motion))
        told = shortened * (1.0 - passed) if is_position else shortened
        return [
            used,
            taken * self._held(free, inputs[s.IN_WANDER_FREE]),
            ca.vec(up.matched_covariance(matrix, noise, inverse, shortened, weight)),
            mean + use * inputs[s.IN_MEAN_WEIGHT] * (told - mean),
            value,
            taken,
        ]

    def _jumped(self, mean: ca.SX, inputs: ca.SX) -> ca.SX:
        return ca.dot(mean, mean) > JUMP_SIGMAS**2 * inputs[s.IN_VARIANCE][self._sensor]

    def _held(self, bias_free: ca.SX, wander_free: ca.SX) -> ca.SX:
        """Matrix (n, n) on the gain that holds the GNSS bias and the velocity's wander where they are not free (0).

        GNSS alone sees only the sum p + b. What an innovation says of that sum then goes to the position, and the bias
        stays: the position follows GNSS, and the two cannot drift apart. The bias's noise goes on, so that the
        covariance (Joseph) tells how far position and bias, with opposite signs, may have gone. When a marker frees the
        bias nothing jumps. A measured position that has jumped against everything else frees it too: that is an error
        of GNSS, and the vehicle has not moved. The velocity's wander is left to markers: GNSS that drifts would pass
        for it.
        """
        allowed = ca.SX.eye(self._layout.errors)
        allowed[s.D_POSITION, s.D_BIAS] = (1.0 - bias_free) * ca.SX.eye(3)
        allowed[s.D_BIAS, s.D_BIAS] = bias_free * ca.SX.eye(3)
        allowed[s.D_VELOCITY_WANDER, s.D_VELOCITY_WANDER] = wander_free * ca.SX.eye(3)
        return allowed

    def _is_motion(self, inputs: ca.SX) -> ca.SX:
        """1 where what a sensor says against the model is the vehicle's motion, not the sensor's error.

        Position and velocity vouch for each other (see `agreement`); a velocity without a position is believed, and one
        beside a position that is known to be wrong: GNSS runs away, or a marker says where the vehicle is instead. On
        the ground the model has nothing to say against it.
        """
        match self._sensor:
            case s.POSITION_SENSOR if self._layout.markers:
                return inputs[s.IN_AGREES] * (1.0 - inputs[s.IN_BIAS_FREE])
            case s.POSITION_SENSOR:
                return inputs[s.IN_AGREES]
            case s.VELOCITY_SENSOR:
                alone = ca.fmax(1.0 - inputs[s.IN_USE][s.POSITION_SENSOR], inputs[s.IN_BIAS_FREE])
                return ca.fmax(ca.fmax(inputs[s.IN_AGREES], alone), 1.0 - inputs[s.IN_AIRBORNE])
            case _:
                return ca.SX(1.0)
