"""The generated functions of the filter: prediction, odometry step, extrapolation and marker geometry.

Each works on packed vectors (`states.Layout` and the IN_ and OUT_ indices) and is built once a process for each number
of markers.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import casadi as ca

from uasfly import native
from uasfly.messages import Array
from uasfly.observer import error_state as es
from uasfly.observer import measurements as me
from uasfly.observer import states as s
from uasfly.observer import update as up

# A sensor whose mean innovation exceeds this many configured sigmas has jumped; the state then follows it at about this
# speed (see `_recovery`), in the order of states.SENSORS: rad/s, m/s, m/s^2.
JUMP_SIGMAS = 2.0
RECOVERY_RATES = (1.0, 50.0, 30.0)  # the position's goes into the GNSS bias, which nothing flies by; a gust is fast
# Normalised innovation squared beyond which a reading of the accelerometer is an error: the edge of a jet is out of the
# common too, and it is what the accelerometer is there for. Absurd readings do not come this far (see `door`).
FORCE_GATE = 50.0
FOLLOW_RATE_M_S = 3.0  # the state's way back to a position that it has lost


class Caller:
    """A generated function called on memory that the caller owns, without copies or allocation; one a thread.

    Args:
        function: CasADi function with dense arguments and results.
    """

    def __init__(self, function: ca.Function) -> None:
        buffer, evaluate = function.buffer()
        self._buffer: Any = buffer
        self._evaluate: Callable[[], None] = evaluate
        self._arguments: list[Array | None] = [None] * function.n_in()
        self._results: list[Array | None] = [None] * function.n_out()

    def __call__(self, arguments: tuple[Array, ...], results: tuple[Array, ...]) -> None:
        """Evaluate; arrays are contiguous, float64, at least as long as the function's; matrices are column-major."""
        for index, argument in enumerate(arguments):
            if argument is not self._arguments[index]:  # most are the same array in every call
                self._buffer.set_arg(index, argument.data)
                self._arguments[index] = argument
        for index, result in enumerate(results):
            if result is not self._results[index]:
                self._buffer.set_res(index, result.data)
                self._results[index] = result
        self._evaluate()


def _function(name: str, arguments: list[ca.SX], results: list[ca.SX]) -> ca.Function:
    return ca.Function(name, arguments, [ca.densify(result) for result in results], {"cse": True})


def _predicted_covariance(covariance: ca.SX, core: ca.SX, inputs: ca.SX) -> ca.SX:
    """Phi P Phi' + Q; markers are at rest (eq. 3), so that only their correlation with the core turns."""
    n = covariance.shape[0]
    move = ca.diagcat(es.transition(core, inputs), ca.SX.eye(n - s.CORE_ERROR))
    noise = ca.diagcat(es.noise_covariance(core, inputs), ca.SX(n - s.CORE_ERROR, n - s.CORE_ERROR))
    return up.symmetric(ca.mtimes(ca.mtimes(move, covariance), move.T) + noise)


def _unpack(packed: ca.SX, layout: s.Layout) -> tuple[ca.SX, ca.SX]:
    covariance = up.symmetric(ca.reshape(packed[layout.covariance], layout.errors, layout.errors))
    return packed[layout.nominal], covariance


def _predict(nominal: ca.SX, covariance: ca.SX, inputs: ca.SX) -> tuple[ca.SX, ca.SX]:
    core = nominal[: s.CORE_NOMINAL]
    moved = ca.vertcat(es.predict_nominal(core, inputs), nominal[s.CORE_NOMINAL :])
    return moved, _predicted_covariance(covariance, core, inputs)


@lru_cache(maxsize=8)
def prediction(markers: int) -> ca.Function:
    """(packed state, inputs (PREDICTION_INPUTS or longer)) -> packed state after IN_DT."""
    layout = s.Layout(markers)
    packed, inputs = ca.SX.sym("packed", layout.size), ca.SX.sym("inputs", s.PREDICTION_INPUTS)
    nominal, covariance = _predict(*_unpack(packed, layout), inputs)
    result = ca.vertcat(es.normalised(nominal), ca.vec(covariance), packed[layout.matched.start :])
    return _function(f"prediction_{markers}", [packed, inputs], [result])


@lru_cache(maxsize=8)
def odometry_step(markers: int) -> ca.Function:
    """(packed state, inputs (ODOMETRY_INPUTS)) -> (packed state after prediction and updates, (ODOMETRY_OUTPUTS))."""
    layout = s.Layout(markers)
    packed, inputs = ca.SX.sym("packed", layout.size), ca.SX.sym("inputs", s.ODOMETRY_INPUTS)
    nominal, covariance = _predict(*_unpack(packed, layout), inputs)
    core = nominal[: s.CORE_NOMINAL]
    innovations = (
        me.attitude_innovation(core, inputs[s.IN_QUATERNION]),
        inputs[s.IN_POSITION] - me.measure_position(core),
        inputs[s.IN_VELOCITY] - me.measure_velocity(core),
    )
    error = ca.SX.zeros(layout.errors)
    matched, means, nis, accepted, residuals = [], [], [], [], []
    for sensor in range(len(s.SENSORS)):
        block = packed[layout.matched][9 * sensor : 9 * sensor + 9]
        mean = packed[layout.mean][3 * sensor : 3 * sensor + 3]
        state = _Sensor(sensor, up.symmetric(ca.reshape(block, 3, 3)), mean, inputs)
        motion = _is_motion(inputs, sensor, markers)
        covariance = covariance + _recovery(state, motion, layout)
        free = inputs[s.IN_BIAS_FREE]
        if sensor == s.POSITION_SENSOR:
            free = ca.fmax(free, state.jumped * (1.0 - motion))
        allowed = _held(free, inputs[s.IN_WANDER_FREE], layout)
        jacobian = ca.horzcat(me.odometry_jacobian(core, sensor), ca.SX(3, layout.errors - s.CORE_ERROR))
        residual = innovations[sensor] - ca.mtimes(jacobian, error)
        expected = ca.mtimes(ca.mtimes(jacobian, covariance), jacobian.T)
        value, passed, inverse = up.innovation_test(residual, expected, state.noise, state.use)
        shortened = ca.sqrt(up.GATE_3 / ca.fmax(value, up.GATE_3)) * residual
        used = inputs[s.IN_CORRELATION][sensor] * state.noise
        taken = passed
        if sensor == s.POSITION_SENSOR:  # the state has lost its place: back to the measured one, but not in one step
            lost = state.use * state.jumped * motion * (1.0 - passed)
            used, taken = used + lost * ca.dot(residual, residual) * ca.SX.eye(3), passed + lost
        gain, covariance = up.joseph_update(covariance, jacobian, used, taken * allowed)
        error = error + ca.mtimes(gain, residual)
        # what contradicts everything else is no noise, and must not talk itself in as such
        weight = state.use * inputs[s.IN_MATCHING_WEIGHT] * (1.0 - state.jumped * (1.0 - motion))
        matched.append(ca.vec(up.matched_covariance(state.matched, state.noise, inverse, shortened, weight)))
        told = shortened * (1.0 - passed) if sensor == s.POSITION_SENSOR else shortened
        means.append(mean + state.use * inputs[s.IN_MEAN_WEIGHT] * (told - mean))
        nis.append(value)
        accepted.append(taken)
        residuals.append(residual)
    nominal, covariance = _inject(nominal, covariance, error)
    result = ca.vertcat(nominal, ca.vec(covariance), *matched, *means)
    return _function(f"odometry_step_{markers}", [packed, inputs], [result, ca.vertcat(*nis, *accepted, *residuals)])


@lru_cache(maxsize=8)
def accelerometer_step(markers: int) -> ca.Function:
    """(packed state, inputs (ACCELEROMETER_INPUTS)) -> (packed state after prediction and update, outputs).

    The GNSS bias and the velocity's wander stay as they are (see `_held`): the accelerometer says nothing of them. The
    attitude stays too: the edge of a gust is many sigmas of the force at once, and what the covariance makes of that
    for the attitude is false (it turned as far as the attitude's own gate).
    """
    layout = s.Layout(markers)
    packed, inputs = ca.SX.sym("packed", layout.size), ca.SX.sym("inputs", s.ACCELEROMETER_INPUTS)
    nominal, covariance = _predict(*_unpack(packed, layout), inputs)
    core, model = nominal[: s.CORE_NOMINAL], (inputs[s.IN_THRUST], inputs[s.IN_DRAG])
    residual = inputs[s.IN_SPECIFIC_FORCE] - me.measure_specific_force(core, *model)
    jacobian = ca.horzcat(me.specific_force_jacobian(core, *model), ca.SX(3, layout.errors - s.CORE_ERROR))
    noise = ca.SX(ca.diag(inputs[s.IN_ACCELEROMETER_VARIANCE]))
    expected = ca.mtimes(ca.mtimes(jacobian, covariance), jacobian.T)
    nis, _, inverse = up.innovation_test(residual, expected, noise, ca.SX(1.0))
    passed = nis < FORCE_GATE
    shortened = ca.sqrt(up.GATE_3 / ca.fmax(nis, up.GATE_3)) * residual
    sample = up.matched_covariance(noise, noise, inverse, shortened, ca.SX(1.0))
    held = ca.SX.eye(layout.errors)
    for still in (s.D_ATTITUDE, s.D_BIAS, s.D_VELOCITY_WANDER, s.D_ATTITUDE_WANDER):
        held[still, still] = ca.SX(3, 3)
    gain, covariance = up.joseph_update(covariance, jacobian, noise, passed * ca.sparsify(held))
    nominal, covariance = _inject(nominal, covariance, ca.mtimes(gain, residual))
    result = ca.vertcat(nominal, ca.vec(covariance), packed[layout.matched.start :])
    outputs = ca.vertcat(nis, passed, 0.5 * (sample[0, 0] + sample[1, 1]))
    return _function(f"accelerometer_step_{markers}", [packed, inputs], [result, outputs])


class _Sensor:
    """Symbols of one sensor of the odometry."""

    def __init__(self, index: int, matched: ca.SX, mean: ca.SX, inputs: ca.SX) -> None:
        self.index = index
        self.matched = matched
        self.mean = mean
        self.use = inputs[s.IN_USE][index]
        self.variance = inputs[s.IN_VARIANCE][index]
        self.interval = inputs[s.IN_INTERVAL]
        self.correlation = inputs[s.IN_CORRELATION][index]
        self.noise = up.bounded(matched, self.variance)
        self.jumped = ca.dot(mean, mean) > JUMP_SIGMAS**2 * self.variance


def _held(bias_free: ca.SX, wander_free: ca.SX, layout: s.Layout) -> ca.SX:
    """Matrix (n, n) on the gain that holds the GNSS bias and the velocity's wander where they are not free (0).

    GNSS alone sees only the sum p + b. What an innovation says of that sum then goes to the position, and the bias
    stays: the position follows GNSS, and the two cannot drift apart. The bias's noise goes on, so that the covariance
    (Joseph) tells how far position and bias, with opposite signs, may have gone. When a marker frees the bias nothing
    jumps. A measured position that has jumped against everything else frees it too: that is an error of GNSS, and the
    vehicle has not moved. The velocity's wander is left to markers: GNSS that drifts would pass for it.
    """
    allowed = ca.SX.eye(layout.errors)
    allowed[s.D_POSITION, s.D_BIAS] = (1.0 - bias_free) * ca.SX.eye(3)
    allowed[s.D_BIAS, s.D_BIAS] = bias_free * ca.SX.eye(3)
    allowed[s.D_VELOCITY_WANDER, s.D_VELOCITY_WANDER] = wander_free * ca.SX.eye(3)
    return allowed


def _is_motion(inputs: ca.SX, sensor: int, markers: int) -> ca.SX:
    """1 where what a sensor says against the model is the vehicle's motion, not the sensor's error.

    Position and velocity vouch for each other (see `agreement`); a velocity without a position is believed, and one
    beside a position that is known to be wrong: GNSS runs away, or a marker says where the vehicle is instead. On the
    ground the model has nothing to say against it.
    """
    match sensor:
        case s.POSITION_SENSOR if markers:
            return inputs[s.IN_AGREES] * (1.0 - inputs[s.IN_BIAS_FREE])
        case s.POSITION_SENSOR:
            return inputs[s.IN_AGREES]
        case s.VELOCITY_SENSOR:
            alone = ca.fmax(1.0 - inputs[s.IN_USE][s.POSITION_SENSOR], inputs[s.IN_BIAS_FREE])
            return ca.fmax(ca.fmax(inputs[s.IN_AGREES], alone), 1.0 - inputs[s.IN_AIRBORNE])
        case _:
            return ca.SX(1.0)


def _recovery(sensor: _Sensor, motion: ca.SX, layout: s.Layout) -> ca.SX:
    """Noise (n, n) that lets the state follow a sensor that has jumped and stays there.

    After a jump by e the matched R is about e e'. A state with process noise q then closes the gap at e / tau,
    tau = sqrt(r / q), r = R dt: with q = rate^2 dt that is `rate`, whatever the size of the jump and the sample rate.
    So the estimate glides to the new place instead of stepping there, and a jump that returns soon has hardly moved it.
    A jump of the position that is no motion is GNSS's: the noise goes to the bias, which is free meanwhile, so that it
    takes the jump. There the mean counts only innovations outside the gate: what the filter expected (after silence) is
    no jump. One that is motion is where the vehicle is: the state has lost it (in a silence), and glides back to it.
    A velocity that is no motion is not followed.
    """
    rate = sensor.interval * RECOVERY_RATES[sensor.index]
    variance = sensor.use * sensor.jumped * rate**2 * sensor.correlation
    diagonal = ca.SX(layout.errors, 1)
    match sensor.index:
        case s.ATTITUDE_SENSOR:
            diagonal[s.D_ATTITUDE] = variance
        case s.POSITION_SENSOR:
            diagonal[s.D_BIAS] = variance * (1.0 - motion)
            follow = sensor.interval * FOLLOW_RATE_M_S
            diagonal[s.D_POSITION] = sensor.use * sensor.jumped * motion * follow**2 * sensor.correlation
        case _:
            diagonal[s.D_VELOCITY] = variance * motion
    return ca.sparsify(ca.diag(diagonal))


def _inject(nominal: ca.SX, covariance: ca.SX, error: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Nominal state with the error added, and the covariance of the error that is left (reset Jacobian)."""
    rotations = [s.D_ATTITUDE]
    rotations += [slice(k + 3, k + 6) for k in range(s.CORE_ERROR, error.shape[0], s.MARKER_ERROR)]
    reset = ca.SX.eye(error.shape[0])
    for rotation in rotations:
        reset[rotation, rotation] = es.reset_jacobian(error[rotation])
    covariance = up.symmetric(ca.mtimes(ca.mtimes(reset, covariance), reset.T))
    return es.normalised(es.retract(nominal, error)), covariance


@lru_cache(maxsize=8)
def injection(markers: int) -> ca.Function:
    """(nominal state, covariance, error) -> (nominal state with the error added, covariance of what is left)."""
    layout = s.Layout(markers)
    nominal, error = ca.SX.sym("nominal", layout.nominal_size), ca.SX.sym("error", layout.errors)
    covariance = ca.SX.sym("covariance", layout.errors, layout.errors)
    return _function(f"injection_{markers}", [nominal, covariance, error], [*_inject(nominal, covariance, error)])


@lru_cache(maxsize=8)
def compiled_accelerometer_step(markers: int) -> ca.Function:
    """`accelerometer_step`, compiled where that can be had."""
    return native.compiled([accelerometer_step(markers)], f"accelerometer{markers}")[0]


@lru_cache(maxsize=8)
def compiled_steps(markers: int) -> tuple[ca.Function, ca.Function]:
    """`prediction` and `odometry_step`, compiled where that can be had (some seconds, once a computer)."""
    step, odometry = native.compiled([prediction(markers), odometry_step(markers)], f"observer{markers}")
    return step, odometry


@lru_cache(maxsize=1)
def compiled_extrapolation() -> ca.Function:
    """`extrapolation`, compiled where that can be had."""
    return native.compiled([extrapolation()], "extrapolation")[0]


@lru_cache(maxsize=1)
def extrapolation() -> ca.Function:
    """(nominal core (22,) or longer, inputs (PREDICTION_INPUTS or longer)) -> nominal core after IN_DT."""
    core, inputs = ca.SX.sym("core", s.CORE_NOMINAL), ca.SX.sym("inputs", s.PREDICTION_INPUTS)
    return _function("extrapolation", [core, inputs], [es.normalised(es.predict_nominal(core, inputs))])


@lru_cache(maxsize=1)
def marker_geometry() -> ca.Function:
    """(core, marker (7,), sighting (7,)) -> (innovation (6,), H by core (6, 21), H by marker (6, 6)) of eq. 7."""
    core, marker, relative = ca.SX.sym("core", s.CORE_NOMINAL), ca.SX.sym("marker", 7), ca.SX.sym("relative", 7)
    innovation = me.marker_innovation(core, marker, relative)
    return _function("marker_geometry", [core, marker, relative], [innovation, *me.marker_jacobians(core, marker)])


@lru_cache(maxsize=1)
def marker_location() -> ca.Function:
    """(core, sighting (7,)) -> (marker in the world (7,), its Jacobians by core (6, 21) and by sighting (6, 6))."""
    core, relative = ca.SX.sym("core", s.CORE_NOMINAL), ca.SX.sym("relative", 7)
    return _function(
        "marker_location", [core, relative], [me.locate_marker(core, relative), *me.locating_jacobians(core, relative)]
    )
