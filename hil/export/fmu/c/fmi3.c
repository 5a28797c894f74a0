/* The functions of FMI 3.0. What this model has no use for is in stubs.c. */
#include "driveline.h"
#include "fmi3Functions.h"

#include <string.h>

static const int CONTINUOUS[] = {CONTINUOUS_STATES};
#define D ((Driveline *)c)

const char *fmi3GetVersion(void) { return fmi3Version; }

static fmi3Status answer(fmi3Instance c, int well) {
    if (!well && D->logger)
        ((fmi3LogMessageCallback)D->logger)(D->environment, fmi3Error, "error", "no memory for the delay");
    return well ? fmi3OK : fmi3Error;
}

static fmi3Instance instance(fmi3String token, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log) {
    if (strcmp(token, GUID) != 0) {
        if (log) log(environment, fmi3Error, "error", "modelDescription.xml is of another build of this FMU");
        return NULL;
    }
    Driveline *d = driveline_new();
    if (d) d->environment = environment, d->logger = (void *)log;
    return d;
}
fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String where, fmi3Boolean visible,
                                          fmi3Boolean logging, fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log) {
    (void)name, (void)where, (void)visible, (void)logging;
    return instance(token, environment, log);
}
fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String where, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early,
                                         const fmi3ValueReference required[], size_t n,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback between) {
    (void)name, (void)where, (void)visible, (void)logging, (void)events, (void)early, (void)required, (void)n;
    (void)between;
    return instance(token, environment, log);
}
void fmi3FreeInstance(fmi3Instance c) { driveline_free(c); }
fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String categories[]) {
    (void)c, (void)on, (void)n, (void)categories;
    return fmi3OK;
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean defined, fmi3Float64 tolerance, fmi3Float64 start,
                                       fmi3Boolean ends, fmi3Float64 end) {
    (void)defined, (void)tolerance, (void)ends, (void)end;
    D->value[TIME] = start;
    return answer(c, driveline_begin(D));
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) {
    D->history.count = 0;
    return answer(c, driveline_begin(D));
}
fmi3Status fmi3EnterEventMode(fmi3Instance c) { (void)c; return fmi3OK; }
fmi3Status fmi3Terminate(fmi3Instance c) { (void)c; return fmi3OK; }
fmi3Status fmi3Reset(fmi3Instance c) { driveline_reset(D); return fmi3OK; }

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Float64 value[], size_t count) {
    if (n != count) return fmi3Error;
    driveline_update(D);
    for (size_t i = 0; i < n; i++) {
        if (r[i] >= VALUES) return fmi3Error;
        value[i] = D->value[r[i]];
    }
    return fmi3OK;
}
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3Float64 value[],
                          size_t count) {
    if (n != count) return fmi3Error;
    for (size_t i = 0; i < n; i++) {
        if (r[i] >= VALUES) return fmi3Error;
        D->value[r[i]] = value[i];
    }
    return fmi3OK;
}
fmi3Status fmi3GetBoolean(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Boolean value[], size_t count) {
    if (n != count) return fmi3Error;
    for (size_t i = 0; i < n; i++) {
        if (r[i] != ANGLE_IS_READ) return fmi3Error;
        value[i] = D->value[r[i]] != 0.0;
    }
    return fmi3OK;
}
fmi3Status fmi3SetBoolean(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3Boolean value[],
                          size_t count) {
    if (n != count) return fmi3Error;
    for (size_t i = 0; i < n; i++) {
        if (r[i] != ANGLE_IS_READ) return fmi3Error;
        D->value[r[i]] = value[i];
    }
    return fmi3OK;
}

/* co-simulation */

fmi3Status fmi3EnterStepMode(fmi3Instance c) { (void)c; return fmi3OK; }
fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 now, fmi3Float64 length, fmi3Boolean no_way_back,
                      fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last) {
    (void)no_way_back;
    *event = *terminate = *early = fmi3False;
    *last = now + length;
    if (!(length > 0.0)) return fmi3Error;
    D->value[TIME] = now;
    return answer(c, driveline_step(D, length));
}

/* model exchange */

fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 now) { D->value[TIME] = now; return fmi3OK; }
fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate, fmi3Boolean *nominals,
                                    fmi3Boolean *values, fmi3Boolean *next_defined, fmi3Float64 *next) {
    *again = *terminate = *nominals = *values = *next_defined = fmi3False;
    *next = 0.0;
    return answer(c, driveline_remember(D));
}
fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c) { (void)c; return fmi3OK; }
fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean no_way_back, fmi3Boolean *event,
                                       fmi3Boolean *terminate) {
    (void)no_way_back;
    *event = *terminate = fmi3False;
    return answer(c, driveline_remember(D));
}
fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 x[], size_t n) {
    for (size_t i = 0; i < n && i < CONTINUOUS_COUNT; i++) D->value[STATE + CONTINUOUS[i]] = x[i];
    return n == CONTINUOUS_COUNT ? fmi3OK : fmi3Error;
}
fmi3Status fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n) {
    for (size_t i = 0; i < n && i < CONTINUOUS_COUNT; i++) x[i] = D->value[STATE + CONTINUOUS[i]];
    return n == CONTINUOUS_COUNT ? fmi3OK : fmi3Error;
}
fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 rate[], size_t n) {
    driveline_update(D);
    for (size_t i = 0; i < n && i < CONTINUOUS_COUNT; i++) rate[i] = D->value[DERIVATIVE + CONTINUOUS[i]];
    return n == CONTINUOUS_COUNT ? fmi3OK : fmi3Error;
}
fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance c, fmi3Float64 nominal[], size_t n) {
    (void)c;
    for (size_t i = 0; i < n; i++) nominal[i] = 1.0;
    return fmi3OK;
}
fmi3Status fmi3GetEventIndicators(fmi3Instance c, fmi3Float64 indicator[], size_t n) {
    (void)c, (void)indicator;
    return n == 0 ? fmi3OK : fmi3Error;
}
fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *n) { (void)c; *n = 0; return fmi3OK; }
fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *n) {
    (void)c;
    *n = CONTINUOUS_COUNT;
    return fmi3OK;
}
