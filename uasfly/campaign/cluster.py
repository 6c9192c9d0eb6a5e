"""Flies flights on Dask: on processes of this machine, or on a cluster that is already there."""

from __future__ import annotations

import contextlib
import importlib.util
import itertools
import logging
import pickle
from collections.abc import Iterator
from typing import Any

from uasfly.campaign.execute import ONE_THREAD, Flown, PlanOf
from uasfly.campaign.flights import Flight
from uasfly.campaign.fly import error_result, fly
from uasfly.errors import UasflyError, describe_error

CONNECT_TIMEOUT_S = 15.0
WORKERS_TIMEOUT_S = 30.0
WAITING = 2  # flights that a worker's thread has waiting beside the one it flies: no more, so that memory stays small
DEATHS = 2  # workers that may die of a flight; at the next one it is given up
INSTALL = "pip install 'uasfly[campaign]'"


def require_dask(why: str) -> None:
    """Refuse what needs Dask where it is not installed.

    Raises:
        UasflyError: it is not.
    """
    if importlib.util.find_spec("distributed") is None:
        raise UasflyError(f"{why} needs Dask, which is not installed: {INSTALL}, or fly in one process (--workers 1)")


@contextlib.contextmanager
def local_client(workers: int) -> Iterator[Any]:
    """A Dask client with this many worker processes on this machine; they end with the block, or with this process."""
    import dask
    from distributed import Client, LocalCluster

    settings = {
        "distributed.scheduler.allowed-failures": DEATHS,
        "distributed.nanny.pre-spawn-environ": ONE_THREAD,  # before numpy is imported there
        "distributed.worker.profile.enabled": False,
        **{f"distributed.admin.{what}.interval": "2s" for what in ("tick", "system-monitor")},  # not 20 ms
        "distributed.admin.tick.limit": "60s",
        "distributed.comm.timeouts.connect": "30s",
    }
    with (
        dask.config.set(settings),
        LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            dashboard_address=None,
            memory_limit=0,
            silence_logs=logging.CRITICAL,
            preload="uasfly.campaign.worker",
        ) as cluster,
        Client(cluster) as client,
    ):
        yield client


@contextlib.contextmanager
def remote_client(address: str) -> Iterator[Any]:
    """A Dask client of a cluster that is already there.

    Raises:
        UasflyError: nobody answers at the address, or the cluster has no workers.
    """
    from distributed import Client

    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    try:
        client = Client(address, timeout=CONNECT_TIMEOUT_S, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise UasflyError(
            f"--scheduler {address}: no Dask scheduler can be reached there ({str(error).splitlines()[0]}); "
            "expected an address like tcp://10.0.0.5:8786"
        ) from None
    with client:
        try:
            client.wait_for_workers(1, timeout=WORKERS_TIMEOUT_S)
        except TimeoutError:
            raise UasflyError(
                f"--scheduler {address}: the cluster has no workers; start some: dask worker {address} --nthreads 1"
            ) from None
        yield client


def check_workers(client: Any, own: dict[str, str]) -> None:
    """Refuse a cluster that would not fly as this machine does.

    Args:
        client: of the cluster.
        own: facts of this machine, see `identity.facts`.

    Raises:
        UasflyError: a worker has another version of something, or no uasfly.
    """

    def ask() -> dict[str, str] | str:  # within a function it travels whole, also to where there is no uasfly
        try:
            from uasfly.campaign.identity import facts
        except ImportError as error:
            return f"uasfly with campaigns cannot be imported ({error})"
        return facts()

    problems = []
    for worker, answer in sorted(client.run(ask, on_error="return").items()):
        if isinstance(answer, dict):
            problems += [
                f"{worker}: {name} {answer.get(name)}, here {value}"
                for name, value in own.items()
                if answer.get(name) != value
            ]
        else:
            problems.append(f"{worker}: {answer}")
    if problems:
        raise UasflyError(
            "the workers are not as this machine is, so the same flight would not give the same row "
            "(code: digest of the source of uasfly):\n" + "\n".join(problems) + f"\ninstall the same there: {INSTALL}"
        )


def fly_on(client: Any, flights: list[Flight], plan_of: PlanOf, code: str) -> Iterator[Flown]:
    """Fly on a cluster; flights come back as they land, in any order.

    Args:
        client: of the cluster.
        flights: what to fly.
        plan_of: the plan of a flight.
        code: see `fly`.

    Raises:
        UasflyError: the cluster has gone.
    """
    from distributed import as_completed

    waiting = iter(flights)
    in_the_air: dict[str, Flight] = {}

    def submit(flight: Flight) -> Any:
        key = f"uasfly-flight-{flight.id}"
        in_the_air[key] = flight
        return client.submit(fly, pickle.dumps(plan_of(flight)), code, key=key, pure=False)

    def wanted() -> int:
        return max(0, (1 + WAITING) * _threads(client) - len(in_the_air))

    landed = as_completed([submit(flight) for flight in itertools.islice(waiting, wanted())], loop=client.loop)
    for future in landed:
        flight = in_the_air.pop(future.key)
        if future.status == "finished":
            result = future.result()
        elif future.status == "error":
            result = error_result(_lost(future.exception()))
        else:
            raise UasflyError("the cluster has gone while it was flying; the same command flies what is missing")
        future.release()
        for another in itertools.islice(waiting, wanted()):
            landed.add(submit(another))
        yield flight, result


def _threads(client: Any) -> int:
    """Threads of all workers that there are now; at least one, so that flights wait for workers that come back."""
    workers = client.scheduler_info(n_workers=-1)["workers"]
    threads: int = sum(worker["nthreads"] for worker in workers.values())
    return max(1, threads)


def _lost(error: BaseException) -> str:
    from distributed import KilledWorker

    if isinstance(error, KilledWorker):
        return "the workers that flew it died, one after the other; is there memory enough?"
    return describe_error(error)
