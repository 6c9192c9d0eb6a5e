"""The simulated camera in a process of its own: renders what its vehicle exposes and serves it as an MJPEG stream.

The parent writes the job (a line of JSON) and then the exposures to the child's standard input; the child writes
"ready PORT" to its standard output. It ends when its standard input does.
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import subprocess
import sys
import time
from collections.abc import Sequence
from types import TracebackType
from typing import Self

import numpy as np

from uasfly.bundle import Bundle
from uasfly.camera import Camera
from uasfly.errors import LinkError
from uasfly.sim.camera.feed import ExposureFeed
from uasfly.sim.camera.settings import BundlePlacement, CameraSettings
from uasfly.sim.camera.shutter import Shutter

READY_TIMEOUT_S = 60.0
STOP_TIMEOUT_S = 3.0


class CameraProcess:
    """Handle of a running simulated camera; also a context manager that stops it.

    Args:
        camera: its file. bundle: what it looks at. settings: the scenario's section `camera`.
        seed: of everything random.
        port: TCP port of the stream, 0 for any that is free.
        others: more bundles and where they are.

    Raises:
        LinkError: it could not start.

    Attributes:
        feed: give its `watch` to the vehicle, and call its `send` after each advance. port: of the stream.
        url: what a client opens.
    """

    def __init__(
        self,
        camera: Camera,
        bundle: Bundle,
        settings: CameraSettings,
        seed: int,
        port: int = 0,
        others: Sequence[tuple[Bundle, BundlePlacement]] = (),
    ) -> None:
        job = {
            "camera": camera.model_dump_json(exclude_none=True),
            "bundle": bundle.model_dump_json(exclude_none=True),
            "others": [(one.model_dump_json(exclude_none=True), place.model_dump_json()) for one, place in others],
            "settings": settings.model_dump_json(),
            "seed": seed,
            "port": port,
        }
        self._process = subprocess.Popen(
            [sys.executable, "-m", "uasfly.sim.camera"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,
            env={"OMP_NUM_THREADS": "1", **os.environ},
        )
        assert self._process.stdin is not None
        try:
            with contextlib.suppress(BrokenPipeError):
                self._process.stdin.write(json.dumps(job).encode() + b"\n")
                self._process.stdin.flush()
            self.port = self._wait_until_ready()
        except BaseException:
            self.stop()
            raise
        self.url = f"http://127.0.0.1:{self.port}/camera"
        rng = np.random.default_rng([seed, 11])
        self.feed = ExposureFeed(Shutter(camera, settings, rng), self._process.stdin.fileno())

    @property
    def alive(self) -> bool:
        """Whether it still runs."""
        return self._process.poll() is None

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    def stop(self) -> None:
        """End it and wait for it; a second call does nothing."""
        process = self._process
        assert process.stdin is not None
        assert process.stdout is not None
        with contextlib.suppress(OSError):
            process.stdin.close()
        try:
            process.wait(STOP_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        process.stdout.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()

    def _wait_until_ready(self) -> int:
        assert self._process.stdout is not None
        deadline, line = time.monotonic() + READY_TIMEOUT_S, b""
        descriptor = self._process.stdout.fileno()
        while not line.endswith(b"\n"):
            readable, _, _ = select.select((descriptor,), (), (), max(0.0, deadline - time.monotonic()))
            piece = os.read(descriptor, 1) if readable else b""
            if not piece:
                raise LinkError(f"the simulated camera did not start: {line.decode(errors='replace') or 'no answer'}")
            line += piece
        kind, _, rest = line.decode(errors="replace").strip().partition(" ")
        if kind != "ready":
            raise LinkError(f"the simulated camera did not start: {rest}")
        return int(rest)
