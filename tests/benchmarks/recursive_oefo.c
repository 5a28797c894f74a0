/* The same algorithm as estimator/identification/online/oefo_kernel.py, as one would write it in C: equations (1) to
 * (7) of the paper with na, nb, nk, L and the adaptation gain free, F as U D U^T, masks, guards, status and stability
 * test. Compiled to a shared library; theta, prediction, errors, mask and reason of each sample go to `out`.
 *
 * With -DNA=.. -DNB=.. -DNK=.. -DNL=.. these are constants to the compiler, as somebody would write it for one model.
 * -DPLAIN leaves masks, status and the test of stability out. */
#include <math.h>
#include <stdbool.h>
#include <string.h>

#ifdef NA
enum { MOST = NA + NB };
#define OF(s, name, constant) constant
#define PART static inline __attribute__((always_inline))
#else
enum { MOST = 32 };
#define NA 0
#define NB 0
#define NK 0
#define NL 0
#define OF(s, name, constant) (s)->name
#define PART static
#endif
#ifdef PLAIN
enum { GUARDED = 0 };
#else
enum { GUARDED = 1 };
#endif
static const double LARGEST = 1e30, RUNAWAY = 1e3, SETTLING = 10.0, LEARNT = 0.1;
enum reason { NONE, TOO_FEW_SAMPLES, NOT_EXCITED, UNSTABLE, CONSTANT_OUTPUT };

struct oefo {
    int na, nb, nk, start_up, n_l, adapts;
    double initial_gain, lambda1, lambda0, trace, alpha;
    bool holds, begun, torque_moves, output_moves;
    double used, peak, held, last_output;
    double theta[MOST], U[MOST][MOST], D[MOST], diag[MOST], L[MOST]; /* row j of U is its column j */
    double y_hat[MOST], y_hat_f[MOST], u[MOST], u_f[MOST];
};

PART void push(double *row, int depth, double value)
{
    memmove(row + 1, row, (depth - 1) * sizeof *row);
    row[0] = value;
}

PART double filtered(const struct oefo *s, double value, const double *row)
{
    for (int i = 1; i < OF(s, n_l, NL); i++)
        value -= s->L[i] * row[i - 1];
    return value;
}

PART void regressor(const struct oefo *s, const double *outputs, const double *inputs, double *restrict phi)
{
    for (int i = 0; i < OF(s, na, NA); i++)
        phi[i] = -outputs[i];
    for (int j = 0; j < OF(s, nb, NB); j++)
        phi[OF(s, na, NA) + j] = inputs[OF(s, nk, NK) + j];
}

PART double dot(const double *a, const double *b, int n)
{
    double total = 0.0;
    for (int i = 0; i < n; i++)
        total += a[i] * b[i];
    return total;
}

/* Takes Phi into F; g becomes F Phi of the F before. Returns Phi^T F Phi. */
PART double learn(struct oefo *s, int n, const double *restrict Phi, double *restrict g)
{
    double f[MOST], total = 0.0, trace = 0.0;
    for (int j = 0; j < n; j++) {
        f[j] = Phi[j];
        for (int i = 0; i < j; i++)
            f[j] += s->U[j][i] * Phi[i];
    }
    memset(g, 0, n * sizeof *g);
    double before = s->holds ? s->alpha : s->lambda1, weight = 1.0 / before;
    for (int j = 0; j < n; j++) {
        double v = s->D[j] * f[j], after = before + f[j] * v, share = f[j] * weight;
        double *restrict u = s->U[j];
        total += f[j] * v;
        weight = 1.0 / after;
        s->D[j] *= before * weight;
        for (int i = 0; i <= j; i++) {
            double u_ij = u[i];
            u[i] = u_ij - g[i] * share;
            g[i] += u_ij * v;
        }
        before = after;
    }
    memset(s->diag, 0, n * sizeof *s->diag);
    for (int j = 0; j < n; j++)
        for (int i = 0; i <= j; i++)
            s->diag[i] += s->U[j][i] * s->U[j][i] * s->D[j];
    for (int i = 0; i < n; i++)
        trace += s->diag[i];
    double scale = 1.0;
    if (s->holds)
        scale = s->trace / trace;
    else if (trace <= s->lambda1 * s->initial_gain * n)
        scale = 1.0 / s->lambda1;
    for (int i = 0; i < n; i++) {
        s->D[i] *= scale;
        s->diag[i] *= scale;
    }
    s->lambda1 = s->lambda0 * s->lambda1 + 1.0 - s->lambda0;
    if (trace * scale <= s->trace)
        s->holds = true;
    return total;
}

PART bool is_stable(const double *a, int n)
{
    double c[MOST];
    memcpy(c, a, n * sizeof *c);
    for (int m = n; m > 0; m--) {
        double k = c[m - 1];
        if (!(fabs(k) < 1.0))
            return false;
        double weight = 1.0 / (1.0 - k * k);
        for (int i = 0; i < m / 2; i++) {
            double low = c[i], high = c[m - 2 - i];
            c[i] = (low - k * high) * weight;
            c[m - 2 - i] = (high - k * low) * weight;
        }
    }
    return true;
}

PART enum reason verdict(const struct oefo *s, int n, bool stable)
{
    if (s->used < SETTLING * n)
        return TOO_FEW_SAMPLES;
    if (!s->torque_moves)
        return NOT_EXCITED;
    if (!s->output_moves)
        return CONSTANT_OUTPUT;
    for (int i = 0; i < n; i++)
        if (!(s->diag[i] < LEARNT * s->initial_gain))
            return NOT_EXCITED;
    return stable ? NONE : UNSTABLE;
}

PART void step(struct oefo *s, int depth, double u, double y, bool okay, double *out)
{
    const int n = OF(s, na, NA) + OF(s, nb, NB);
    double phi[MOST], Phi[MOST], g[MOST], e_prior = 0.0, e_post = 0.0;
    if (fabs(u) <= LARGEST) {
        if (s->begun && u != s->u[0])
            s->torque_moves = true;
        s->begun = true;
        s->held = fmax(s->held - 1.0, 0.0);
    } else {
        u = s->u[0];
        s->held = OF(s, nk, NK) + OF(s, nb, NB);
    }
    push(s->u, depth, u);
    push(s->u_f, depth, filtered(s, u, s->u_f));
    regressor(s, s->y_hat, s->u, phi);
    if (s->used < s->start_up)
        memcpy(Phi, phi, sizeof Phi);
    else
        regressor(s, s->y_hat_f, s->u_f, Phi);
    double y_hat = dot(s->theta, phi, n);
    const bool used = !GUARDED || (okay && fabs(y) <= LARGEST && s->held == 0.0);
    if (used) {
        e_prior = y - y_hat;
        e_post = e_prior / (1.0 + learn(s, n, Phi, g));
        for (int i = 0; i < n; i++)
            s->theta[i] += g[i] * e_post;
        if (s->used > 0.0 && y != s->last_output)
            s->output_moves = true;
        s->last_output = y;
        s->used += 1.0;
        s->peak = fmax(s->peak, fabs(y));
        y_hat = dot(s->theta, phi, n);
    }
    if (!(fabs(y_hat) <= RUNAWAY * s->peak))
        y_hat = used ? y : 0.0;
    const bool stable = !GUARDED || is_stable(s->theta, OF(s, na, NA));
    if (stable && s->adapts)
        memcpy(s->L + 1, s->theta, OF(s, na, NA) * sizeof *s->L);
    push(s->y_hat, depth, y_hat);
    push(s->y_hat_f, depth, filtered(s, y_hat, s->y_hat_f));
    memcpy(out, s->theta, n * sizeof *out);
    out[n] = y_hat;
    out[n + 1] = e_prior;
    out[n + 2] = e_post;
    out[n + 3] = used;
    out[n + 4] = GUARDED ? verdict(s, n, stable) : NONE;
}

/* Runs a block from the start. law: initial gain, lambda1, lambda0, trace, alpha. out: a row of n + 5 per sample.
 * Returns 0, or 1 if the orders are beyond what there is room for. */
int oefo_run(int na, int nb, int nk, int start_up, const double *L, int n_l, const double *law, const double *u,
             const double *y, const unsigned char *okay, long count, double *out)
{
    const int n = na + nb, depth = fmax(fmax(na, nk + nb), n_l);
    if (n > MOST || depth > MOST)
        return 1;
    const int rows = NA > 0 ? (NA > NL ? NA : NL) > NK + NB ? (NA > NL ? NA : NL) : NK + NB : depth; /* constant, if fixed */
    struct oefo s = {.na = na, .nb = nb, .nk = nk, .start_up = start_up, .n_l = n_l, .initial_gain = law[0],
                     .lambda1 = law[1], .lambda0 = law[2], .trace = law[3], .alpha = law[4]};
    memcpy(s.L, L, n_l * sizeof *L);
    for (int i = 0; i < n; i++) {
        s.U[i][i] = 1.0;
        s.D[i] = s.diag[i] = s.initial_gain;
    }
    for (long t = 0; t < count; t++)
        step(&s, rows, u[t], y[t], okay[t] != 0, out + t * (n + 5));
    return 0;
}
