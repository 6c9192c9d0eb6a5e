"""Pictures from files, folders, videos and cameras, one after the other, for commands that look at them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from uasfly.errors import FileError
from uasfly.vision.detectors import Image

VIDEO_STEP = 5  # of a video's frames one in so many is looked at where spread views are wanted
_PICTURES = {".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm", ".ppm", ".webp"}


def pictures(source: str, most: int | None = None) -> Iterator[tuple[str, Image]]:
    """Names and pictures (h, w) or (h, w, 3) of a source.

    Args:
        source: a picture, a folder of pictures, a video, the number of a camera, or the URL of a stream.
        most: so many at most.

    Raises:
        FileError: there is nothing there, or it is no picture and no video.
    """
    path = Path(source)
    if path.is_dir():
        files = sorted(file for file in path.iterdir() if file.suffix.lower() in _PICTURES)
        if not files:
            raise FileError(source, [f"expected pictures ({', '.join(sorted(_PICTURES))}), found none in this folder"])
        for file in files[:most]:
            yield str(file), _read(file)
    elif path.suffix.lower() in _PICTURES:
        yield source, _read(path)
    elif source.isdecimal() or "://" in source or path.is_file():
        yield from _frames(source, most)
    else:
        raise FileError(
            source, ["there is no such file; expected a picture, a folder, a video, a camera number or a URL"]
        )


def step_of(source: str, step: int | None) -> int:
    """One in so many pictures of a source is to be looked at: every one but of videos, where neighbours say the same.

    Args:
        source: as for `pictures`.
        step: for videos; VIDEO_STEP where not given.
    """
    path = Path(source)
    still = path.is_dir() or path.suffix.lower() in _PICTURES
    return 1 if still else step or VIDEO_STEP


def _read(path: Path) -> Image:
    import cv2

    try:
        data = np.frombuffer(path.read_bytes(), dtype=np.uint8)
    except OSError as error:
        raise FileError(str(path), [f"it cannot be read: {error.strerror}"]) from None
    try:
        image = cv2.imdecode(data, cv2.IMREAD_COLOR) if len(data) else None
    except cv2.error:
        image = None
    if image is None:
        raise FileError(str(path), ["expected a picture (PNG, JPEG ...), found something that cannot be decoded"])
    return np.asarray(image, dtype=np.uint8)


def _frames(source: str, most: int | None) -> Iterator[tuple[str, Image]]:
    import cv2

    capture = cv2.VideoCapture(int(source) if source.isdecimal() else source)
    try:
        number = 0
        while most is None or number < most:
            there, image = capture.read()
            if not there:
                break
            yield f"{source} #{number}", np.asarray(image, dtype=np.uint8)
            number += 1
    finally:
        capture.release()
    if number == 0:
        raise FileError(source, ["no picture comes from it; expected a video, a camera number or a stream"])
