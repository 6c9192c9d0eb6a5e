"""The whole plant: derivative of its state and one step of the classical Runge-Kutta method, compiled once a build.

Runge-Kutta of fourth order at 250 Hz: the fastest motions are the rotor lag (30 rad/s), the landing gear (40-60 rad/s)
and the closed rate loop (about 20 rad/s), so a step of 4 ms turns the fastest of them by a quarter of a radian. In a
second of changing wind and rotor speeds the error is 6e-8 m against steps of 0.5 ms and falls 17 times when the step is
halved (tests/sim/test_dynamics.py).
Wind, rotor targets and anchors are held over a step.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable
from functools import lru_cache

import casadi as ca

from uasfly import native
from uasfly.sim.aerodynamics import body_drag_force, body_drag_torque
from uasfly.sim.body import (
    ANGULAR_RATE,
    ATTITUDE,
    BODY_STATES,
    ROTOR_SPEED,
    VELOCITY,
    body_derivative,
    normalised,
    rotation_body_to_world,
)
from uasfly.sim.compiled import BoundFunction
from uasfly.sim.figures import Build, plant_figures, symbolic_plant
from uasfly.sim.ground import ANCHORS, feet_on_ground, ground_contact, reach_m
from uasfly.sim.plant import Plant
from uasfly.sim.rotors import rotor_wrench

STEP_S = 0.004

# Layout of the wind: velocity of the free air and of the jets [m/s], world.
FREE = slice(0, 3)
JET = slice(3, 6)
WIND = 6


def plant_derivative(
    plant: Plant, state: ca.SX, targets: ca.SX, effectiveness: ca.SX, wind: ca.SX, anchors: ca.SX | None
) -> ca.SX:
    """Time derivative (13 + n,) of the plant's state.

    Args:
        plant: physical figures.
        state: (13 + n,), see `body`.
        targets: (n,) rotor speeds asked for [rad/s].
        effectiveness: (n,) thrust of each rotor over that of a sound one.
        wind: (6,) free air and jets [m/s]. Jets are narrower than the rotors' circle: they push the body only.
        anchors: (8,) of the feet [m], or None where the ground is out of reach.
    """
    rotation = rotation_body_to_world(state[ATTITUDE])
    free_in_body = rotation.T @ (wind[FREE] - state[VELOCITY])
    rotor = rotor_wrench(plant.rotors, state[ROTOR_SPEED], targets, effectiveness, free_in_body, state[ANGULAR_RATE])
    force_in_body = rotor.force + body_drag_force(plant.drag, free_in_body + rotation.T @ wind[JET])
    force = rotation @ force_in_body
    torque = rotor.torque + body_drag_torque(plant.drag, state[ANGULAR_RATE])
    if anchors is not None:
        contact = ground_contact(plant, state, anchors)
        force, torque = force + contact.force_in_world, torque + contact.torque_in_body
    return ca.vertcat(body_derivative(state, force, torque, plant.mass_kg, plant.inertia_kg_m2), rotor.acceleration)


def runge_kutta_step(derivative: Callable[[ca.SX], ca.SX], state: ca.SX, step_s: float) -> tuple[ca.SX, ca.SX]:
    """State after a step of the classical Runge-Kutta method, and the derivative at its beginning."""
    k1 = derivative(state)
    k2 = derivative(state + 0.5 * step_s * k1)
    k3 = derivative(state + 0.5 * step_s * k2)
    k4 = derivative(state + step_s * k3)
    stepped = state + step_s / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return ca.vertcat(stepped[: ATTITUDE.start], normalised(stepped[ATTITUDE]), stepped[ATTITUDE.stop :]), k1


class PlantDynamics:
    """One plant in motion.

    The arrays are the memory that the compiled functions read and write: write `targets`, `effectiveness` and `wind`,
    call `step`, read `state` (see `body` for its layout) and `acceleration` (world, [m/s^2], at the step's beginning).
    """

    def __init__(self, plant: Plant, step_s: float = STEP_S) -> None:
        count = plant.rotors.count
        self.state = array("d", [0.0] * (BODY_STATES + count))
        self.state[ATTITUDE.start] = 1.0
        self.targets = array("d", [0.0] * count)
        self.effectiveness = array("d", [1.0] * count)
        self.wind = array("d", [0.0] * WIND)
        self.anchors = array("d", [0.0] * ANCHORS)
        self.acceleration = array("d", [0.0] * 3)
        self.force = array("d", [0.0] * 3)
        self._next_state = array("d", self.state)
        self._next_anchors = array("d", self.anchors)
        self._reach_m = reach_m(plant)
        self._grounded = False
        functions = _functions(Build.of(plant, step_s))
        figures = plant_figures(plant)
        inputs = (figures, self.state, self.targets, self.effectiveness, self.wind)
        outputs = (self._next_state, self.acceleration)
        self._fly = BoundFunction(functions["fly"], inputs, outputs)
        self._touch = BoundFunction(functions["touch"], (*inputs, self.anchors), (*outputs, self._next_anchors))
        self._stand = BoundFunction(functions["stand"], (figures, self.state), (self.anchors,))
        self._blow = BoundFunction(functions["blow"], inputs, (self.force,))
        self.place((0.0, 0.0, 0.0), 1.0, 0.0)

    def place(self, position: tuple[float, float, float], cos_half_yaw: float, sin_half_yaw: float) -> None:
        """Put the vehicle, level and at rest, at a position [m] with a yaw."""
        attitude = (cos_half_yaw, 0.0, 0.0, sin_half_yaw)
        self.state[:] = array("d", (*position, 0.0, 0.0, 0.0, *attitude, *([0.0] * (3 + len(self.targets)))))
        self._grounded = False

    def step(self) -> None:
        """Advance the state by one step."""
        state = self.state
        if state[2] > self._reach_m:
            self._fly.evaluate()
            self._grounded = False
        else:
            if not self._grounded:
                self._stand.evaluate()
                self._grounded = True
            self._touch.evaluate()
            self.anchors[:] = self._next_anchors
        state[:] = self._next_state

    def wind_force(self) -> tuple[float, float, float]:
        """Mass-normalised force of the wind on the vehicle beyond the still-air drag of its motion [m/s^2], world."""
        self._blow.evaluate()
        return self.force[0], self.force[1], self.force[2]


@lru_cache(maxsize=8)
def _functions(build: Build) -> dict[str, ca.Function]:
    """The functions of a build, compiled where that can be had; their first argument are the plant's figures."""
    (plant, figures), step_s = symbolic_plant(build.plant), build.step_s
    count = plant.rotors.count
    state = ca.SX.sym("state", BODY_STATES + count)
    targets = ca.SX.sym("targets", count)
    effectiveness = ca.SX.sym("effectiveness", count)
    wind = ca.SX.sym("wind", WIND)
    anchors = ca.SX.sym("anchors", ANCHORS)
    inputs = [figures, state, targets, effectiveness, wind]

    def airborne(x: ca.SX) -> ca.SX:
        return plant_derivative(plant, x, targets, effectiveness, wind, None)

    def grounded(x: ca.SX) -> ca.SX:
        return plant_derivative(plant, x, targets, effectiveness, wind, anchors)

    flown, slope = runge_kutta_step(airborne, state, step_s)
    touched, touched_slope = runge_kutta_step(grounded, state, step_s)
    still = plant_derivative(plant, state, targets, effectiveness, ca.SX.zeros(WIND), None)
    next_anchors = ground_contact(plant, touched, anchors).anchors
    functions = (
        ca.Function("fly", inputs, ca.cse([flown, slope[VELOCITY]])),
        ca.Function("touch", [*inputs, anchors], ca.cse([touched, touched_slope[VELOCITY], next_anchors])),
        ca.Function("stand", [figures, state], [feet_on_ground(plant, state)]),
        ca.Function("blow", inputs, ca.cse([slope[VELOCITY] - still[VELOCITY]])),
    )
    return {function.name(): function for function in native.compiled(functions, f"plant_{build.layout}")}
