"""Mean wind at a height."""

from __future__ import annotations

import math

from uasfly.sim.wind.settings import TEN_METRES_M, BoundaryLayer, ConstantWind


class SteadyWind:
    """Mean wind at any height above the ground (world z = 0), and the direction its gusts are aligned with.

    The boundary layer is v(z) = (v*/k) ln(z/z0) (Waslander & Wang 2009), written with the speed at 10 m in place of
    v*/k: v(z) = v(10 m) ln(z/z0) / ln(10 m/z0), and 0 where z <= z0. The paper's upper bound (`BoundaryLayer.top_m`)
    is 117 m for 8 m/s at 10 m and 29 m for 2 m/s (latitude 45 deg); the profile is not cut there.

    Attributes:
        direction_in_world: (x, y) unit vector that the wind blows along; (1, 0) where it is calm.
        w20_m_s: horizontal speed at 6.096 m (20 ft) [m/s].
    """

    __slots__ = (
        "_inverse_roughness",
        "_roughness_m",
        "_velocity",
        "_x_per_log",
        "_y_per_log",
        "direction_in_world",
        "w20_m_s",
    )

    def __init__(self, settings: ConstantWind | BoundaryLayer) -> None:
        self.w20_m_s = settings.w20_m_s
        self._velocity: tuple[float, float, float] | None = None
        self._roughness_m = self._inverse_roughness = self._x_per_log = self._y_per_log = 0.0
        if isinstance(settings, ConstantWind):
            x, y, _ = self._velocity = settings.velocity_in_world_m_s
            speed = math.hypot(x, y)
            self.direction_in_world = (x / speed, y / speed) if speed > 0.0 else (1.0, 0.0)
        else:
            toward = math.radians(settings.toward_deg)
            self.direction_in_world = (math.cos(toward), math.sin(toward))
            per_log = settings.speed_at_10_m_m_s / math.log(TEN_METRES_M / settings.roughness_m)
            self._roughness_m = settings.roughness_m
            self._inverse_roughness = 1.0 / settings.roughness_m
            self._x_per_log = per_log * self.direction_in_world[0]
            self._y_per_log = per_log * self.direction_in_world[1]

    def at(self, height_m: float) -> tuple[float, float, float]:
        """Mean wind (x, y, z) in the world [m/s] at a height above the ground [m]."""
        if self._velocity is not None:
            return self._velocity
        if height_m <= self._roughness_m:
            return 0.0, 0.0, 0.0
        logarithm = math.log(height_m * self._inverse_roughness)
        return self._x_per_log * logarithm, self._y_per_log * logarithm, 0.0
