"""What a flight sees with: which camera, which bundles are looked for, and in a simulation where bundles really are.

The camera's and the bundles' files are what uasfly believes. Where bundles are and what happens to the pictures says
the scenario; it may also mount the camera a bit differently from its file.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from uasfly.bundle import Bundle
from uasfly.camera import Camera
from uasfly.errors import UasflyError
from uasfly.files import find_file, load_file
from uasfly.flight.tracking_errors import MarkerDatum
from uasfly.frames import rotation_matrix
from uasfly.observer import states as s
from uasfly.observer.observer import Observer
from uasfly.sim.camera.placement import PlacedBundle
from uasfly.sim.camera.settings import BundlePlacement, CameraSettings
from uasfly.sim.scenario import Scenario

NONE, MODEL = "none", "model"
DEFAULT_BUNDLE = "four_36h11"
DEFAULT_CAMERAS = {"floor": "vga", "wall": "wide_720p"}  # in simulations: one looks down, one looks ahead


@dataclass(frozen=True, slots=True)
class CameraScene:
    """What the simulated camera meets.

    Attributes:
        settings: the scenario's; `bundle` says where the first bundle is.
        bundle: the first one that is looked for, or one that is there instead. others: what else is there.
    """

    settings: CameraSettings
    bundle: Bundle
    others: tuple[tuple[Bundle, BundlePlacement], ...]


@dataclass(frozen=True, slots=True)
class Sight:
    """Camera and bundles of a flight.

    Attributes:
        camera: as uasfly believes it. bundles: looked for. modelled: poses from the noise model, nothing is rendered.
        source: of the frames of a live flight; None for the simulated camera.
        scene: what is simulated, None for a real flight.
    """

    camera: Camera
    bundles: tuple[Bundle, ...]
    modelled: bool = False
    source: str | None = None
    scene: CameraScene | None = None

    @property
    def name(self) -> str:
        """For the summary."""
        return f"{self.camera.name} (noise model)" if self.modelled else self.camera.name

    def description(self) -> dict[str, Any]:
        """Plain data for the log."""
        return {
            "camera": self.camera.model_dump(mode="json"),
            "bundles": [bundle.model_dump(mode="json") for bundle in self.bundles],
            "modelled": self.modelled,
            "source": self.source,
        }


@dataclass(frozen=True, slots=True)
class SightOptions:
    """What was asked for.

    Attributes:
        camera: a camera's name or file, `none`, `model` or `model:` and a camera; None for none, unless the mission
            flies by a bundle.
        bundles: names or files. source: see `uasfly.vision.sources.open_source`.
    """

    camera: str | None = None
    bundles: tuple[str, ...] = ()
    source: str | None = None


NO_SIGHT = SightOptions()


def load_sight(options: SightOptions, scenario: Scenario | None, mission_bundle: str | None) -> Sight | None:
    """Read the files of what a flight sees with; None where it flies without a camera.

    Args:
        options: what was asked for.
        scenario: of a simulation, else None.
        mission_bundle: the one that the mission flies by, None for none.

    Raises:
        UasflyError: a file or a combination that cannot be used.
    """
    asked = options.camera
    nothing_there = scenario is not None and scenario.camera is None
    if asked == NONE or (asked is None and (mission_bundle is None or nothing_there)):
        if options.bundles or options.source:
            raise UasflyError("--bundle and --camera-source need a camera: add --camera NAME|FILE")
        return None
    modelled = asked is not None and (asked == MODEL or asked.startswith(f"{MODEL}:"))
    name = None if asked is None else asked.partition(":")[2] or None if modelled else asked
    if scenario is None:
        _refuse_on_a_real_vehicle(options, modelled, name)
    elif nothing_there:
        raise UasflyError(
            f"--camera: scenario {scenario.name} does not say where a bundle is; take one with a section camera "
            "(gnss_degraded), or add --set 'scenario.camera.bundle.position_m=[0, 0, 0]'"
        )
    wanted = options.bundles or ((mission_bundle,) if mission_bundle else (_first_name(scenario),))
    bundles = tuple(_load_bundle(bundle) for bundle in wanted)
    numbers = [bundle.marker_id for bundle in bundles]
    if len(set(numbers)) < len(numbers):
        raise UasflyError(f"--bundle: expected bundles with different numbers, found {numbers}; set `number` in a file")
    scene, on = None, "floor"
    if scenario is not None and scenario.camera is not None:
        scene = _scene(scenario.camera, dict(zip(wanted, bundles, strict=True)))
        on = scene.settings.bundle.on
    camera = load_file(find_file("camera", name or DEFAULT_CAMERAS[on]), Camera)
    return Sight(camera, bundles, modelled, options.source, scene)


def _refuse_on_a_real_vehicle(options: SightOptions, modelled: bool, name: str | None) -> None:
    if modelled:
        raise UasflyError("--camera model belongs to rehearsals: name the camera's file on a real vehicle")
    if name is None:
        raise UasflyError("this mission flies by a bundle: name the camera's file with --camera FILE")
    if not options.source:
        raise UasflyError("--camera: say where its frames come from: --camera-source INDEX|DEVICE|URL|FILE|FOLDER")


def _first_name(scenario: Scenario | None) -> str:
    named = None if scenario is None or scenario.camera is None else scenario.camera.bundle.name
    return named or DEFAULT_BUNDLE


def _scene(settings: CameraSettings, looked_for: dict[str, Bundle]) -> CameraScene:
    """The bundles that are there; one that is looked for comes first, and the background lies in its plane."""
    first = next(iter(looked_for))
    there: list[tuple[str, BundlePlacement]] = [
        (placement.name or first, placement) for placement in (settings.bundle, *settings.others)
    ]
    there.sort(key=lambda item: item[0] != first)  # stable: the others keep their order
    bundles = [(looked_for[name] if name in looked_for else _load_bundle(name), place) for name, place in there]
    (bundle, placement), others = bundles[0], tuple(bundles[1:])
    rest = tuple(place.model_copy(update={"name": name}) for name, place in there[1:])
    return CameraScene(settings.model_copy(update={"bundle": placement, "others": rest}), bundle, others)


def _load_bundle(name: str) -> Bundle:
    from uasfly.vision.stag_ros import find_bundle

    return find_bundle(name)


class TrueMarkers:
    """Where the bundles of a simulation are in truth, before any move; without a camera there are none."""

    def __init__(self, sight: Sight | None) -> None:
        scene = None if sight is None else sight.scene
        there = () if scene is None else ((scene.bundle, scene.settings.bundle), *scene.others)
        self._places = [(bundle.marker_id, PlacedBundle(placement)) for bundle, placement in there]

    def datum(self, observer: Observer) -> MarkerDatum | None:
        """The first bundle that is in the filter, there and in truth; None where there is none."""
        if not self._places:
            return None
        moment = observer.moment
        if moment is None or not moment.markers:
            return None
        for marker_id, true in self._places:
            if marker_id in moment.markers:
                pose = moment.packed[s.marker_nominal(moment.markers.index(marker_id))]
                turn = rotation_matrix(pose[3:]) @ true.first_rotation.T
                return MarkerDatum(pose[:3].copy(), true.first_position, math.atan2(turn[1, 0], turn[0, 0]))
        return None
