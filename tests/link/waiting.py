"""Waiting for what a test expects, with a generous limit, so that no test depends on the speed of a machine."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Iterable

from tests.link.fake_vehicle import FakeVehicle
from uasfly.link.mavsdk_link import MavsdkLink
from uasfly.messages import RequestResult, Sample, TextSample

PATIENCE_S = 10.0

Pair = tuple[MavsdkLink, FakeVehicle]


async def until(link: MavsdkLink, found: Callable[[list[Sample]], bool]) -> list[Sample]:
    """Poll until `found` says yes about all samples so far; returns them."""
    samples: list[Sample] = []
    deadline = time.monotonic() + PATIENCE_S
    while not found(samples):
        assert time.monotonic() < deadline, f"not within {PATIENCE_S} s; the last samples are {samples[-5:]}"
        await link.wait(0.1)
        samples.extend(link.poll())
    return samples


async def arrived(condition: Callable[[], bool]) -> None:
    """Wait until something has come to the vehicle."""
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline, f"not within {PATIENCE_S} s"
        await asyncio.sleep(0.01)


def texts(samples: Iterable[Sample]) -> list[str]:
    """The status texts among samples."""
    return [sample.text for sample in samples if isinstance(sample, TextSample)]


def results(samples: Iterable[Sample]) -> list[RequestResult]:
    """The answers to requests among samples."""
    return [sample for sample in samples if isinstance(sample, RequestResult)]
