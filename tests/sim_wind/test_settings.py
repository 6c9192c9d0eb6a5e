"""What is wrong in a wind section is refused with a reason."""

from __future__ import annotations

from pathlib import Path

import pytest

from uasfly.errors import FileError
from uasfly.files import find_file, load_file, parse_overrides
from uasfly.sim.scenario import Scenario


def problems(name: str, *assignments: str) -> str:
    """The error of a shipped scenario with values changed as `--set` does."""
    with pytest.raises(FileError) as caught:
        load_file(find_file("scenario", name), Scenario, parse_overrides(assignments))
    return str(caught.value)


@pytest.mark.parametrize(
    ("scenario", "assignment", "words"),
    [
        ("calm", "wind.gusts=dryden", "mean wind at 6.1 m, which is 0"),
        ("calm", "wind.gusts=sum_of_sines", "gusts: sum_of_sines scales with the mean wind at 6.1 m, which is 0"),
        ("gusty", "wind.gusts=sines", "sum_of_sines"),
        ("gusty", "wind.mean.kind=storm", "boundary_layer"),
        ("gusty", "wind.mean.speed_at_10_m_m_s=-1", "speed_at_10_m_m_s"),
        ("gusty", "wind.mean.toward_deg=.nan", "toward_deg"),
        ("head_wind", "wind.jets[0].axis_speed=[[1, 5], [1, 4]]", "distances must ascend, found 1.0 after 1.0"),
        ("head_wind", "wind.jets[0].axis_speed=[[0, 5]]", "last distance must be greater than 0"),
        ("side_gust", "wind.jets[0].radial.points=[[0, 0.9], [1, 0]]", "first point must be [0, 1]"),
        ("side_gust", "wind.jets[0].radial.points=[[0, 1], [1, 0.5], [0.5, 0]]", "offsets must ascend"),
        ("side_gust", "wind.jets[0].schedule.end_s=0.1", "end_s must be at least start_s + edge_s"),
        ("side_gust", "wind.jets[0].elevation_deg=91", "elevation_deg"),
        ("side_gust", "wind.jets[0].follow=me", "follow"),
        ("calm", "sensors.position=gnss", "needs the section gnss"),
        ("gnss_degraded", "sensors.position=mocap", "needs position_noise_m"),
        ("gnss_degraded", "sensors.position_noise_m=0.1", "use gnss.white_sigma_m"),
        ("calm", "link.jitter_s=-0.1", "jitter_s"),
        ("gusty", "wind.mean.speed_at_10_m_m_s=1e200", "expected a number, not below 0 and not above 100"),
        ("head_wind", "wind.jets[0].axis_speed=[[1, 1e9]]", "not above 100"),
    ],
)
def test_a_wrong_value_is_named(scenario: str, assignment: str, words: str) -> None:
    """The error says which field is wrong and what was expected."""
    assert words in problems(scenario, assignment)


def test_an_unknown_field_is_refused(tmp_path: Path) -> None:
    """A misspelt field is an error at its line, not a silently calm scenario."""
    path = tmp_path / "mine.yaml"
    path.write_text("name: mine\nwind:\n  gust: dryden\n")
    with pytest.raises(FileError, match=r"line 3.*gust"):
        load_file(path, Scenario)
