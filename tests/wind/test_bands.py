"""The split of a signal into quasi-static, gust and the rest."""

from __future__ import annotations

import numpy as np
import pytest

from uasfly.errors import UasflyError
from uasfly.messages import Array
from uasfly.wind.bands import Bands, BandSplit

PERIOD_S = 0.5


def _split(values: Array, period_s: float = PERIOD_S) -> list[Bands]:
    split = BandSplit(period_s)
    return [split.update(number * period_s, value) for number, value in enumerate(values)]


def _stacked(bands: list[Bands]) -> tuple[Array, Array, Array]:
    return (
        np.array([band.quasi_static for band in bands]),
        np.array([band.gust for band in bands]),
        np.array([band.rest for band in bands]),
    )


def test_the_parts_sum_to_the_signal() -> None:
    """Whatever the signal, of however many axes."""
    values = np.cumsum(np.random.default_rng(7).normal(size=(500, 6)), axis=0)
    np.testing.assert_allclose(sum(_stacked(_split(values))), values, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(("frequency_hz", "part"), [(0.0004, 0), (0.03, 1), (0.95, 2)])
def test_a_sine_comes_out_in_its_band(frequency_hz: float, part: int) -> None:
    """Far from the band's ends one part has its amplitude, to a tenth, and the others have next to nothing."""
    times = PERIOD_S * np.arange(round(2.0 / frequency_hz / PERIOD_S) if part == 0 else 4000)
    sine = np.sin(2.0 * np.pi * frequency_hz * times)
    half = len(times) // 2
    powers = [float(np.mean(values[half:] ** 2)) for values in _stacked(_split(sine[:, None]))]
    assert np.sqrt(2.0 * powers[part]) == pytest.approx(1.0, abs=0.1)
    assert max(power for number, power in enumerate(powers) if number != part) < 0.05


def test_gusts_are_not_late() -> None:
    """A sine in the middle of the band comes out as gust within a tenth of its height, sample by sample."""
    sine = np.sin(2.0 * np.pi * 0.026 * PERIOD_S * np.arange(2000))
    _, gust, _ = _stacked(_split(sine[:, None]))
    assert np.abs(gust[1000:, 0] - sine[1000:]).max() < 0.1


def test_it_looks_at_nothing_that_comes_later() -> None:
    """The parts of a beginning do not depend on how the signal goes on."""
    values = np.random.default_rng(8).normal(size=(300, 2))
    other = values.copy()
    other[200:] += 5.0
    for one, two in zip(_stacked(_split(values)), _stacked(_split(other)), strict=True):
        np.testing.assert_array_equal(one[:200], two[:200])


def test_a_steady_wind_is_quasi_static_from_the_first_sample() -> None:
    """No filter starts from zero."""
    for band in _split(np.full((50, 1), 8.0)):
        np.testing.assert_allclose((band.quasi_static[0], band.gust[0], band.rest[0]), (8.0, 0.0, 0.0), atol=1e-6)


def test_lost_and_uneven_samples_keep_the_filters_in_time() -> None:
    """Every third sample lost and the others up to a fifth of a period off: the bands stay near all samples' ones."""
    times = PERIOD_S * np.arange(600)
    signal = 8.0 + np.sin(2.0 * np.pi * 0.02 * times)
    whole = _split(signal[:, None])
    rng = np.random.default_rng(9)
    split = BandSplit(PERIOD_S)
    for number, time_s in enumerate(times):
        if number % 3 == 1:
            continue
        at = time_s + rng.uniform(-0.2, 0.2) * PERIOD_S * (number > 0)
        band = split.update(at, np.array((8.0 + np.sin(2.0 * np.pi * 0.02 * at),)))
        assert band.quasi_static[0] == pytest.approx(whole[number].quasi_static[0], abs=0.02)
        assert band.gust[0] == pytest.approx(whole[number].gust[0], abs=0.05)


def test_early_and_broken_samples_do_not_move_the_filters() -> None:
    """The slow bands are the last ones; the parts of an early sample still sum to it."""
    split = BandSplit(PERIOD_S)
    split.update(0.0, np.array((8.0,)))
    last = split.update(PERIOD_S, np.array((9.0,)))
    early = split.update(PERIOD_S + 0.01, np.array((20.0,)))
    broken = split.update(2.0 * PERIOD_S, np.array((np.nan,)))
    for band in (early, broken):
        assert (band.quasi_static[0], band.rest[0]) == (last.quasi_static[0], last.rest[0])
    assert early.quasi_static[0] + early.gust[0] + early.rest[0] == pytest.approx(20.0)


def test_after_a_long_gap_it_starts_anew() -> None:
    """The first sample after it is all quasi-static."""
    split = BandSplit(PERIOD_S)
    split.update(0.0, np.array((8.0,)))
    band = split.update(60.0, np.array((2.0,)))
    np.testing.assert_allclose((band.quasi_static[0], band.gust[0], band.rest[0]), (2.0, 0.0, 0.0), atol=1e-12)


@pytest.mark.parametrize(
    ("period_s", "band", "name"), [(4.0, (0.005, 0.1389), "period_s"), (0.1, (0.2, 0.1), "band_hz")]
)
def test_bands_that_cannot_be_told_apart_are_refused(period_s: float, band: tuple[float, float], name: str) -> None:
    """The message names the argument."""
    with pytest.raises(UasflyError, match=name):
        BandSplit(period_s, band)
