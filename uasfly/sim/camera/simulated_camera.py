"""A simulated camera on a simulated vehicle: frames as they arrive."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from uasfly.bundle import Bundle
from uasfly.camera import Camera
from uasfly.sim.camera.optics import Image
from uasfly.sim.camera.renderer import Renderer
from uasfly.sim.camera.settings import CameraSettings
from uasfly.sim.camera.shutter import Exposure, Shutter


@dataclass(frozen=True, slots=True)
class SimulatedFrame:
    """A frame.

    Attributes:
        sequence: counts the shots; lost frames leave gaps. exposed_s: mid-exposure. arrives_s: when it is there.
        image: (height, width), gray.
    """

    sequence: int
    exposed_s: float
    arrives_s: float
    image: Image


class Arrivals:
    """Exposures on their way, handed out when they arrive."""

    def __init__(self, shutter: Shutter) -> None:
        self._shutter = shutter
        self._under_way: deque[Exposure] = deque()

    def until(self, now_s: float) -> list[Exposure]:
        """Exposures whose frames have arrived by now, oldest first; each once."""
        self._under_way.extend(self._shutter.take())
        arrived: list[Exposure] = []
        while self._under_way and self._under_way[0].arrives_s <= now_s:
            arrived.append(self._under_way.popleft())
        return arrived


class SimulatedCamera:
    """Renders what a camera on a simulated vehicle sees; the same seed and flight give the same frames.

    Give `shutter.watch` to the vehicle (`SimulatedVehicle.watcher`). Times are those of the simulation, from its start.

    Args:
        camera: its file.
        bundle: what it looks at.
        settings: the scenario's section `camera`.
        rng: of everything random.

    Attributes:
        shutter: opens as the vehicle flies. renderer: makes the pictures.
    """

    def __init__(self, camera: Camera, bundle: Bundle, settings: CameraSettings, rng: np.random.Generator) -> None:
        shutter_rng, render_rng = rng.spawn(2)
        self.shutter = Shutter(camera, settings, shutter_rng)
        self.renderer = Renderer(camera, bundle, settings, render_rng)
        self._arrivals = Arrivals(self.shutter)

    def frames_until(self, now_s: float) -> list[SimulatedFrame]:
        """Frames that have arrived by now and were not handed out yet, oldest first."""
        return [
            SimulatedFrame(it.sequence, it.exposed_s, it.arrives_s, self.renderer.render(it.motion, it.since_s))
            for it in self._arrivals.until(now_s)
        ]
