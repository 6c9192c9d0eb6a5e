/* Primal-dual active set: guess which inputs are held at a bound, sweep, correct the guess until it stands. */

#define MANY 0.25 /* changes a stage; where more than so many do not become fewer, the guess is no good */

static void hold(stage_t *stage, int i) {
  signed char side = stage->active[i];
  stage->free[i] = side == 0;
  stage->fixed[i] = side < 0 ? stage->lower[i] : side > 0 ? stage->upper[i] : 0.0;
}

static int any_held(const stage_t *stage) {
  for (int i = 0; i < NU; i++)
    if (stage->active[i]) return 1;
  return 0;
}

/* The backward part may start at the last stage whose held inputs changed: behind it the cost to go is what it was.
 * Stages that hold no input take the functions of the barrier sweeps, which are cheaper. */
static void active_set_sweep(const problem_t *problem, stage_t *stages, int last) {
  int nodes = problem->nodes;
  for (int k = last; k >= 0; k--) {
    stage_t *s = &stages[k], *after = s + 1;
    const double *arguments[10] = {after->P, after->p, s->jacobian, s->defect, s->q, s->r,
                                   problem->state_weight + k * NX, problem->input_weight + k * NU, s->free, s->fixed};
    double *held[7] = {s->P, s->p, s->K, s->k, s->Hux, s->Huu, s->hu}, *free[6] = {s->P, s->p, s->K, s->k, s->factor, s->Pc};
    if (any_held(s)) uasfly_backward(arguments, held, NONE);
    else uasfly_barrier_backward(arguments, free, NONE);
  }
  for (int k = 0; k < nodes; k++) {
    stage_t *s = &stages[k];
    const double *arguments[9] = {s->dx, s->jacobian, s->defect, s->K, s->k, s->Hux, s->Huu, s->hu, s->fixed};
    double *results[3] = {s[1].dx, s->du, s->gradient};
    if (any_held(s)) {
      uasfly_forward(arguments, results, NONE);
    } else {
      uasfly_barrier_forward(arguments, results, NONE);
      memset(s->gradient, 0, sizeof s->gradient); /* at the minimum */
    }
  }
}

/* Returns how many inputs still changed sides in the last sweep: 0 when the set stands and the result is exact. */
static int active_set(const problem_t *problem, stage_t *stages, int most, int *sweeps) {
  int nodes = problem->nodes, changes = 1, before = NU * nodes + 1, last = nodes - 1;
  double tolerance = problem->bound_tolerance;
  for (int k = 0; k < nodes; k++)
    for (int i = 0; i < NU; i++) hold(&stages[k], i);
  terminal_cost(problem, &stages[nodes]);
  for (int sweep = 1; sweep <= most; sweep++) {
    active_set_sweep(problem, stages, last);
    ++*sweeps;
    changes = 0;
    for (int k = 0; k < nodes; k++) {
      stage_t *s = &stages[k];
      for (int i = 0; i < NU; i++) {
        signed char side = s->active[i];
        if (side == 0) {
          if (s->du[i] < s->lower[i] - tolerance) side = -1;
          if (s->du[i] > s->upper[i] + tolerance) side = 1;
        } else if (side * s->gradient[i] > tolerance) { /* the cost falls towards the inside: let go */
          side = 0;
        }
        if (side != s->active[i]) {
          s->active[i] = side;
          hold(s, i);
          changes++;
          last = k;
        }
      }
    }
    if (changes == 0 || (changes >= before && changes > MANY * nodes)) break;
    before = changes;
  }
  return changes;
}
