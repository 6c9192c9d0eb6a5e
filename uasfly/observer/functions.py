"""The generated functions of the filter: prediction and extrapolation, its steps, and where a marker is.

Each works on packed vectors (`states.Layout` and the IN_ and OUT_ indices) and is built once a process for each number
of markers. Algebra of whole covariances is matrix by matrix (CasADi's MX): a handful of loops. Written out number by
number it was half a megabyte of code that runs once a cycle, and came from memory each time. What is small and thin is
written out (`by_numbers`).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

import casadi as ca

from uasfly import native
from uasfly.messages import Array
from uasfly.observer import error_state as es
from uasfly.observer import measurements as me
from uasfly.observer import odometry, sighting_gate
from uasfly.observer import states as s
from uasfly.observer import update as up
from uasfly.observer.matrices import Matrix, by_numbers

# Normalised innovation squared beyond which a reading of the accelerometer is an error: the edge of a jet is out of the
# common too, and it is what the accelerometer is there for. Absurd readings do not come this far (see `door`).
FORCE_GATE = 50.0


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


def _function(name: str, arguments: list[Matrix], results: list[Matrix]) -> ca.Function:
    return ca.Function(name, arguments, [ca.densify(result) for result in results], {"cse": True})


def _unpack(packed: ca.MX, layout: s.Layout) -> tuple[ca.MX, ca.MX]:
    return packed[layout.nominal], ca.reshape(packed[layout.covariance], layout.errors, layout.errors)


@lru_cache(maxsize=1)
def _motion() -> ca.Function:
    """(core, inputs) -> core after IN_DT, Phi and Q (21, 21)."""

    def motion(core: ca.SX, inputs: ca.SX) -> list[ca.SX]:
        return [expression(core, inputs) for expression in (es.predict_nominal, es.transition, es.noise_covariance)]

    return by_numbers("motion", motion, s.CORE_NOMINAL, s.PREDICTION_INPUTS)


def _predict(nominal: ca.MX, covariance: ca.MX, inputs: ca.MX) -> tuple[ca.MX, ca.MX]:
    """Phi P Phi' + Q; markers are at rest (eq. 3), so that only their correlation with the core turns."""
    core, still = nominal[: s.CORE_NOMINAL], covariance.shape[0] - s.CORE_ERROR
    moved, transition, noise = _motion()(core, inputs[: s.PREDICTION_INPUTS])
    move = ca.diagcat(transition, ca.MX.eye(still))
    grown = ca.mtimes(ca.mtimes(move, covariance), move.T) + ca.diagcat(noise, ca.MX(still, still))
    return ca.vertcat(moved, nominal[s.CORE_NOMINAL :]), up.symmetric(grown)


@lru_cache(maxsize=8)
def prediction(markers: int) -> ca.Function:
    """(packed state, inputs (PREDICTION_INPUTS or longer)) -> packed state after IN_DT."""
    layout = s.Layout(markers)
    packed, inputs = ca.MX.sym("packed", layout.size), ca.MX.sym("inputs", s.PREDICTION_INPUTS)
    nominal, covariance = _predict(*_unpack(packed, layout), inputs)
    nominal = by_numbers("normalised", lambda nominal: [es.normalised(nominal)], layout.nominal_size)(nominal)
    result = ca.vertcat(nominal, ca.vec(covariance), packed[layout.matched.start :])
    return _function(f"prediction_{markers}", [packed, inputs], [result])


@lru_cache(maxsize=8)
def odometry_step(markers: int) -> ca.Function:
    """(packed state, inputs (ODOMETRY_INPUTS)) -> (packed state after prediction and updates, (ODOMETRY_OUTPUTS))."""
    layout = s.Layout(markers)
    packed, inputs = ca.MX.sym("packed", layout.size), ca.MX.sym("inputs", s.ODOMETRY_INPUTS)
    nominal, covariance = _predict(*_unpack(packed, layout), inputs)
    core = nominal[: s.CORE_NOMINAL]
    innovations = by_numbers("innovations", odometry.innovations, s.CORE_NOMINAL, s.ODOMETRY_INPUTS)(core, inputs)
    error = ca.MX.zeros(layout.errors)
    matched, means, nis, accepted, residuals = [], [], [], [], []
    for sensor in range(len(s.SENSORS)):
        logic = odometry.SensorLogic(sensor, layout)
        block = packed[layout.matched][9 * sensor : 9 * sensor + 9]
        mean = packed[layout.mean][3 * sensor : 3 * sensor + 3]
        covariance = covariance + logic.recovery(mean, inputs)
        jacobian = logic.jacobian(core)
        residual = innovations[sensor] - ca.mtimes(jacobian, error)
        expected = ca.mtimes(ca.mtimes(jacobian, covariance), jacobian.T)
        used, allowed, block, mean, value, taken = logic.test(block, mean, residual, expected, inputs)
        gain, covariance = up.joseph_update(covariance, jacobian, used, allowed)
        error = error + ca.mtimes(gain, residual)
        matched.append(block)
        means.append(mean)
        nis.append(value)
        accepted.append(taken)
        residuals.append(residual)
    nominal, covariance = _inject(nominal, covariance, error, markers)
    result = ca.vertcat(nominal, ca.vec(covariance), *matched, *means)
    return _function(f"odometry_step_{markers}", [packed, inputs], [result, ca.vertcat(*nis, *accepted, *residuals)])


@lru_cache(maxsize=8)
def accelerometer_step(markers: int) -> ca.Function:
    """(packed state, inputs (ACCELEROMETER_INPUTS)) -> (packed state after prediction and update, outputs).

    The GNSS bias and the velocity's wander stay as they are (see `odometry`): the accelerometer says nothing of them.
    The attitude stays too: the edge of a gust is many sigmas of the force at once, and what the covariance makes of
    that for the attitude is false (it turned as far as the attitude's own gate).
    """
    layout = s.Layout(markers)
    packed, inputs = ca.MX.sym("packed", layout.size), ca.MX.sym("inputs", s.ACCELEROMETER_INPUTS)
    nominal, covariance = _predict(*_unpack(packed, layout), inputs)

    def reading(core: ca.SX, inputs: ca.SX) -> list[ca.SX]:
        model = (inputs[s.IN_THRUST], inputs[s.IN_DRAG])
        residual = inputs[s.IN_SPECIFIC_FORCE] - me.measure_specific_force(core, *model)
        jacobian = me.specific_force_jacobian(core, *model)
        return [residual, ca.horzcat(jacobian, ca.SX(3, layout.errors - s.CORE_ERROR))]

    def test(residual: ca.SX, expected: ca.SX, inputs: ca.SX) -> list[ca.SX]:
        noise = ca.SX(ca.diag(inputs[s.IN_ACCELEROMETER_VARIANCE]))
        nis, _, inverse = up.innovation_test(residual, expected, noise, ca.SX(1.0))
        passed = nis < FORCE_GATE
        shortened = ca.sqrt(up.GATE_3 / ca.fmax(nis, up.GATE_3)) * residual
        sample = up.matched_covariance(noise, noise, inverse, shortened, ca.SX(1.0))
        held = ca.SX.eye(layout.errors)
        for still in (s.D_ATTITUDE, s.D_BIAS, s.D_VELOCITY_WANDER, s.D_ATTITUDE_WANDER):
            held[still, still] = ca.SX(3, 3)
        return [noise, passed * ca.sparsify(held), ca.vertcat(nis, passed, 0.5 * (sample[0, 0] + sample[1, 1]))]

    read = by_numbers("reading", reading, s.CORE_NOMINAL, s.ACCELEROMETER_INPUTS)
    residual, jacobian = read(nominal[: s.CORE_NOMINAL], inputs)
    expected = ca.mtimes(ca.mtimes(jacobian, covariance), jacobian.T)
    gate = by_numbers("reading_test", test, 3, (3, 3), s.ACCELEROMETER_INPUTS)
    noise, allowed, outputs = gate(residual, expected, inputs)
    gain, covariance = up.joseph_update(covariance, jacobian, noise, allowed)
    nominal, covariance = _inject(nominal, covariance, ca.mtimes(gain, residual), markers)
    result = ca.vertcat(nominal, ca.vec(covariance), packed[layout.matched.start :])
    return _function(f"accelerometer_step_{markers}", [packed, inputs], [result, outputs])


@lru_cache(maxsize=8)
def _injected(markers: int) -> ca.Function:
    """(nominal state, error) -> nominal state with the error added, reset Jacobian (n, n)."""
    layout = s.Layout(markers)

    def injected(nominal: ca.SX, error: ca.SX) -> list[ca.SX]:
        rotations = [s.D_ATTITUDE]
        rotations += [slice(k + 3, k + 6) for k in range(s.CORE_ERROR, layout.errors, s.MARKER_ERROR)]
        reset = ca.SX.eye(layout.errors)
        for rotation in rotations:
            reset[rotation, rotation] = es.reset_jacobian(error[rotation])
        return [es.normalised(es.retract(nominal, error)), reset]

    return by_numbers("injected", injected, layout.nominal_size, layout.errors)


def _inject(nominal: ca.MX, covariance: ca.MX, error: ca.MX, markers: int) -> tuple[ca.MX, ca.MX]:
    """Nominal state with the error added, and the covariance of the error that is left (reset Jacobian)."""
    nominal, reset = _injected(markers)(nominal, error)
    return nominal, up.symmetric(ca.mtimes(ca.mtimes(reset, covariance), reset.T))


@lru_cache(maxsize=8)
def sighting_step(markers: int, index: int) -> ca.Function:
    """(packed state, inputs (SIGHTING_INPUTS)) -> (packed state after a sighting of marker `index`, outputs)."""
    layout, seen = s.Layout(markers), s.marker_error(index)
    packed, inputs = ca.MX.sym("packed", layout.size), ca.MX.sym("inputs", s.SIGHTING_INPUTS)
    nominal, covariance = _unpack(packed, layout)
    innovation, by_core, by_marker = _geometry()(
        nominal[: s.CORE_NOMINAL], nominal[s.marker_nominal(index)], inputs[s.IN_SIGHTING]
    )
    others = ca.MX(6, seen.start - s.CORE_ERROR), ca.MX(6, layout.errors - seen.stop)
    jacobian = ca.horzcat(by_core, others[0], by_marker, others[1])
    noise = by_numbers("sighting_noise", sighting_gate.noise, s.SIGHTING_INPUTS)(inputs)
    cross = ca.mtimes(covariance, jacobian.T)
    gate = by_numbers("sighting_gate", sighting_gate.gate, 6, (6, 6), s.SIGHTING_INPUTS)
    inverse, outputs = gate(innovation, ca.mtimes(jacobian, cross) + noise, inputs)
    gain = ca.mtimes(cross, inverse)
    covariance = up.covariance_after(covariance, jacobian, noise, cross, gain)
    nominal, covariance = _inject(nominal, covariance, ca.mtimes(gain, innovation), markers)
    result = ca.vertcat(nominal, ca.vec(covariance), packed[layout.matched.start :])
    return _function(f"sighting_step_{markers}_{index}", [packed, inputs], [result, ca.vertcat(outputs, innovation)])


@lru_cache(maxsize=1)
def _geometry() -> ca.Function:
    return by_numbers("geometry", sighting_gate.geometry, s.CORE_NOMINAL, s.MARKER_NOMINAL, s.MARKER_NOMINAL)


class Steps(NamedTuple):
    """All that is generated for a number of markers; of the sightings one for each of them."""

    prediction: ca.Function
    odometry: ca.Function
    accelerometer: ca.Function
    sightings: tuple[ca.Function, ...]


@lru_cache(maxsize=8)
def steps(markers: int) -> Steps:
    """As they are generated."""
    sightings = tuple(sighting_step(markers, index) for index in range(markers))
    return Steps(prediction(markers), odometry_step(markers), accelerometer_step(markers), sightings)


@lru_cache(maxsize=8)
def compiled_steps(markers: int) -> Steps:
    """`steps`, compiled where that can be had (a second or two, once a computer), into one library: they share code."""
    *generated, sightings = steps(markers)
    step, odometry, accelerometer, *seen = native.compiled([*generated, *sightings], f"observer{markers}")
    return Steps(step, odometry, accelerometer, tuple(seen))


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
def marker_location() -> ca.Function:
    """(core, sighting (7,)) -> (marker in the world (7,), its Jacobians by core (6, 21) and by sighting (6, 6))."""
    core, relative = ca.SX.sym("core", s.CORE_NOMINAL), ca.SX.sym("relative", s.MARKER_NOMINAL)
    return _function(
        "marker_location", [core, relative], [me.locate_marker(core, relative), *me.locating_jacobians(core, relative)]
    )
