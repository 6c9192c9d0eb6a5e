"""Real-time iteration on both backends."""

from __future__ import annotations

import numpy as np
import pytest

from tests.control.episodes import episodes, load
from tests.control.programs import small_problem
from tests.control.stress import stress
from uasfly.control.grid import Shift
from uasfly.control.iteration import RealTimeIteration, make_backend
from uasfly.control.problem import Problem
from uasfly.control.qp import SolveStatus
from uasfly.control.workspace import Workspace

START = np.array((1.2, 0.3, 0.8, 0.2, -0.1, 0.0, 0.05, -0.1))
FORCE = np.array((0.6, -0.3, 0.2))


def _solved(backend: str, problem: Problem) -> RealTimeIteration:
    rti = RealTimeIteration(problem, backend)
    load(rti, START, 0.4, 0.1, FORCE, 10.0)
    assert rti.solve(10.0) is SolveStatus.CONVERGED
    return rti


@pytest.mark.parametrize("tight", [False, True])
def test_stress_every_step_is_finite_inside_and_converged(backend_name: str, tight: bool) -> None:
    """Random starts far off the path: no step fails, none leaves the bounds."""
    tally = stress(backend_name, tight=tight, nodes=25, count=6 if backend_name == "c" else 2, steps=60, seed=20)
    assert tally.good, tally
    assert tally.saturated / tally.steps > (0.3 if tight else 0.01)


@pytest.mark.parametrize("tight", [False, True])
def test_both_backends_give_the_same_plan(library: object, tight: bool) -> None:
    """Cold starts, shifted plans and saturated ones agree to 1e-7, with a force that changes along the horizon too."""
    problem = small_problem(25, tight=tight)
    c, vm = RealTimeIteration(problem, "c"), RealTimeIteration(problem, "vm")
    names = ("parameters", "force", "yaw", "initial", "position", "velocity", "acceleration")

    def compare() -> None:
        if c.workspace.force.std(axis=0).max() == 0.0:
            c.workspace.force[:] += np.linspace(0.0, 0.3, 25)[:, None]
            c.solve(c.plan_start_s or 0.0)
        for name in names:
            getattr(vm.workspace, name)[:] = getattr(c.workspace, name)
        if c.plan_start_s == 0.0:
            vm.drop_plan()
            c.drop_plan()
            c.solve(0.0)
        else:
            # The virtual machine continues from its own plan; both saw the same history.
            c.plan_start_s, start = vm.plan_start_s, c.plan_start_s
            for name in ("states", "inputs", "active"):
                getattr(c.workspace, name)[:] = getattr(vm.workspace, name)
            c.solve(start or 0.0)
        vm.solve(c.plan_start_s or 0.0)
        np.testing.assert_allclose(c.workspace.state_reference, vm.workspace.state_reference, atol=1e-12)
        np.testing.assert_allclose(c.workspace.input_reference, vm.workspace.input_reference, atol=1e-12)
        np.testing.assert_allclose(c.workspace.inputs, vm.workspace.inputs, atol=1e-7)
        np.testing.assert_allclose(c.workspace.states, vm.workspace.states, atol=1e-7)
        np.testing.assert_array_equal(c.workspace.active, vm.workspace.active)
        assert c.figures.sweeps == vm.figures.sweeps
        assert c.figures.interior_iterations == vm.figures.interior_iterations

    for _ in episodes(c, 2, 25, np.random.default_rng(21), compare):
        pass


@pytest.mark.parametrize("elapsed", [0.004, 0.02, 0.31])
def test_one_warm_iteration_is_as_good_as_many(backend_name: str, elapsed: float) -> None:
    """From the shifted plan, off by what sensors are off, one iteration goes at least 85 % of the way of ten.

    What is left is the price of Gauss-Newton (second derivatives of the dynamics are dropped) half a metre off the
    path; it shrinks by as much again with every sample.
    """
    problem = small_problem(25)
    rti = _solved(backend_name, problem)
    rti.solve(10.0, iterations=10)
    node = np.array([np.interp(elapsed, problem.grid.time_s, column) for column in rti.workspace.states.T])
    noise = np.array((5e-3, -5e-3, 5e-3, 2e-2, -2e-2, 2e-2, 5e-3, -5e-3))
    load(rti, node + noise, 0.4 + 0.1 * elapsed, 0.1, FORCE, 10.0 + elapsed)
    shifted = Shift.after(problem.grid, elapsed).inputs(rti.workspace.inputs)
    assert rti.solve(10.0 + elapsed) is SolveStatus.CONVERGED
    once = rti.workspace.inputs.copy()
    rti.solve(10.0 + elapsed, iterations=10)
    span = problem.input_upper - problem.input_lower
    way, left = (np.abs((inputs - rti.workspace.inputs) / span).max() for inputs in (shifted, once))
    assert left < 0.15 * way
    assert left < 0.003


def test_a_cold_start_iterates_until_the_plan_obeys_the_dynamics(backend_name: str) -> None:
    """After the three iterations of a cold start what is left to correct is small, and the plan starts at the state."""
    rti = _solved(backend_name, small_problem(25))
    np.testing.assert_array_equal(rti.workspace.states[0], START)
    before = rti.workspace.inputs.copy()
    rti.solve(10.0, iterations=10)
    assert np.abs(before - rti.workspace.inputs).max() < 1e-3
    assert rti.figures.largest_defect < 1e-9


@pytest.mark.parametrize("name", ["parameters", "force", "yaw", "initial", "position", "velocity", "acceleration"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_data_that_are_not_finite_touch_nothing(backend_name: str, name: str, value: float) -> None:
    """Each array poisoned in turn: BAD_INPUT, and the plan, its bounds and its time are what they were."""
    rti = _solved(backend_name, small_problem(25))
    work = rti.workspace
    before = [array.copy() for array in (work.states, work.inputs, work.active)]
    getattr(work, name).ravel()[-1] = value
    with np.errstate(invalid="ignore"):
        assert rti.solve(10.02) is SolveStatus.BAD_INPUT
    assert rti.plan_start_s == 10.0
    for array, kept in zip((work.states, work.inputs, work.active), before, strict=True):
        np.testing.assert_array_equal(array, kept)
    load(rti, START, 0.4, 0.1, FORCE, 10.04)
    assert rti.solve(10.04) is SolveStatus.CONVERGED


def test_a_time_that_is_not_finite_is_bad_input(backend_name: str) -> None:
    """The clock is data as well."""
    rti = _solved(backend_name, small_problem(25))
    assert rti.solve(float("nan")) is SolveStatus.BAD_INPUT
    assert rti.plan_start_s == 10.0


def test_an_old_plan_or_one_from_the_future_is_a_cold_start(backend_name: str) -> None:
    """After more than half a second, or when the clock steps back, the result is that of a fresh solver."""
    problem = small_problem(25)
    fresh = _solved(backend_name, problem).workspace.inputs
    for other in (9.0, 10.3):
        rti = RealTimeIteration(problem, backend_name)
        load(rti, -START, 2.0, 0.0, -FORCE, other)
        rti.solve(other)
        load(rti, START, 0.4, 0.1, FORCE, 10.0)
        rti.solve(10.0)
        np.testing.assert_allclose(rti.workspace.inputs, fresh, atol=1e-12)


def test_the_plan_tells_its_inputs_for_a_time(backend_name: str) -> None:
    """Piecewise constant from its start to its end, nothing before, after, or without a plan."""
    rti = _solved(backend_name, small_problem(25))
    times = rti.problem.grid.time_s
    for k in (0, 7, 24):
        planned = rti.planned_inputs(10.0 + 0.5 * (times[k] + times[k + 1]))
        assert planned is not None
        np.testing.assert_array_equal(planned, rti.workspace.inputs[k])
    assert rti.planned_inputs(9.9) is None
    assert rti.planned_inputs(13.1) is None
    rti.drop_plan()
    assert rti.planned_inputs(10.0) is None


def test_on_the_reference_the_plan_is_the_reference(backend_name: str) -> None:
    """Flying where it should, in wind that is known, the plan's cost is next to nothing: no steady offset."""
    rti = RealTimeIteration(small_problem(25), backend_name)
    load(rti, START, 0.4, 0.1, FORCE, 0.0)
    work = rti.workspace
    work.position[:], work.velocity[:], work.acceleration[:] = (1.0, 2.0, 3.0), 0.0, 0.0
    work.yaw[:] = 0.4
    rti.backend.references()
    work.initial[:] = work.state_reference[0]
    assert rti.solve(0.0) is SolveStatus.CONVERGED
    np.testing.assert_allclose(work.states, work.state_reference, atol=1e-6)
    np.testing.assert_allclose(work.inputs, work.input_reference, atol=1e-6)


def test_an_unknown_backend_is_refused() -> None:
    """With the names that there are."""
    problem = small_problem()
    with pytest.raises(ValueError, match='"auto", "c" or "vm"'):
        make_backend(problem, Workspace(problem), "fast")


def test_the_first_input_keeps_to_the_last_command_as_far_as_it_weighs(backend_name: str) -> None:
    """Nothing without a weight, next to no step with a great one; the later inputs are free either way."""
    before = np.array((0.4, 0.1, -0.1))
    steps = []
    for move in (0.0, 20.0, 1e6):
        problem = small_problem(25, move=move)
        rti = RealTimeIteration(problem, backend_name)
        load(rti, START, 0.4, 0.1, FORCE, 10.0)
        assert rti.solve(10.0, iterations=6, before=before) is SolveStatus.CONVERGED
        steps.append(float(np.abs(rti.workspace.inputs[0] - before).max()))
        assert float(np.abs(rti.workspace.inputs[3] - before).max()) > 0.05
    assert steps[0] > steps[1] > steps[2]
    assert steps[2] < 1e-3
