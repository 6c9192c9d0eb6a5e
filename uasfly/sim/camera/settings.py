"""What a scenario says about the simulated camera: where the bundle hangs, its light, its timing, what goes wrong.

Which camera and which bundle there are say files of their own; here stands what a flight meets. Angles are degrees,
because people write them.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field, model_validator

from uasfly.airframe import FileModel, Positive
from uasfly.camera import Camera
from uasfly.sim.wind.settings import Finite, Fraction, Vector

Since = Literal["offboard", "boot"]
Seconds = Annotated[float, Field(ge=0.0, le=1e6, allow_inf_nan=False)]
Level = Annotated[float, Field(ge=0.0, le=1.0, description="share of full white")]


class BundleMove(FileModel):
    """The bundle is moved and turned, from where it was, evenly over `duration_s`; at once by default."""

    at_s: Seconds
    offset_m: Annotated[Vector, Field(description="world axes")] = (0.0, 0.0, 0.0)
    turn_deg: Annotated[Finite, Field(description="about its own z axis (out of the page)")] = 0.0
    duration_s: Seconds = 0.0


class BundlePlacement(FileModel):
    """Where the bundle's origin is, and how the page is turned.

    On a wall the page stands upright and faces `facing_deg`; on the floor it looks up and its upper edge points there.
    """

    name: Annotated[
        str | None, Field(min_length=1, description="bundle file or shipped name; the one looked for when not given")
    ] = None
    on: Literal["wall", "floor"] = "floor"
    position_m: Annotated[Vector, Field(description="world: x east, y north, z up, from the take-off point")]
    facing_deg: Annotated[Finite, Field(description="0 = +x (east), 90 = +y (north)")] = 0.0
    tilt_deg: Annotated[
        float, Field(ge=-90.0, le=90.0, description="the page's upper edge leans back (towards its rear) by so much")
    ] = 0.0
    moves: Annotated[tuple[BundleMove, ...], Field(max_length=100)] = ()

    @model_validator(mode="after")
    def _moves_follow_each_other(self) -> BundlePlacement:
        for before, after in pairwise(self.moves):
            if after.at_s < before.at_s + before.duration_s:
                raise ValueError(f"moves: expected each to begin after the last has ended, found at_s {after.at_s:g}")
        return self


class Background(FileModel):
    """What is behind the markers, on the plane of the page."""

    kind: Annotated[
        Literal["plain", "gradient", "concrete", "clutter"],
        Field(description="clutter is concrete with dark squares that look like markers and are none"),
    ] = "concrete"
    level: Level = 0.45
    contrast: Annotated[Fraction, Field(description="how far it differs from its level")] = 0.25


class Noise(FileModel):
    """Noise of a pixel in shares of full white: sigma^2 = read^2 + shot^2 * brightness."""

    read: Annotated[float, Field(ge=0.0, le=0.5)] = 0.006
    shot: Annotated[float, Field(ge=0.0, le=0.5, description="at full white")] = 0.012


class MountMotion(FileModel):
    """How the mount moves against the body: it sways in the wind and vibrates, on each axis."""

    sway_deg: Annotated[float, Field(ge=0.0, le=20.0, description="standard deviation")] = 0.0
    sway_time_s: Annotated[Positive, Field(description="correlation time (1/e)")] = 0.5
    vibration_deg: Annotated[float, Field(ge=0.0, le=5.0, description="standard deviation")] = 0.0
    vibration_hz: Annotated[float, Field(gt=0.0, le=1000.0)] = 60.0


class Occlusion(FileModel):
    """Something is in front of the lens for a while and hides a share of the picture, from one side."""

    start_s: Seconds
    end_s: Seconds
    share: Fraction = 1.0
    side: Literal["left", "right", "top", "bottom"] = "left"
    level: Level = 0.1

    @model_validator(mode="after")
    def _ends_after_it_starts(self) -> Occlusion:
        if self.end_s <= self.start_s:
            raise ValueError(f"expected end_s after start_s, found {self.start_s:g} and {self.end_s:g}")
        return self


class Silence(FileModel):
    """The camera gives nothing for a while, as when its cable is loose."""

    start_s: Seconds
    end_s: Seconds


class CameraSettings(FileModel):
    """The simulated camera in a scenario. Scheduled times count from the first offboard, or from the start (`boot`)."""

    bundle: Annotated[BundlePlacement, Field(description="the first bundle; the background lies in its plane")]
    others: Annotated[
        tuple[BundlePlacement, ...], Field(max_length=10, description="more bundles, each with its name")
    ] = ()
    rate_hz: Annotated[float, Field(ge=0.1, le=240.0)] = 30.0
    latency_s: Annotated[
        float | None, Field(ge=0.0, le=2.0, description="arrival minus mid-exposure; the camera file's when not given")
    ] = None
    jitter_s: Annotated[float, Field(ge=0.0, le=1.0, description="extra latency, uniform in 0..jitter_s")] = 0.0
    drop_share: Annotated[Fraction, Field(description="share of the frames that never arrive")] = 0.0
    detection_s: Annotated[
        float,
        Field(
            ge=0.0,
            le=2.0,
            description="time the vehicle's computer takes for a frame, in rehearsals: what comes meanwhile waits, and "
            "the newest of it is looked at next",
        ),
    ] = 0.03
    exposure_s: Annotated[
        float | None, Field(ge=0.0, le=0.2, description="time the shutter is open; the camera file's when not given")
    ] = None
    lens_blur_px: Annotated[float, Field(ge=0.0, le=20.0, description="sigma of the lens's blur")] = 0.5
    noise: Noise = Noise()
    vignetting: Annotated[Fraction, Field(description="share of the light that is lost in the corners")] = 0.3
    ink: Annotated[Level, Field(description="the markers' black")] = 0.08
    paper: Annotated[Level, Field(description="the markers' white")] = 0.85
    background: Background = Background()
    mount: MountMotion = MountMotion()
    occlusions: Annotated[tuple[Occlusion, ...], Field(max_length=100)] = ()
    silences: Annotated[tuple[Silence, ...], Field(max_length=100)] = ()
    after: Annotated[Since, Field(description="what scheduled times count from")] = "offboard"
    mounting_error_deg: Annotated[
        Vector, Field(description="rotation of the true mounting against the camera file's, about the camera's axes")
    ] = (0.0, 0.0, 0.0)
    mounting_error_m: Annotated[Vector, Field(description="its offset, body axes")] = (0.0, 0.0, 0.0)

    def open_s(self, camera: Camera) -> float:
        """How long the shutter is open [s]."""
        return camera.exposure_s if self.exposure_s is None else self.exposure_s

    @model_validator(mode="after")
    def _others_have_names(self) -> CameraSettings:
        if any(other.name is None for other in self.others):
            raise ValueError("others: expected a name (of a bundle file) for each of them, found one without")
        return self

    @model_validator(mode="after")
    def _paper_is_brighter_than_ink(self) -> CameraSettings:
        if self.paper <= self.ink:
            raise ValueError(f"expected paper brighter than ink, found {self.paper:g} and {self.ink:g}")
        return self
