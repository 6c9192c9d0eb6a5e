"""Ground contact: four feet on springs and dampers with dry friction, symbolically (CasADi).

Each foot presses with a spring and a damper that never pull. Along the ground a spring ties the foot to an anchor, the
point where it stands; when the spring would pull harder than friction allows, the anchor slips after the foot. A
vehicle that has landed therefore rests where it stands, also in wind, which viscous friction would let creep.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import casadi as ca

from uasfly.sim.body import ANGULAR_RATE, ATTITUDE, GRAVITY_M_S2, POSITION, VELOCITY, rotation_body_to_world
from uasfly.sim.plant import Plant

FEET = 4
ANCHORS = 2 * FEET  # x and y of each foot's anchor [m], world

# Slow enough for steps of 4 ms (0.16 rad a step), stiff enough to sink 6 mm under the vehicle's own weight.
_BOUNCE_RAD_S = 40.0
_BOUNCE_DAMPING = 0.7


class GroundContact(NamedTuple):
    """Force [N] in the world, torque [N m] in the body, and the anchors (8,) after slipping [m]."""

    force_in_world: ca.SX
    torque_in_body: ca.SX
    anchors: ca.SX


def spring_n_m(plant: Plant) -> float:
    """Stiffness of one foot [N/m]."""
    return plant.mass_kg * _BOUNCE_RAD_S**2 / FEET


def ground_height_m(plant: Plant) -> float:
    """Height of the ground in the world [m], such that the centre of mass of the resting vehicle is at z = 0."""
    return -plant.gear.height_m + GRAVITY_M_S2 / _BOUNCE_RAD_S**2


def feet_in_body(plant: Plant) -> list[tuple[float, float, float]]:
    """The four feet in the body [m]."""
    half, height = plant.gear.half_width_m, plant.gear.height_m
    return [(half, half, -height), (-half, half, -height), (-half, -half, -height), (half, -half, -height)]


def reach_m(plant: Plant) -> float:
    """Height of the centre of mass [m] above which no attitude lets a foot touch the ground."""
    return math.hypot(math.sqrt(2.0) * plant.gear.half_width_m, plant.gear.height_m) + ground_height_m(plant)


def feet_on_ground(plant: Plant, state: ca.SX) -> ca.SX:
    """Anchors (8,) straight under the feet [m]: where they stand at first touch."""
    rotation = rotation_body_to_world(state[ATTITUDE])
    return ca.vertcat(*((state[POSITION] + rotation @ ca.vertcat(*foot))[:2] for foot in feet_in_body(plant)))


def ground_contact(plant: Plant, state: ca.SX, anchors: ca.SX) -> GroundContact:
    """Forces of the ground on the vehicle.

    Args:
        plant: physical figures.
        state: plant state (see `body`).
        anchors: (8,) where the feet stand, x and y of each [m].
    """
    stiffness = spring_n_m(plant)
    damping = 2.0 * _BOUNCE_DAMPING * plant.mass_kg * _BOUNCE_RAD_S / FEET
    rotation = rotation_body_to_world(state[ATTITUDE])
    force_sum, torque_sum, new_anchors = ca.SX.zeros(3), ca.SX.zeros(3), []
    for index, foot in enumerate(feet_in_body(plant)):
        arm = rotation @ ca.vertcat(*foot)
        position = state[POSITION] + arm
        velocity = state[VELOCITY] + rotation @ ca.cross(state[ANGULAR_RATE], ca.vertcat(*foot))
        depth = ground_height_m(plant) - position[2]
        press = ca.fmax(0.0, stiffness * depth - damping * velocity[2]) * (depth > 0.0)
        stretch = anchors[2 * index : 2 * index + 2] - position[:2]
        pull = stiffness * stretch - damping * velocity[:2]
        pull_size = ca.sqrt(ca.dot(pull, pull) + 1e-12)
        hold = ca.fmin(1.0, plant.gear.friction * press / pull_size)
        force = ca.vertcat(hold * pull, press)
        force_sum += force
        torque_sum += ca.cross(ca.vertcat(*foot), rotation.T @ force)
        # The anchor of a slipping foot keeps the spring at the friction limit, one of a lifted foot follows it freely.
        new_anchors.append(position[:2] + hold * stretch * (depth > 0.0))
    return GroundContact(force_sum, torque_sum, ca.vertcat(*new_anchors))
