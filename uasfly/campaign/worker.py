"""What a worker process on this machine does first: Dask loads this module there and calls `dask_setup`."""

from __future__ import annotations

import signal
from typing import Any


def dask_setup(worker: Any) -> None:
    """Leave Ctrl-C to the process that handed out the flights: a terminal sends it to all of them at once.

    Args:
        worker: Dask's; nothing of it is changed.
    """
    del worker
    signal.signal(signal.SIGINT, signal.SIG_IGN)
