"""Land detector after PX4's for multirotors: ground contact, maybe landed, landed, each held for a third of a second.

Landed needs low thrust, no movement and, where a mode controls the climb, that it wants to go down.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from uasfly.sim.parameters import ParameterTable

_STAGE_S = 1.0 / 3.0
_FREE_FALL_M_S2 = 2.0


@dataclass(slots=True)
class LandEvidence:
    """What the detector looks at.

    Attributes:
        armed: motors turn. thrust: command 0..1. hover_thrust: command that carries the weight.
        velocity: estimate [m/s], world. tilt_rate_rad_s: length of roll and pitch rate.
        specific_force_m_s2: length of what an accelerometer measures.
        controls_climb: a mode controls the climb (all but offboard). wants_down: it is descending on purpose.
    """

    armed: bool
    thrust: float
    hover_thrust: float
    velocity: tuple[float, float, float]
    tilt_rate_rad_s: float
    specific_force_m_s2: float
    controls_climb: bool
    wants_down: bool


class LandDetector:
    """The three stages.

    Attributes:
        ground_contact, maybe_landed, landed: the stages, each needs the one before.
    """

    def __init__(self, parameters: ParameterTable) -> None:
        self._parameters = parameters
        self.ground_contact = self.maybe_landed = self.landed = True
        self._since = [0.0, 0.0, 0.0]

    def update(self, now_s: float, evidence: LandEvidence) -> None:
        """Look again; call it some ten times a second or more."""
        value = self._parameters.value
        idle = value("MPC_THR_MIN")
        room = evidence.hover_thrust - idle
        still_widening = 2.5 if self.landed else 1.0
        moving = abs(evidence.velocity[2]) > value("LNDMC_Z_VEL_MAX") * still_widening or math.hypot(
            evidence.velocity[0], evidence.velocity[1]
        ) > value("LNDMC_XY_VEL_MAX")
        contact = evidence.thrust <= idle + 0.6 * room and not moving
        if evidence.controls_climb and not self.maybe_landed and not self.landed:
            contact &= evidence.wants_down
        least = idle + 0.1 * room if evidence.controls_climb else value("MPC_MANTHR_MIN") + 0.01
        turning = evidence.tilt_rate_rad_s > math.radians(value("LNDMC_ROT_MAX")) * still_widening
        falling = evidence.specific_force_m_s2 < _FREE_FALL_M_S2
        maybe = evidence.thrust <= least and not turning and not falling and self.ground_contact
        self.ground_contact = self._held(0, now_s, contact or not evidence.armed, self.ground_contact)
        self.maybe_landed = self._held(1, now_s, maybe or not evidence.armed, self.maybe_landed)
        self.landed = self._held(2, now_s, self.maybe_landed or not evidence.armed, self.landed)

    def _held(self, stage: int, now_s: float, seen: bool, before: bool) -> bool:
        """A stage is reached when it has been seen for its time, and left at once."""
        if not seen:
            self._since[stage] = now_s
            return False
        return before or now_s - self._since[stage] >= _STAGE_S - 1e-9
