"""The process that runs acados: `python -m uasfly.bench.acados_child FOLDER`, told what to do on its standard input.

A process of its own, because acados' libraries have the names of those that CasADi brings along, and because acados
prints on standard output, which is moved to standard error here.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from uasfly.bench.acados_messages import Failure, Ready, Statement, Steps, receive, send
from uasfly.bench.timing import as_in_flight

PACKAGE = "comma-deps-acados"


def main(package_folder: str) -> None:
    """Serve until standard input ends.

    The folder that holds acados goes to the end of the path: CasADi and numpy stay those of uasfly.
    """
    sys.path.append(package_folder)
    with os.fdopen(os.dup(1), "wb") as answers, tempfile.TemporaryDirectory(prefix="uasfly-acados-") as folder:
        os.dup2(2, 1)
        sys.stdout = sys.stderr
        try:
            from uasfly.bench.acados_problem import AcadosRunner, make_solver

            runner = AcadosRunner(make_solver(Path(folder)))
        except Exception as error:  # acados raises plain Exception
            send(answers, Failure(f"{type(error).__name__}: {error}"))
            return
        send(answers, Ready(_version()))
        with as_in_flight():
            while True:
                try:
                    message = receive(sys.stdin.buffer)
                except EOFError:
                    return
                if isinstance(message, Statement):
                    runner.state(message)
                elif isinstance(message, Steps):
                    send(answers, runner.run(message, time.perf_counter))


def _version() -> str:
    try:
        return version(PACKAGE)
    except PackageNotFoundError:
        return "unknown"


if __name__ == "__main__":
    main(sys.argv[1])
