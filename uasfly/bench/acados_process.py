"""acados in a process of its own: found, started, asked, ended."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
import tempfile
import types
from pathlib import Path
from typing import IO, Any, cast

from uasfly.bench.acados_messages import Failure, Ready, Statement, Steps, Times, receive, send
from uasfly.bench.sequence import Sequence
from uasfly.control.problem import Problem
from uasfly.errors import UasflyError

HOW_TO_INSTALL = (
    "acados is not compared with: pip install --no-deps --target acados comma-deps-acados, then --acados acados "
    "(the package brings a CasADi of its own: a folder of its own keeps it away from the one that flies)"
)
END_TIMEOUT_S = 5.0


class AcadosUnavailableError(UasflyError):
    """There is no acados here, or it does not work; the text says why."""


def find_acados(folder: Path | None) -> Path:
    """Folder that holds the package `acados`: the one named, or where this Python finds it.

    Raises:
        AcadosUnavailableError: where it is not; the text says how to install it.
    """
    if folder is not None:
        found = folder.resolve()
        if not (found / "acados" / "install" / "lib").is_dir():
            raise AcadosUnavailableError(f"--acados {folder}: expected a folder with the package acados in it")
        return found
    spec = importlib.util.find_spec("acados")
    if spec is None or spec.origin is None or not (Path(spec.origin).parent / "install" / "lib").is_dir():
        raise AcadosUnavailableError(HOW_TO_INSTALL)
    return Path(spec.origin).parents[1]


class AcadosProcess:
    """A child that solves what it is given; use it as a context.

    Raises:
        AcadosUnavailableError: acados cannot be generated or compiled here, or its process has ended.
    """

    def __init__(self, folder: Path) -> None:
        self._complaints = tempfile.TemporaryFile()  # noqa: SIM115 - closed with the process
        libraries = str(folder / "acados" / "install" / "lib")
        paths = os.pathsep.join(filter(None, (libraries, os.environ.get("LD_LIBRARY_PATH", ""))))
        self._process = subprocess.Popen(
            [sys.executable, "-m", "uasfly.bench.acados_child", str(folder)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._complaints,
            env={**os.environ, "LD_LIBRARY_PATH": paths},
        )
        answer = self._receive()
        if not isinstance(answer, Ready):
            reason = answer.reason if isinstance(answer, Failure) else "an answer that is not understood"
            self.close()
            raise AcadosUnavailableError(f"acados does not work here: {reason}")
        self.version = answer.version

    def __enter__(self) -> AcadosProcess:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: types.TracebackType | None
    ) -> None:
        self.close()

    def state(self, problem: Problem) -> None:
        """Take up another problem."""
        self._send(
            Statement(
                problem.grid.interval_s,
                problem.state_weights,
                problem.input_weights,
                problem.input_lower,
                problem.input_upper,
            )
        )

    def run(self, sequence: Sequence, steps: slice) -> Times:
        """Solve some steps of a sequence; the first of them must be fresh."""
        self._send(
            Steps(
                sequence.start_s[steps],
                sequence.fresh[steps],
                sequence.initial[steps],
                sequence.yaw[steps],
                sequence.force[steps],
                sequence.parameters[steps],
                sequence.state_reference[steps],
                sequence.input_reference[steps],
            )
        )
        return cast(Times, self._receive())

    def close(self) -> None:
        """End the process and wait for it."""
        stdin, stdout = self._streams()
        try:
            stdin.close()
            self._process.wait(END_TIMEOUT_S)
        except (OSError, subprocess.TimeoutExpired):
            self._process.kill()
            self._process.wait()
        stdout.close()
        self._complaints.close()

    def _streams(self) -> tuple[IO[bytes], IO[bytes]]:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        return self._process.stdin, self._process.stdout

    def _send(self, message: object) -> None:
        try:
            send(self._streams()[0], message)
        except OSError as error:
            raise AcadosUnavailableError(self._last_words()) from error

    def _receive(self) -> Any:
        try:
            return receive(self._streams()[1])
        except EOFError as error:
            raise AcadosUnavailableError(self._last_words()) from error

    def _last_words(self) -> str:
        self._process.wait(END_TIMEOUT_S)
        self._complaints.seek(0)
        lines = self._complaints.read().decode(errors="replace").strip().splitlines()
        return f"the process that runs acados has ended: {lines[-1] if lines else 'without a word'}"
