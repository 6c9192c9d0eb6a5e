"""Samples of times, and what is told of them."""

from __future__ import annotations

import contextlib
import gc
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass

import numpy as np

from uasfly.messages import Array


@dataclass(frozen=True, slots=True)
class Figures:
    """Median, 99th percentile and largest of some times [ms]."""

    median: float
    p99: float
    max: float

    @classmethod
    def of(cls, samples_ms: Array | Sequence[float]) -> Figures | None:
        """Figures of samples [ms]; None without any."""
        samples = np.asarray(samples_ms, dtype=np.float64)
        if samples.size == 0:
            return None
        median, p99 = np.percentile(samples, (50.0, 99.0)).tolist()
        return cls(median, p99, float(samples.max()))

    def as_dict(self) -> dict[str, float]:
        """Plain data, rounded to a tenth of a microsecond."""
        return {name: round(value, 4) for name, value in asdict(self).items()}


@dataclass(frozen=True, slots=True)
class Ratios:
    """How times compare with those of an anchor that was measured in turn with them.

    Attributes:
        median: of the ratios of the medians of two blocks that followed each other.
        p99: ratio of the 99th percentiles of all samples of both.
    """

    median: float
    p99: float

    @classmethod
    def of(cls, blocks_ms: Sequence[Array], anchor_ms: Sequence[Array]) -> Ratios | None:
        """Ratios of blocks [ms] to the anchor's [ms], taken in the order in which they were measured.

        Blocks without a partner count for nothing, so both percentiles are of the same problems; None where there is
        no pair.
        """
        pairs = [(a, b) for a, b in zip(blocks_ms, anchor_ms, strict=False) if a.size and b.size]
        if not pairs:
            return None
        medians = [float(np.median(block) / np.median(anchor)) for block, anchor in pairs]
        own, theirs = (np.concatenate(side) for side in zip(*pairs, strict=True))
        p99 = float(np.percentile(own, 99.0) / np.percentile(theirs, 99.0))
        return cls(float(np.median(medians)), p99)


@contextlib.contextmanager
def as_in_flight() -> Iterator[None]:
    """Garbage collection as in a flight: what lives before is not looked through, collection itself stays on."""
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
