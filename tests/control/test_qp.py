"""The tailored quadratic program solver against a library's and against dense algebra, bounds active."""

from __future__ import annotations

import ctypes
import dataclasses
import functools
from collections.abc import Callable

import numpy as np
import pytest

from tests.control.programs import PATTERN, dense_solution, optimality, random_program, small_problem
from uasfly.control.compiled import CompiledBackend
from uasfly.control.problem import Problem
from uasfly.control.qp import QpOptions, QpSolution, QpSolver, SolveStatus, StageQp
from uasfly.control.qp_riccati import RiccatiQp
from uasfly.control.riccati_machine import machine_functions
from uasfly.control.workspace import Workspace

MakeSolver = Callable[[Problem, QpOptions], QpSolver]
STAGES = machine_functions(PATTERN)
INTERIOR_ONLY = QpOptions(active_set_sweeps=0, polish_sweeps=0)


@pytest.fixture(params=["c", "vm"])
def make_solver(request: pytest.FixtureRequest) -> MakeSolver:
    """Each implementation in turn."""
    if request.param == "vm":
        return lambda problem, options: RiccatiQp(STAGES, PATTERN.size, problem.grid.nodes, options)
    library: ctypes.PyDLL = request.getfixturevalue("library")
    return lambda problem, options: CompiledBackend(problem, Workspace(problem), options, library)


def _guess(problem: Problem, rng: np.random.Generator | None = None) -> np.ndarray:
    shape = (problem.grid.nodes, 3)
    return np.zeros(shape, np.int8) if rng is None else rng.integers(-1, 2, shape).astype(np.int8)


@pytest.mark.parametrize("tight", [False, True])
def test_the_solution_is_the_dense_one(make_solver: MakeSolver, tight: bool) -> None:
    """To 1e-6 of scipy's exact active set, with most inputs at their bounds and with few."""
    problem = small_problem(tight=tight)
    solver = make_solver(problem, QpOptions())
    rng = np.random.default_rng(10)
    share = 0.0
    for case in range(12):
        qp = random_program(rng, problem, error_m=0.2 * (case + 1))
        solution = solver.solve(qp, _guess(problem))
        states, inputs = dense_solution(qp)
        assert solution.status is SolveStatus.CONVERGED
        np.testing.assert_allclose(solution.inputs, inputs, atol=1e-6)
        np.testing.assert_allclose(solution.states, states, atol=1e-6)
        share += np.mean(solution.active != 0) / 12
    assert 0.05 < share < 0.95


@functools.cache
def _by_the_library(nodes: int, saturated: bool) -> tuple[Problem, list[tuple[StageQp, QpSolution]]]:
    """Programs and piqp's solutions: close to the reference in a wide box, or far from it in a tight one."""
    from uasfly.control.qp_library import LibraryQp

    problem = small_problem(nodes, tight=saturated)
    rng, library = np.random.default_rng(11), LibraryQp(PATTERN)
    programs = [random_program(rng, problem, error_m=3.0 if saturated else 0.02) for _ in range(3)]
    return problem, [(qp, library.solve(qp, _guess(problem))) for qp in programs]


@pytest.mark.parametrize("saturated", [False, True])
@pytest.mark.parametrize("nodes", [30, 60])
def test_the_solution_is_the_librarys(make_solver: MakeSolver, nodes: int, saturated: bool) -> None:
    """To 1e-6 of piqp in states and inputs: few bounds active and many, from no guess, the right one and a wild one."""
    pytest.importorskip("piqp")
    problem, programs = _by_the_library(nodes, saturated)
    solver, rng, share = make_solver(problem, QpOptions()), np.random.default_rng(12), 0.0
    for qp, other in programs:
        assert other.status is SolveStatus.CONVERGED
        share += float(np.mean(other.active != 0)) / len(programs)
        for guess in (_guess(problem), other.active, _guess(problem, rng)):
            solution = solver.solve(qp, guess)
            assert solution.status is SolveStatus.CONVERGED
            np.testing.assert_allclose(solution.inputs, other.inputs, atol=1e-6)
            np.testing.assert_allclose(solution.states, other.states, atol=1e-6)
    assert share > 0.3 if saturated else share < 0.3


def test_a_guess_of_the_active_set_changes_the_work_and_not_the_answer(make_solver: MakeSolver) -> None:
    """From the right guess one sweep suffices; from a random one the same solution is found."""
    problem = small_problem(tight=True)
    solver = make_solver(problem, QpOptions())
    rng = np.random.default_rng(12)
    for _ in range(8):
        qp = random_program(rng, problem)
        cold = solver.solve(qp, _guess(problem))
        warm = solver.solve(qp, cold.active)
        wild = solver.solve(qp, _guess(problem, rng))
        assert warm.sweeps == 1
        assert warm.interior_iterations == 0
        np.testing.assert_allclose(warm.inputs, cold.inputs, atol=1e-9)
        np.testing.assert_allclose(wild.inputs, cold.inputs, atol=1e-8)


def test_the_interior_point_alone_is_exact_enough(make_solver: MakeSolver) -> None:
    """Without an active set to finish the work the interior point itself comes to 1e-6 of the dense solution."""
    problem = small_problem(tight=True)
    solver = make_solver(problem, INTERIOR_ONLY)
    rng = np.random.default_rng(13)
    for _ in range(8):
        qp = random_program(rng, problem)
        solution = solver.solve(qp, _guess(problem))
        assert solution.sweeps == 0
        assert solution.status is SolveStatus.CONVERGED
        np.testing.assert_allclose(solution.inputs, dense_solution(qp)[1], atol=1e-6)


def test_both_implementations_agree_to_ten_digits(library: ctypes.PyDLL) -> None:
    """C and virtual machine give the same inputs, the same set and take the same sweeps."""
    problem = small_problem(25, tight=True)
    first = CompiledBackend(problem, Workspace(problem), library=library)
    second = RiccatiQp(STAGES, PATTERN.size, 25)
    rng = np.random.default_rng(14)
    for _ in range(10):
        qp = random_program(rng, problem)
        c, vm = first.solve(qp, _guess(problem)), second.solve(qp, _guess(problem))
        np.testing.assert_allclose(c.inputs, vm.inputs, atol=1e-10)
        np.testing.assert_array_equal(c.active, vm.active)
        assert (c.status, c.sweeps, c.interior_iterations) == (vm.status, vm.sweeps, vm.interior_iterations)


def test_a_hundred_metres_away_it_still_converges(make_solver: MakeSolver) -> None:
    """Gradients a hundred times larger than in normal flight do not upset the interior point."""
    problem = small_problem(25, tight=True)
    solver = make_solver(problem, QpOptions())
    rng = np.random.default_rng(15)
    for _ in range(5):
        qp = random_program(rng, problem, error_m=100.0)
        solution = solver.solve(qp, _guess(problem))
        assert solution.status is SolveStatus.CONVERGED
        assert optimality(qp, solution.inputs) < 1e-5


def test_a_bound_that_is_active_without_a_multiplier_is_no_trouble(make_solver: MakeSolver) -> None:
    """Bounds moved to where the free minimum lies leave no strict active set; the solution is found all the same."""
    problem = small_problem()
    wide = make_solver(problem, QpOptions())
    qp = random_program(np.random.default_rng(16), problem, error_m=0.3)
    far = np.full_like(qp.lower, 50.0)
    free = wide.solve(dataclasses.replace(qp, lower=-far, upper=far), _guess(problem))
    touching = dataclasses.replace(qp, lower=-far, upper=free.inputs.copy())
    solution = wide.solve(touching, _guess(problem))
    assert solution.status is SolveStatus.CONVERGED
    np.testing.assert_allclose(solution.inputs, free.inputs, atol=1e-6)


def test_numbers_that_are_not_finite_end_in_a_status(make_solver: MakeSolver) -> None:
    """A NaN in the data gives FAILED: no exception, no endless loop."""
    problem = small_problem()
    qp = random_program(np.random.default_rng(17), problem)
    qp.defect[3, 4] = np.nan
    with np.errstate(all="ignore"):
        assert make_solver(problem, QpOptions()).solve(qp, _guess(problem)).status is SolveStatus.FAILED


def test_too_few_iterations_are_admitted(make_solver: MakeSolver) -> None:
    """With three interior-point iterations a saturated program is not solved, and the status says so."""
    problem = small_problem(25, tight=True)
    options = QpOptions(active_set_sweeps=1, interior_iterations=3, polish_sweeps=1)
    solution = make_solver(problem, options).solve(random_program(np.random.default_rng(18), problem), _guess(problem))
    assert solution.status is SolveStatus.FAILED
    assert solution.interior_iterations == 3


def test_the_compiled_solver_refuses_other_weights_than_its_problem_has(library: ctypes.PyDLL) -> None:
    """Rather than solve another program than asked."""
    problem = small_problem()
    solver = CompiledBackend(problem, Workspace(problem), library=library)
    qp = random_program(np.random.default_rng(19), problem)
    with pytest.raises(ValueError, match="weights"):
        solver.solve(dataclasses.replace(qp, input_weights=2.0 * qp.input_weights), _guess(problem))
