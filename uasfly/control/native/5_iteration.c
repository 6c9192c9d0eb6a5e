/* References, warm start and one real-time iteration. */

static double sum_of(const double *values, int count) {
  double sum = 0.0;
  for (int i = 0; i < count; i++) sum += values[i];
  return sum;
}

/* Tilt, thrust and inputs that fly the reference, see references.py. */
int uasfly_references(const problem_t *problem) {
  int nodes = problem->nodes, points = 3 * (nodes + 1);
  double check = sum_of(problem->position, points) + sum_of(problem->velocity, points) +
                 sum_of(problem->acceleration, points) + sum_of(problem->yaw, nodes + 1) +
                 sum_of(problem->force, 3 * nodes) + sum_of(problem->parameters, NP);
  if (!isfinite(check)) return BAD_INPUT;
  double trims[2][3]; /* of this node and the one before */
  for (int k = 0; k <= nodes; k++) {
    double *state = problem->state_reference + k * NX, *trim = trims[k & 1];
    const double *velocity = problem->velocity + 3 * k;
    const double *force = problem->force + 3 * (k < nodes ? k : nodes - 1);
    const double *arguments[6] = {problem->acceleration + 3 * k, velocity, problem->yaw + k,
                                  force, problem->parameters, problem->limits};
    uasfly_trim(arguments, &trim, NONE);
    memcpy(state, problem->position + 3 * k, 3 * sizeof(double));
    memcpy(state + 3, velocity, 3 * sizeof(double));
    memcpy(state + 6, trim, 2 * sizeof(double));
    if (k == 0) continue;
    const double *pair[6] = {trims[(k - 1) & 1], trim, problem->parameters, problem->interval + k - 1,
                             problem->lower, problem->upper};
    double *inputs = problem->input_reference + (k - 1) * NU;
    uasfly_input_reference(pair, &inputs, NONE);
  }
  return CONVERGED;
}

/* The present plan seen from `elapsed` seconds after its start, see grid.Shift. */
static void shift_plan(const problem_t *problem, stage_t *stages, double elapsed) {
  int nodes = problem->nodes, at = 0, from = 0, middle = 0;
  const double *time = problem->time, *interval = problem->interval, end = time[nodes];
  for (int k = 0; k <= nodes; k++) {
    double start = fmin(time[k] + elapsed, end);
    while (at < nodes - 1 && time[at + 1] <= start) at++;
    const double *before = problem->states + at * NX, fraction = (start - time[at]) / interval[at];
    for (int i = 0; i < NX; i++) stages[k].x[i] = before[i] + fraction * (before[NX + i] - before[i]);
    if (k == nodes) break;
    double stop = fmin(time[k + 1] + elapsed, end), covered = 0.0, sum[NU] = {0};
    while (from < nodes - 1 && time[from + 1] <= start) from++;
    for (int j = from; j < nodes && time[j] < stop; j++) {
      double overlap = fmin(stop, time[j + 1]) - fmax(start, time[j]);
      if (overlap <= 0.0) continue;
      covered += overlap;
      for (int i = 0; i < NU; i++) sum[i] += overlap * problem->inputs[j * NU + i];
    }
    for (int i = 0; i < NU; i++)
      stages[k].u[i] = covered > 1e-12 ? sum[i] / covered : problem->inputs[(nodes - 1) * NU + i];
    while (middle < nodes - 1 && time[middle + 1] <= 0.5 * (start + stop)) middle++;
    memcpy(stages[k].active, problem->active + middle * NU, sizeof stages->active);
  }
}

static void keep_plan(const problem_t *problem, stage_t *stages) {
  for (int k = 0; k <= problem->nodes; k++) {
    memcpy(stages[k].x, problem->states + k * NX, sizeof stages->x);
    if (k == problem->nodes) break;
    memcpy(stages[k].u, problem->inputs + k * NU, sizeof stages->u);
    memcpy(stages[k].active, problem->active + k * NU, sizeof stages->active);
  }
}

static void start_from_references(const problem_t *problem, stage_t *stages) {
  for (int k = 0; k <= problem->nodes; k++) {
    memcpy(stages[k].x, problem->state_reference + k * NX, sizeof stages->x);
    if (k == problem->nodes) break;
    memcpy(stages[k].u, problem->input_reference + k * NU, sizeof stages->u);
    memset(stages[k].active, 0, sizeof stages->active);
  }
}

/* Linearises about the stages' x and u, from the true initial state on; returns the largest defect. */
static double linearise(const problem_t *problem, stage_t *stages) {
  double largest = 0.0;
  memcpy(stages[0].x, problem->initial, sizeof stages->x);
  memset(stages[0].dx, 0, sizeof stages->dx);
  for (int k = 0; k < problem->nodes; k++) {
    stage_t *s = &stages[k];
    double yaw_rate = (problem->yaw[k + 1] - problem->yaw[k]) / problem->interval[k];
    const double *arguments[8] = {s->x, s->u, problem->parameters, problem->force + 3 * k,
                                  problem->yaw + k, &yaw_rate, problem->interval + k, s[1].x};
    double *results[2] = {s->defect, s->jacobian};
    uasfly_linearise(arguments, results, NONE);
    for (int i = 0; i < NX; i++) {
      s->q[i] = problem->state_weight[k * NX + i] * (s->x[i] - problem->state_reference[k * NX + i]);
      largest = fmax(largest, fabs(s->defect[i]));
    }
    for (int i = 0; i < NU; i++) {
      s->r[i] = problem->input_weight[k * NU + i] * (s->u[i] - problem->input_reference[k * NU + i]);
      s->lower[i] = problem->lower[i] - s->u[i];
      s->upper[i] = problem->upper[i] - s->u[i];
    }
  }
  stage_t *end = &stages[problem->nodes];
  for (int i = 0, first = problem->nodes * NX; i < NX; i++)
    end->q[i] = problem->state_weight[first + i] * (end->x[i] - problem->state_reference[first + i]);
  return largest;
}

/* One iteration: from the plan shifted by `elapsed` > 0, from the plan as it is (0) or from the references (< 0).
 * The plan changes only when the result is CONVERGED or INEXACT. */
int uasfly_iterate(const problem_t *problem, double elapsed) {
  stage_t *stages = problem->workspace;
  int nodes = problem->nodes;
  double check = elapsed + sum_of(problem->initial, NX) + sum_of(problem->yaw, nodes + 1) +
                 sum_of(problem->parameters, NP) + sum_of(problem->force, 3 * nodes) +
                 sum_of(problem->state_reference, NX * (nodes + 1)) + sum_of(problem->input_reference, NU * nodes);
  if (!isfinite(check)) return BAD_INPUT;
  if (elapsed > 0.0) shift_plan(problem, stages, elapsed);
  else if (elapsed == 0.0) keep_plan(problem, stages);
  else start_from_references(problem, stages);
  problem->figures[2] = linearise(problem, stages);
  int status = solve_quadratic_program(problem, stages, problem->figures);
  if (status == FAILED) return status;
  for (int k = 0; k <= nodes; k++) {
    stage_t *s = &stages[k];
    for (int i = 0; i < NX; i++) problem->states[k * NX + i] = s->x[i] + s->dx[i];
    if (k == nodes) break;
    for (int i = 0; i < NU; i++)
      problem->inputs[k * NU + i] = fmin(fmax(s->u[i] + s->du[i], problem->lower[i]), problem->upper[i]);
    memcpy(problem->active + k * NU, s->active, sizeof s->active);
  }
  return status;
}
