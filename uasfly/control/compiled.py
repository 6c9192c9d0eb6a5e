"""The backend in C: one call for the references, one call for an iteration."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uasfly.control.native_library import load_solver
from uasfly.control.problem import Problem
from uasfly.control.qp import Active, QpOptions, QpSolution, SolveStatus, StageQp
from uasfly.control.workspace import Workspace
from uasfly.native import NativeUnavailableError

_pointer, _int, _double = ctypes.c_void_p, ctypes.c_int, ctypes.c_double


class _ProblemStruct(ctypes.Structure):
    """`problem_t` of native/1_workspace.c, field by field."""

    _fields_ = [
        ("nodes", _int),
        ("active_set_sweeps", _int),
        ("interior_iterations", _int),
        ("polish_sweeps", _int),
        ("bound_tolerance", _double),
        ("start_barrier", _double),
        ("early_gap", _double),
        ("final_gap", _double),
        ("loose_gap", _double),
        *(
            (name, _pointer)
            for name in (
                "interval",
                "time",
                "state_weight",
                "input_weight",
                "lower",
                "upper",
                "limits",
                "parameters",
                "force",
                "initial",
                "yaw",
                "position",
                "velocity",
                "acceleration",
                "state_reference",
                "input_reference",
                "states",
                "inputs",
                "active",
                "figures",
                "workspace",
            )
        ),
    ]


class CompiledBackend:
    """Backend on a workspace; also a QpSolver, for comparison with others. One instance is for one thread.

    Raises:
        NativeUnavailableError: where there is no compiler, no private cache, or the library does not fit.
    """

    name = "c"

    def __init__(
        self,
        problem: Problem,
        workspace: Workspace,
        options: QpOptions | None = None,
        library: ctypes.PyDLL | None = None,
    ) -> None:
        options = options or QpOptions()
        library = library or load_solver()
        nodes = problem.grid.nodes
        library.uasfly_workspace_bytes.restype = ctypes.c_long
        library.uasfly_problem_bytes.restype = ctypes.c_long
        if library.uasfly_problem_bytes() != ctypes.sizeof(_ProblemStruct):
            raise NativeUnavailableError("the compiled solver lays out its data otherwise than Python expects")
        memory = np.zeros(library.uasfly_workspace_bytes(nodes) + 64, np.uint8)
        self._problem = problem
        self._kept: dict[str, NDArray[Any]] = {
            "interval": problem.grid.interval_s,
            "time": problem.grid.time_s,
            "state_weight": problem.state_weights,
            "input_weight": problem.input_weights,
            "lower": problem.input_lower,
            "upper": problem.input_upper,
            "limits": workspace.limits,
            "parameters": workspace.parameters,
            "force": workspace.force,
            "initial": workspace.initial,
            "yaw": workspace.yaw,
            "position": workspace.position,
            "velocity": workspace.velocity,
            "acceleration": workspace.acceleration,
            "state_reference": workspace.state_reference,
            "input_reference": workspace.input_reference,
            "states": workspace.states,
            "inputs": workspace.inputs,
            "active": workspace.active,
            "figures": workspace.figures,
            "workspace": memory[-memory.ctypes.data % 64 :],  # a cache line's boundary
        }
        struct = _ProblemStruct()
        struct.nodes = nodes
        for name in (
            "active_set_sweeps",
            "interior_iterations",
            "polish_sweeps",
            "bound_tolerance",
            "start_barrier",
            "early_gap",
            "final_gap",
            "loose_gap",
        ):
            setattr(struct, name, getattr(options, name))
        for name, array in self._kept.items():
            if not array.flags.c_contiguous:
                raise ValueError(f"{name} must be contiguous")
            setattr(struct, name, array.ctypes.data)
        self._struct = struct
        self._address = _pointer(ctypes.addressof(struct))
        self._library = library
        library.uasfly_references.argtypes = [_pointer]
        library.uasfly_iterate.argtypes = [_pointer, _double]
        self._references = library.uasfly_references
        self._iterate = library.uasfly_iterate
        self._figures = workspace.figures

    def references(self) -> SolveStatus:
        """See `Backend.references`."""
        return SolveStatus(self._references(self._address))

    def iterate(self, elapsed_s: float) -> SolveStatus:
        """See `Backend.iterate`."""
        return SolveStatus(self._iterate(self._address, elapsed_s))

    def solve(self, qp: StageQp, active: Active) -> QpSolution:
        """See `QpSolver.solve`; the weights must be those of the problem, which the driver has."""
        if not (
            np.array_equal(qp.state_weights, self._problem.state_weights)
            and np.array_equal(qp.input_weights, self._problem.input_weights)
        ):
            raise ValueError("the compiled solver has the weights of its problem; the program has others")
        data = (
            qp.jacobian,
            qp.defect,
            qp.initial,
            qp.state_gradient,
            qp.input_gradient,
            qp.lower,
            qp.upper,
        )
        arrays: list[NDArray[Any]] = [np.ascontiguousarray(array, dtype=np.float64) for array in data]
        side = np.array(active, np.int8)
        states, inputs = np.empty_like(qp.state_gradient), np.empty_like(qp.input_gradient)
        places = [_pointer(array.ctypes.data) for array in (*arrays, side, states, inputs)]
        status = SolveStatus(self._library.uasfly_solve_qp(self._address, *places))
        return QpSolution(status, states, inputs, side, int(self._figures[0]), int(self._figures[1]))
