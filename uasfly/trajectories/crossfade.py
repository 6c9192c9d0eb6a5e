"""Takes one moving reference over into another without a step: the same mission, its frame found to lie elsewhere."""

from __future__ import annotations

from dataclasses import dataclass

from uasfly.messages import ReferenceHorizon
from uasfly.trajectories.glide import faded
from uasfly.trajectories.mission_trajectory import MissionTrajectory


@dataclass(frozen=True, slots=True)
class Crossfade:
    """The old reference's share falls from 1 to 0 as a glide's; position, velocity and acceleration are continuous.

    Attributes:
        old: where it comes from, over the same time of the mission.
        start_s, duration_s: on the clock of the reference's times.
    """

    old: MissionTrajectory
    start_s: float
    duration_s: float

    @property
    def end_s(self) -> float:
        """When the old one no longer matters."""
        return self.start_s + self.duration_s

    def between(self, old: ReferenceHorizon, new: ReferenceHorizon) -> ReferenceHorizon:
        """The mixture of both, sampled at the same times."""
        share, speed, acceleration = faded((new.time_s - self.start_s) / self.duration_s, self.duration_s)
        way = old.position_in_world - new.position_in_world
        drift = old.velocity_in_world - new.velocity_in_world
        pull = old.acceleration_in_world - new.acceleration_in_world
        a, b, c = share[:, None], speed[:, None], acceleration[:, None]
        turn = old.yaw_rad - new.yaw_rad
        return ReferenceHorizon(
            new.time_s,
            new.position_in_world + a * way,
            new.velocity_in_world + a * drift + b * way,
            new.acceleration_in_world + a * pull + 2.0 * b * drift + c * way,
            new.yaw_rad + share * turn,
            new.yaw_rate_rad_s + share * (old.yaw_rate_rad_s - new.yaw_rate_rad_s) + speed * turn,
        )

    def place(
        self, time_s: float, old: tuple[float, float, float], new: tuple[float, float, float]
    ) -> tuple[float, float, float]:
        """The mixture of two places [m] at one time [s], without arrays."""
        s = min(max((time_s - self.start_s) / self.duration_s, 0.0), 1.0)
        share = 1.0 - s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
        x, y, z = (n + share * (o - n) for o, n in zip(old, new, strict=True))
        return x, y, z
