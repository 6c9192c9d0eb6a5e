/* Mehrotra's predictor-corrector on the bounds of the inputs; the iterate stays strictly inside them.
 * The sweeps satisfy the dynamics exactly, so only the bounds have slacks and multipliers. */

#define SHORT_STEP 0.1    /* a corrected step below this is tried again with plain centring */
#define TO_BOUNDARY 0.995 /* share of the way to the boundary */
#define START_MARGIN 0.1  /* share of the range that the first point keeps from its bounds */

#define EACH_INPUT(s) \
  for (stage_t *s = stages; s < stages + problem->nodes; s++) \
    for (int i = 0; i < NU; i++)

/* A run that can be continued to a smaller gap; its iterate is in the stages (point, low, high, z_lower, z_upper). */
typedef struct {
  int iterations;
  double scale;    /* mean of weight times range squared */
  double gap;      /* mean complementarity, relative to scale */
  double residual; /* what is left of the first dual residual, as a share */
} interior_t;

/* Starts from what the active set came to last: its inputs moved inside, its gradients as multipliers. */
static interior_t start_inside(const problem_t *problem, stage_t *stages) {
  double count = 2.0 * problem->nodes * NU, total = 0.0;
  interior_t run = {0, 0.0, 0.0, 1.0};
  EACH_INPUT(s) {
    double range = s->upper[i] - s->lower[i], margin = START_MARGIN * range;
    double size = problem->input_weight[(s - stages) * NU + i] * range * range;
    s->point[i] = fmin(fmax(s->du[i], s->lower[i] + margin), s->upper[i] - margin);
    /* Slacks are kept, not computed from the point: near a bound the difference would lose all its digits. */
    s->low[i] = s->point[i] - s->lower[i];
    s->high[i] = s->upper[i] - s->point[i];
    s->z_lower[i] = problem->start_barrier * size / s->low[i] + fmax(s->gradient[i], 0.0);
    s->z_upper[i] = problem->start_barrier * size / s->high[i] + fmax(-s->gradient[i], 0.0);
    total += s->low[i] * s->z_lower[i] + s->high[i] * s->z_upper[i];
    run.scale += 2.0 * size / count;
  }
  run.gap = total / count / run.scale;
  return run;
}

/* Changes of the multipliers for the step in s->step; returns the longest step, at most 1, that turns nothing negative. */
static double direction(const problem_t *problem, stage_t *stages, double target, double share) {
  double shrink = -1.0; /* most negative relative change */
  EACH_INPUT(s) {
    double over_low = 1.0 / s->low[i], over_high = 1.0 / s->high[i], step = s->step[i];
    double z_lower = s->z_lower[i], z_upper = s->z_upper[i];
    s->dz_lower[i] = (target - share * s->second_lower[i]) * over_low - z_lower - z_lower * over_low * step;
    s->dz_upper[i] = (target + share * s->second_upper[i]) * over_high - z_upper + z_upper * over_high * step;
    shrink = fmin(fmin(shrink, step * over_low), -step * over_high);
    shrink = fmin(fmin(shrink, s->dz_lower[i] / z_lower), s->dz_upper[i] / z_upper);
  }
  return -1.0 / shrink;
}

static void barrier_forward(const problem_t *problem, stage_t *stages) {
  for (int k = 0; k < problem->nodes; k++) {
    stage_t *s = &stages[k];
    const double *arguments[5] = {s->dx, s->jacobian, s->defect, s->K, s->k};
    double *results[2] = {s[1].dx, s->du};
    uasfly_barrier_forward(arguments, results, NONE);
    for (int i = 0; i < NU; i++) s->step[i] = s->du[i] - s->point[i];
  }
}

/* Step without centring; leaves the factors behind. */
static void predict(const problem_t *problem, stage_t *stages) {
  terminal_cost(problem, &stages[problem->nodes]);
  for (int k = problem->nodes - 1; k >= 0; k--) {
    stage_t *s = &stages[k], *after = s + 1;
    for (int i = 0; i < NU; i++) {
      double barrier = s->z_lower[i] / s->low[i] + s->z_upper[i] / s->high[i];
      s->R[i] = problem->input_weight[k * NU + i] + barrier;
      s->right[i] = s->r[i] - barrier * s->point[i];
    }
    const double *arguments[8] = {after->P, after->p, s->jacobian, s->defect, s->q, s->right,
                                  problem->state_weight + k * NX, s->R};
    double *results[6] = {s->P, s->p, s->K, s->k, s->factor, s->Pc};
    uasfly_barrier_backward(arguments, results, NONE);
  }
  barrier_forward(problem, stages);
}

/* Step towards complementarity `target`, with the same factors. */
static void correct(const problem_t *problem, stage_t *stages, double target, double share) {
  memcpy(stages[problem->nodes].p, stages[problem->nodes].q, sizeof stages->p);
  for (int k = problem->nodes - 1; k >= 0; k--) {
    stage_t *s = &stages[k], *after = s + 1;
    double right[NU];
    for (int i = 0; i < NU; i++)
      right[i] = s->right[i] - (target - share * s->second_lower[i]) / s->low[i] +
                 (target + share * s->second_upper[i]) / s->high[i];
    const double *arguments[7] = {after->p, s->jacobian, s->Pc, s->q, right, s->K, s->factor};
    double *results[2] = {s->p, s->k};
    uasfly_barrier_vector(arguments, results, NONE);
  }
  barrier_forward(problem, stages);
}

static void interior_iteration(const problem_t *problem, stage_t *stages, interior_t *run) {
  double count = 2.0 * problem->nodes * NU, gap = run->gap * run->scale, products = 0.0, length = 0.0, total = 0.0;
  EACH_INPUT(s) s->second_lower[i] = s->second_upper[i] = 0.0;
  predict(problem, stages);
  double affine = direction(problem, stages, 0.0, 0.0);
  EACH_INPUT(s) {
    double step = affine * s->step[i];
    products += (s->low[i] + step) * (s->z_lower[i] + affine * s->dz_lower[i]);
    products += (s->high[i] - step) * (s->z_upper[i] + affine * s->dz_upper[i]);
    s->second_lower[i] = s->step[i] * s->dz_lower[i];
    s->second_upper[i] = s->step[i] * s->dz_upper[i];
  }
  double ratio = products / count / gap, centring = ratio * ratio * ratio;
  /* Second-order terms scaled by the affine step, or it stalls; where they still block, plain centring. */
  for (int attempt = 0; attempt < 2 && !(length > SHORT_STEP); attempt++) {
    double share = attempt == 0 ? affine * affine : 0.0;
    double target = (attempt == 0 ? centring : fmax(centring, 0.3)) * gap;
    correct(problem, stages, target, share);
    length = direction(problem, stages, target, share);
  }
  if (length < 1.0) length *= TO_BOUNDARY;
  EACH_INPUT(s) {
    s->point[i] += length * s->step[i];
    s->low[i] += length * s->step[i];
    s->high[i] -= length * s->step[i];
    s->z_lower[i] += length * s->dz_lower[i];
    s->z_upper[i] += length * s->dz_upper[i];
    total += s->low[i] * s->z_lower[i] + s->high[i] * s->z_upper[i];
  }
  run->iterations++;
  run->gap = total / count / run->scale;
  run->residual *= 1.0 - length;
}

/* Iterates until gap and residual are below `tolerance`; leaves its guess of the active set in the stages. */
static int interior_run(const problem_t *problem, stage_t *stages, interior_t *run, double tolerance) {
  int status = CONVERGED;
  while (!(run->gap < tolerance && run->residual < tolerance)) {
    if (run->iterations >= problem->interior_iterations || !isfinite(run->gap)) {
      status = run->gap < problem->loose_gap && run->residual < problem->loose_gap ? INEXACT : FAILED;
      break;
    }
    interior_iteration(problem, stages, run);
  }
  EACH_INPUT(s) {
    double weight = problem->input_weight[(s - stages) * NU + i];
    int at_lower = s->z_lower[i] > s->low[i] * weight, at_upper = s->z_upper[i] > s->high[i] * weight;
    s->active[i] = s->guess[i] = (signed char)(at_upper - at_lower);
  }
  return status;
}
