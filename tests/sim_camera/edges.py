"""Edges of a marker in a picture, found by their light and not by a detector."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from uasfly.camera import Camera
from uasfly.messages import Array

REACH_PX = 4


def edge_errors_px(image: NDArray[np.uint8], camera: Camera, corners: Array, ink: float, paper: float) -> Array:
    """Distance [px] of the rendered edge from the true one, along each side of a marker; positive: it is too large.

    Across the edge the pixels' light is summed over REACH_PX to both sides: what is black of it is black up to the
    edge, exactly, wherever in its pixel that lies.

    Args:
        image: (height, width).
        camera: projects.
        corners: (4, 3) m of the black square [camera axes].
        ink: brightness of black, 0..1.
        paper: brightness of white, 0..1.
    """
    errors: list[float] = []
    centre = camera.project(corners.mean(axis=0)[None])[0]
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        shares = np.linspace(0.0, 1.0, 400)[:, None]
        line = camera.project(start + shares * (end - start))
        along = line[-1] - line[0]
        main = int(abs(along[1]) > abs(along[0]))  # the axis that the edge follows
        across = 1 - main
        order = np.argsort(line[:, main])
        span = np.sort(line[[0, -1], main])
        slope = abs(along[across] / along[main])
        margin = REACH_PX + 2.0 + slope * REACH_PX
        for place in range(int(np.ceil(span[0] + margin)), int(np.floor(span[1] - margin))):
            # a pixel averages over its width: so does the true edge
            inner = np.linspace(place - 0.5, place + 0.5, 9)
            true = float(np.mean(np.interp(inner, line[order, main], line[order, across])))
            first = round(true) - REACH_PX
            pixels = np.arange(first, first + 2 * REACH_PX + 1)
            values = (image[pixels, place] if main == 0 else image[place, pixels]) / 255.0
            black = float(np.sum((paper - values) / (paper - ink)))
            if centre[across] < true:  # black from the first pixel's outer side on
                errors.append(first - 0.5 + black - true)
            else:
                errors.append(true - (first + 2 * REACH_PX + 0.5 - black))
    return np.array(errors)
