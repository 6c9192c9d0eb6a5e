from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from uasfly.errors import FileError
from uasfly.files import find_file, load_file, shipped_names
from uasfly.sim.camera.placement import PlacedBundle
from uasfly.sim.camera.settings import BundlePlacement, CameraSettings
from uasfly.sim.scenario import Scenario

FILE = """
name: marker
camera:
  bundle: { on: wall, position_m: [3.0, 0.0, 2.0], facing_deg: 180.0 }
  rate_hz: 20
  latency_s: 0.1
  drop_share: 0.05
  mount: { sway_deg: 0.3 }
  occlusions:
    - { start_s: 10, end_s: 12, share: 0.5 }
"""


def test_a_scenario_file_may_have_a_camera(tmp_path: Path) -> None:
    """The section is read; of the shipped scenarios the one with poor GNSS has a bundle to look at."""
    path = tmp_path / "marker.yaml"
    path.write_text(FILE)
    scenario = load_file(path, Scenario)
    assert scenario.camera is not None
    assert scenario.camera.occlusions[0].share == 0.5
    assert Scenario.model_validate_json(scenario.model_dump_json()) == scenario
    shipped = {name: load_file(find_file("scenario", name), Scenario) for name in shipped_names("scenario")}
    assert [name for name, scenario in shipped.items() if scenario.camera is not None] == ["gnss_degraded"]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"rate_hz": 0}, "greater than or equal to"),
        ({"ink": 0.9}, "paper brighter than ink"),
        ({"occlusions": [{"start_s": 2, "end_s": 1}]}, "end_s after start_s"),
        ({"drop_share": 1.5}, "less than or equal to 1"),
        ({"latency_s": math.nan}, "latency_s"),
        ({"bundle": {"position_m": (0, 0, 0), "moves": [{"at_s": 5}, {"at_s": 1}]}}, "begin after the last has ended"),
        ({"colour": "red"}, "Extra inputs"),
    ],
)
def test_odd_settings_are_refused(change: dict[str, object], words: str) -> None:
    """Each with what was expected."""
    with pytest.raises(ValidationError, match=words):
        CameraSettings.model_validate({"bundle": {"position_m": (0.0, 0.0, 0.0)}, **change})


def test_problems_of_a_file_name_their_line(tmp_path: Path) -> None:
    """As everywhere."""
    path = tmp_path / "marker.yaml"
    path.write_text(FILE.replace("rate_hz: 20", "rate_hz: -20"))
    with pytest.raises(FileError, match=r"line 5: camera\.rate_hz"):
        load_file(path, Scenario)


def test_a_page_on_the_wall_stands_upright_and_faces_where_it_is_told() -> None:
    """Its z axis looks north, its y axis up, its x axis to the right of who looks at it."""
    _, rotation = PlacedBundle(BundlePlacement(on="wall", position_m=(0.0, 0.0, 1.0), facing_deg=90.0)).pose(0.0)
    assert rotation[:, 2] == pytest.approx([0.0, 1.0, 0.0])
    assert rotation[:, 1] == pytest.approx([0.0, 0.0, 1.0])
    assert rotation[:, 0] == pytest.approx([-1.0, 0.0, 0.0])
    assert np.linalg.det(rotation) == pytest.approx(1.0)


def test_a_page_on_the_floor_looks_up() -> None:
    """Its z axis is up, its upper edge points where it is told; leaning it back turns it about its x axis."""
    _, rotation = PlacedBundle(BundlePlacement(on="floor", position_m=(0.0, 0.0, 0.0), facing_deg=0.0)).pose(0.0)
    assert rotation[:, 2] == pytest.approx([0.0, 0.0, 1.0])
    assert rotation[:, 1] == pytest.approx([1.0, 0.0, 0.0])
    leaning = BundlePlacement(on="wall", position_m=(0.0, 0.0, 0.0), facing_deg=0.0, tilt_deg=30.0)
    _, rotation = PlacedBundle(leaning).pose(0.0)
    assert rotation[:, 2] == pytest.approx([math.cos(math.pi / 6), 0.0, 0.5])


def test_moves_add_up() -> None:
    """At once or evenly over a while; before the schedule's clock runs nothing has moved."""
    moves = (
        {"at_s": 5.0, "offset_m": (0.5, 0.0, 0.0)},
        {"at_s": 10.0, "offset_m": (0.0, 1.0, 0.0), "turn_deg": 90.0, "duration_s": 2.0},
    )
    placement = BundlePlacement.model_validate({"on": "floor", "position_m": (1.0, 0.0, 0.0), "moves": moves})
    placed = PlacedBundle(placement)
    for since_s, expected in ((-math.inf, (1.0, 0.0)), (5.0, (1.5, 0.0)), (11.0, (1.5, 0.5)), (99.0, (1.5, 1.0))):
        assert placed.pose(since_s)[0][:2] == pytest.approx(expected)
    turned = placed.first_rotation.T @ placed.pose(99.0)[1]
    assert turned == pytest.approx(np.array(((0, -1, 0), (1, 0, 0), (0, 0, 1))), abs=1e-9)


def test_the_simulated_camera_knows_nothing_of_vision() -> None:
    """Nor of observer and control: what detectors say of its pictures is no flattery; a scenario needs no OpenCV."""
    script = (
        "import sys, uasfly.sim.scenario; assert 'cv2' not in sys.modules\n"
        "import uasfly.sim.camera.renderer, uasfly.sim.camera.noise_model, uasfly.sim.camera.child\n"
        "print(*(name for name in sys.modules if name.startswith('uasfly.')))"
    )
    output = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True, timeout=60)
    forbidden = ("uasfly.model", "uasfly.observer", "uasfly.control", "uasfly.vision", "uasfly.flight")
    assert not [name for name in output.stdout.split() if name.startswith(forbidden)]
