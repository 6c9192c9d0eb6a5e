"""The camera of a rehearsal: frames of the simulated vehicle, looked at as a computer of its speed would get to them.

A frame is exposed, arrives after the camera's latency, waits until the detector is free (the newest wins, as in
`uasfly.vision.worker`), and its poses are there when the detector's time has passed. Everything follows from the seed.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Protocol

import numpy as np

from uasfly.drivers.sight import Sight
from uasfly.messages import MarkerSample
from uasfly.observer.observer import Observer
from uasfly.sim.camera.shutter import Arrivals, Exposure, Shutter
from uasfly.sim.vehicle import SimulatedVehicle

Seeing = Callable[[Exposure], list[MarkerSample]]


class Eyes(Protocol):
    """What gives a flight its sightings."""

    def look(self, now_s: float) -> tuple[MarkerSample, ...]:
        """Sightings that are there by now and were not given out yet."""
        ...


class NoEyes:
    """A flight without a camera."""

    def look(self, now_s: float) -> tuple[MarkerSample, ...]:  # noqa: ARG002 - as `Eyes` says
        """Nothing."""
        return ()


class RehearsedEyes:
    """Camera and detector of a rehearsal.

    Args:
        sight: camera, bundles and scene.
        vehicle: whose steps the camera watches.
        observer: says where a bundle is to be expected.
        seed: of the camera and its pictures.
    """

    def __init__(self, sight: Sight, vehicle: SimulatedVehicle, observer: Observer, seed: int) -> None:
        assert sight.scene is not None
        settings = sight.scene.settings
        shutter = Shutter(sight.camera, settings, np.random.default_rng([seed, 11]))
        vehicle.watcher = shutter.watch
        self._arrivals = Arrivals(shutter)
        self._see = _modelled(sight, seed) if sight.modelled else _rendered(sight, observer, seed)
        self._detection_s = settings.detection_s
        self._free_s = 0.0  # when the detector is done with what it looks at
        self._waiting: Exposure | None = None
        self._found: deque[tuple[float, list[MarkerSample]]] = deque()

    def look(self, now_s: float) -> tuple[MarkerSample, ...]:
        """See `Eyes`."""
        for exposure in self._arrivals.until(now_s):
            self._begin(exposure.arrives_s)
            self._waiting = exposure
        self._begin(now_s)
        ready: list[MarkerSample] = []
        while self._found and self._found[0][0] <= now_s:
            ready += self._found.popleft()[1]
        return tuple(ready)

    def _begin(self, until_s: float) -> None:
        """Look at the frame that waits, where the detector gets to it before `until_s`."""
        frame = self._waiting
        if frame is None or max(frame.arrives_s, self._free_s) > until_s:
            return
        self._waiting = None
        self._free_s = max(frame.arrives_s, self._free_s) + self._detection_s
        self._found.append((self._free_s, self._see(frame)))


def make_eyes(sight: Sight | None, vehicle: SimulatedVehicle, observer: Observer, seed: int) -> Eyes:
    """The eyes of a rehearsal, with or without a camera."""
    return NoEyes() if sight is None else RehearsedEyes(sight, vehicle, observer, seed)


def _rendered(sight: Sight, observer: Observer, seed: int) -> Seeing:
    """Pictures are rendered, and the detectors that fly look at them."""
    import cv2

    from uasfly.sim.camera.renderer import Renderer
    from uasfly.vision.tracker import BundleTracker

    assert sight.scene is not None
    cv2.setNumThreads(1)  # as in the detector's own process
    scene = sight.scene
    rng = np.random.default_rng([seed, 12])
    renderer = Renderer(sight.camera, scene.bundle, scene.settings, rng, scene.others)
    trackers = [(bundle.marker_id, BundleTracker(sight.camera, bundle)) for bundle in sight.bundles]

    def see(exposure: Exposure) -> list[MarkerSample]:
        image = renderer.render(exposure.motion, exposure.since_s)
        samples = []
        for number, tracker in trackers:
            look = tracker.look(image, exposure.exposed_s, observer.expected(exposure.exposed_s, number))
            if look.sample is not None:
                samples.append(look.sample)
        return samples

    return see


def _modelled(sight: Sight, seed: int) -> Seeing:
    """Poses with drawn errors, of those bundles that are both there and looked for."""
    from uasfly.sim.camera.noise_model import NoiseModelCamera

    assert sight.scene is not None
    scene = sight.scene
    wanted = {bundle.marker_id for bundle in sight.bundles}
    models = []
    for index, (bundle, placement) in enumerate(((scene.bundle, scene.settings.bundle), *scene.others)):
        if bundle.marker_id in wanted:
            settings = scene.settings.model_copy(update={"bundle": placement, "others": ()})
            rng = np.random.default_rng([seed, 13, index])
            models.append(NoiseModelCamera(sight.camera, bundle, settings, rng))

    def see(exposure: Exposure) -> list[MarkerSample]:
        return [sample for model in models if (sample := model.see(exposure)) is not None]

    return see
