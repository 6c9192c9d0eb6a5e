/* The quadratic program of one iteration: active set first, interior point and polishing where it does not settle. */

/* The interior point's result as the result of the program. */
static void take_interior(const problem_t *problem, stage_t *stages) {
  for (int k = 0; k < problem->nodes; k++) {
    stage_t *s = &stages[k];
    memcpy(s->active, s->guess, sizeof s->active);
    memcpy(s->du, s->point, sizeof s->du);
    const double *arguments[4] = {s->dx, s->jacobian, s->defect, s->du};
    double *results[1] = {s[1].dx};
    uasfly_rollout(arguments, results, NONE);
  }
}

static int solve_quadratic_program(const problem_t *problem, stage_t *stages, double *figures) {
  int sweeps = 0, status = CONVERGED, nodes = problem->nodes;
  double sum = 0.0;
  interior_t run = {0, 0.0, 0.0, 0.0};
  EACH_INPUT(s) s->du[i] = s->gradient[i] = 0.0; /* where the options leave no sweep */
  if (active_set(problem, stages, problem->active_set_sweeps, &sweeps) > 0) {
    const double tolerances[2] = {problem->early_gap, problem->final_gap};
    int changes = 1;
    run = start_inside(problem, stages);
    for (int i = 0; i < 2 && status != FAILED && changes > 0; i++) {
      status = interior_run(problem, stages, &run, tolerances[i]);
      if (status != FAILED) changes = active_set(problem, stages, problem->polish_sweeps, &sweeps);
    }
    if (changes == 0) status = CONVERGED;
    else if (status != FAILED) take_interior(problem, stages); /* no set stands: a bound with no multiplier, say */
  }
  for (int k = 0; k < nodes; k++) {
    for (int i = 0; i < NX; i++) sum += stages[k + 1].dx[i];
    for (int i = 0; i < NU; i++) sum += stages[k].du[i];
  }
  figures[0] = sweeps;
  figures[1] = run.iterations;
  figures[3] = run.gap;
  return isfinite(sum) ? status : FAILED;
}

/* The solver alone, for comparison with others: data and results as in qp.StageQp and qp.QpSolution. */
int uasfly_solve_qp(const problem_t *problem, const double *jacobian, const double *defect, const double *initial,
                    const double *q, const double *r, const double *lower, const double *upper, signed char *active,
                    double *states, double *inputs) {
  stage_t *stages = problem->workspace;
  int nodes = problem->nodes;
  for (int k = 0; k <= nodes; k++) {
    stage_t *s = &stages[k];
    memcpy(s->q, q + k * NX, sizeof s->q);
    if (k == nodes) break;
    memcpy(s->jacobian, jacobian + k * NJ, sizeof s->jacobian);
    memcpy(s->defect, defect + k * NX, sizeof s->defect);
    memcpy(s->r, r + k * NU, sizeof s->r);
    memcpy(s->lower, lower + k * NU, sizeof s->lower);
    memcpy(s->upper, upper + k * NU, sizeof s->upper);
    memcpy(s->active, active + k * NU, sizeof s->active);
  }
  memcpy(stages[0].dx, initial, sizeof stages[0].dx);
  int status = solve_quadratic_program(problem, stages, problem->figures);
  for (int k = 0; k <= nodes; k++) {
    memcpy(states + k * NX, stages[k].dx, sizeof stages->dx);
    if (k == nodes) break;
    memcpy(inputs + k * NU, stages[k].du, sizeof stages->du);
    memcpy(active + k * NU, stages[k].active, sizeof stages->active);
  }
  return status;
}
