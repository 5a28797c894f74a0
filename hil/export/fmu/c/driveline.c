/* The line between torque and recorded speed, for steps of a simulation (co-simulation) and as derivatives (model
   exchange). The laws are in laws.h, translated from those of hil; here they are put together as there. */
#include "driveline.h"

#include <stdlib.h>
#include <string.h>

#include "laws.h"

static const double START[VALUES] = {START_VALUES};

static Array parameters(Driveline *d) { return (Array){d->value + PARAMETER, PARAMETERS}; }

static State state(const Driveline *d) {
    State x;
    memcpy(&x, d->value + STATE, sizeof x);
    return x;
}

static Line line(Driveline *d) {
    int elastic = MASSES == 1 || conditions_is_elastic(parameters(d));
    return (Line){MASSES, elastic, conditions_is_extended(parameters(d))};
}

/* ---- a torque's past, which a delay reads ---- */

static int remember(History *past, double time_s, double torque, double oldest_s) {
    size_t gone = 0;
    if (past->count + 1 > past->room) {
        size_t room = 2 * past->room + 64;
        double *times = realloc(past->time_s, room * sizeof(double));
        if (times) past->time_s = times;
        double *torques = realloc(past->torque, room * sizeof(double));
        if (torques) past->torque = torques;
        if (!times || !torques) return 0;
        past->room = room;
    }
    while (gone + 2 < past->count && past->time_s[gone + 1] < oldest_s) gone++;
    if (2 * gone > past->count) { /* not at every step: each time half of them are moved */
        past->count -= gone;
        memmove(past->time_s, past->time_s + gone, past->count * sizeof(double));
        memmove(past->torque, past->torque + gone, past->count * sizeof(double));
    }
    past->time_s[past->count] = time_s;
    past->torque[past->count++] = torque;
    return 1;
}

static double between(const History *past, size_t i, double time_s) {
    double length = past->time_s[i + 1] - past->time_s[i];
    double share = length > 0.0 ? (time_s - past->time_s[i]) / length : 1.0;
    return past->torque[i] + share * (past->torque[i + 1] - past->torque[i]);
}

static double remembered(const History *past, double before, double time_s) {
    size_t i = past->count;
    if (i == 0 || time_s < past->time_s[0]) return before;
    if (time_s >= past->time_s[i - 1]) return past->torque[i - 1];
    while (past->time_s[i - 1] > time_s) i--;
    return between(past, i - 1, time_s);
}

/* Mean and first moment over [begin, end]: the straight line that has both. */
static void passed(const History *past, double before, double begin, double end, double *mean, double *rise) {
    double length = end - begin, middle = 0.5 * (begin + end), sum = 0.0, moment = 0.0;
    double first = past->count ? past->time_s[0] : end;
    if (begin < first) {
        double last = first < end ? first : end;
        sum += before * (last - begin);
        moment += before * (last - begin) * (0.5 * (begin + last) - middle);
    }
    for (size_t i = past->count; i-- > 0;) {
        double from = past->time_s[i] > begin ? past->time_s[i] : begin;
        double next = i + 1 < past->count ? past->time_s[i + 1] : end;
        double to = next < end ? next : end;
        if (to > from) {
            double at = i + 1 < past->count ? between(past, i, from) : past->torque[i];
            double then = i + 1 < past->count ? between(past, i, to) : past->torque[i];
            sum += 0.5 * (at + then) * (to - from);
            moment += (to - from) * (0.5 * (at + then) * (0.5 * (from + to) - middle) + (then - at) * (to - from) / 12.0);
        }
        if (past->time_s[i] <= begin) break;
    }
    *mean = sum / length;
    *rise = 12.0 * moment / (length * length);
}

/* ---- from the inverters' torques to the one on the shaft ---- */

static double summed(Driveline *d) {
    return laws_torque(d->value[T_M1], d->value[T_M2], d->value[TIME], parameters(d));
}

static double warmth(const Driveline *d) { /* 1: as warm as they get; heated by the torque's losses it is a state */
    const double *p = d->value + PARAMETER;
    double fading = exp(-d->value[TIME] / p[DERATING_TIME]);
    return (p[HEATED] > 0.0 ? d->value[STATE + WARMTH] : 1.0 - fading) + p[WARM] * fading;
}

static double on_shaft(Driveline *d) {
    double depth = d->value[PARAMETER + DEPTH];
    return depth == 0.0 ? summed(d) : summed(d) * (1.0 - depth * warmth(d));
}

static void warm_up(Driveline *d, double length_s) {
    const double *p = d->value + PARAMETER;
    if (p[DEPTH] == 0.0 || p[HEATED] <= 0.0) return;
    double kept = exp(-length_s / p[DERATING_TIME]), loss = summed(d) / p[HEATED];
    d->value[STATE + WARMTH] = kept * d->value[STATE + WARMTH] + (1.0 - kept) * loss * loss;
}

static double read_angle(Driveline *d) {
    return d->value[ANGLE_IS_READ] != 0.0 ? d->value[ANGLE_READ]
                                          : sensing_read_angle(d->value[STATE + ANGLE], parameters(d));
}

/* ---- what an importer calls ---- */

void driveline_reset(Driveline *d) {
    memcpy(d->value, START, sizeof START);
    d->history.count = 0;
}

Driveline *driveline_new(void) {
    Driveline *d = calloc(1, sizeof *d);
    if (d) driveline_reset(d);
    return d;
}

void driveline_free(Driveline *d) {
    if (!d) return;
    free(d->history.time_s);
    free(d->history.torque);
    free(d);
}

/* The state at the start: what is not given follows as if it were steady. */
int driveline_begin(Driveline *d) {
    Array x = {d->value + STATE, STATES};
    memset(x.at, 0, STATES * sizeof(double));
    x.at[ANGLE] = d->value[START_ANGLE];
    x.at[SPEED] = d->value[START_SPEED];
    x.at[TWIST] = d->value[START_TWIST];
    x.at[LOAD_SPEED] = d->value[START_LOAD_SPEED];
    x.at[MIDDLE_TWIST] = d->value[START_MIDDLE_TWIST];
    x.at[MIDDLE_SPEED] = d->value[START_MIDDLE_SPEED];
    x.at[TRACTION] = d->value[START_TRACTION];
    double torque = on_shaft(d), angle = d->value[ANGLE_IS_READ] != 0.0 ? d->value[ANGLE_READ] : 0.0;
    inputs_follow(x, torque, angle, parameters(d));
    d->value[BEFORE_ALL] = torque + d->value[PARAMETER + DELAYED_BEFORE];
    return driveline_remember(d);
}

int driveline_remember(Driveline *d) {
    double time_s = d->value[TIME], delay_s = d->value[PARAMETER + DELAY];
    return delay_s == 0.0 || remember(&d->history, time_s, on_shaft(d), time_s - 2.0 * delay_s);
}

static int step_line(Driveline *d, double length_s) {
    Array p = parameters(d);
    Line made = line(d);
    int steps = (int)fmax(1.0, ceil(length_s / d->value[STEP_S] - 1e-6));
    double h = length_s / steps, start_s = d->value[TIME], torque = on_shaft(d), angle = read_angle(d);
    double turn = (d->value[ANGLE_IS_READ] != 0.0 ? d->value[TURN_RATE] : d->value[STATE + SPEED]) * length_s;
    double *rest = d->value + STATE;
    LowPass lag = timing_low_pass(p.at[LAG], p.at[LAG_SHAPE], h);
    LowPass filter = timing_low_pass(p.at[FILTER], p.at[FILTER_SHAPE], h);
    if (!driveline_remember(d)) return 0;
    State x = state(d);
    Bristles held = {rest[BRISTLES_MOTOR], rest[BRISTLES_LOAD]};
    for (int j = 0; j < steps; j++) {
        double at_s = start_s + j * h, middle = angle + turn * (j + 0.5) / steps, mean = torque, rise = 0.0;
        Conditions now = conditions_conditions(MASSES, at_s, h, middle, d->value[T_LOAD], d->value[SIGN_WIDTH], p);
        Conditions felt = now;
        if (p.at[DELAY] != 0.0)
            passed(&d->history, d->value[BEFORE_ALL], at_s - p.at[DELAY], at_s + h - p.at[DELAY], &mean, &rise);
        Several_dddd fed = timing_lag_step(mean, rise, rest[LAGGED], rest[LAG_RISE], lag);
        rest[LAGGED] = fed.item2, rest[LAG_RISE] = fed.item3;
        if (conditions_is_bristled(p)) {
            held = conditions_bent(made, held, x, now, p, 0.5 * h);
            felt = conditions_rubbed(now, held, p);
        }
        State before = x;
        x = rates_stepped(made, felt, fed.item0, fed.item1, x, p, h);
        if (conditions_is_bristled(p)) held = conditions_bent(made, held, x, now, p, 0.5 * h);
        if (p.at[FILTER] > 0.0) {
            double turned = angle + turn * j / steps, turns = angle + turn * (j + 1) / steps;
            Several_dd read = sensing_smoothed(before, x, OUTPUT, turned, turns, rest[FILTERED], rest[FILTER_RISE],
                                               filter, p, h);
            rest[FILTERED] = read.item0, rest[FILTER_RISE] = read.item1;
        }
    }
    memcpy(rest, &x, sizeof x);
    rest[BRISTLES_MOTOR] = held.motor, rest[BRISTLES_LOAD] = held.load;
    d->value[TIME] = start_s + length_s;
    d->value[ANGLE_READ] = angle + turn; /* until the importer says more */
    if (p.at[DELAY] != 0.0 && !remember(&d->history, d->value[TIME], torque, start_s - 2.0 * p.at[DELAY])) return 0;
    warm_up(d, length_s);
    return 1;
}

/* Around another FMU's shaft: what is here moves as that will, and passes on the torque that reaches it. What is passed
   on acts a step later; so begin with the speed of then, and with what else drives the shaft as it changed so far. The
   first speeds may come from before the importer connected the two. */
static int step_around(Driveline *d, double length_s) {
    double *v = d->value, inertia = v[PARAMETER + INERTIA], load = v[T_LOAD];
    double other = v[STEPS_DONE] < 3.0 ? 0.0 : inertia * (v[SPEED_SEEN] - v[SEEN_BEFORE]) / length_s - v[ACTED];
    double change = v[STEPS_DONE] < 4.0 ? 0.0 : other - v[OTHER_BEFORE], then = other + 2.0 * change;
    double begins = v[SPEED_SEEN] + (other + change + v[TORQUE_PASSED]) * length_s / inertia;
    v[STEPS_DONE] += 1.0, v[SEEN_BEFORE] = v[SPEED_SEEN], v[OTHER_BEFORE] = other, v[ACTED] = v[TORQUE_PASSED];
    v[STATE + SPEED] = begins, v[T_LOAD] = load - then;
    int is_well = step_line(d, length_s);
    v[T_LOAD] = load;
    v[TORQUE_PASSED] = inertia * (v[STATE + SPEED] - begins) / length_s - then;
    v[LOAD_PASSED] = -v[TORQUE_PASSED];
    return is_well;
}

int driveline_step(Driveline *d, double length_s) { return AROUND ? step_around(d, length_s) : step_line(d, length_s); }

/* Outputs of the present state. */
void driveline_update(Driveline *d) {
    Array p = parameters(d);
    Line made = line(d);
    State x = state(d);
    double *v = d->value, *rest = v + STATE;
    double time_s = v[TIME], h = v[STEP_S], angle = read_angle(d), torque = on_shaft(d);
    double supplied = p.at[DELAY] == 0.0 ? torque : remembered(&d->history, v[BEFORE_ALL], time_s - p.at[DELAY]);
    double drive = p.at[LAG] >= FASTEST_S ? rest[LAGGED] : supplied;
    Conditions now =
        conditions_conditions(MASSES, time_s - 0.5 * h, h, angle, v[T_LOAD], v[SIGN_WIDTH], p), felt = now;
    Bristles held = {rest[BRISTLES_MOTOR], rest[BRISTLES_LOAD]};
    if (conditions_is_bristled(p)) felt = conditions_rubbed(now, held, p);
    State moving = rates_rates(made, conditions_with_torque(felt, drive), x, p);
    v[SPEED_MEASURED] = sensing_shown(sensing_entry(x, OUTPUT, p), angle, rest[FILTERED], p);
    v[SPEED_MOTOR] = x.speed;
    v[ANGLE_MOTOR] = x.angle;
    v[SPEED_LOAD] = MASSES == 1 ? x.speed : x.load_speed;
    v[TORQUE_SHAFT] = MASSES == 1 ? 0.0 : rates_shaft_torques(made, moving.twist, felt, x, p).item0;
}
