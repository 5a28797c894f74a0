/* The functions of FMI 2.0. What this model has no use for is in stubs.c. */
#include "driveline.h"
#include "fmi2Functions.h"

#include <string.h>

static const int CONTINUOUS[] = {CONTINUOUS_STATES};
#define D ((Driveline *)c)

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

static fmi2Status answer(fmi2Component c, int well) {
    if (!well && D->logger)
        ((fmi2CallbackLogger)D->logger)(D->environment, "driveline", fmi2Error, "error", "no memory for the delay");
    return well ? fmi2OK : fmi2Error;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String where,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging) {
    (void)name, (void)type, (void)where, (void)visible, (void)logging;
    if (strcmp(guid, GUID) != 0) {
        if (functions && functions->logger)
            functions->logger(functions->componentEnvironment, name, fmi2Error, "error",
                              "modelDescription.xml is of another build of this FMU");
        return NULL;
    }
    Driveline *d = driveline_new();
    if (d && functions) d->environment = functions->componentEnvironment, d->logger = (void *)functions->logger;
    return d;
}
void fmi2FreeInstance(fmi2Component c) { driveline_free(c); }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[]) {
    (void)c, (void)on, (void)n, (void)categories;
    return fmi2OK;
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean defined, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean ends, fmi2Real end) {
    (void)defined, (void)tolerance, (void)ends, (void)end;
    D->value[TIME] = start;
    return fmi2OK;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return answer(c, driveline_begin(D)); }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    D->history.count = 0;
    return answer(c, driveline_begin(D));
}
fmi2Status fmi2Terminate(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) { driveline_reset(D); return fmi2OK; }

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real value[]) {
    driveline_update(D);
    for (size_t i = 0; i < n; i++) {
        if (r[i] >= VALUES) return fmi2Error;
        value[i] = D->value[r[i]];
    }
    return fmi2OK;
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Real value[]) {
    for (size_t i = 0; i < n; i++) {
        if (r[i] >= VALUES) return fmi2Error;
        D->value[r[i]] = value[i];
    }
    return fmi2OK;
}
fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Boolean value[]) {
    for (size_t i = 0; i < n; i++) {
        if (r[i] != ANGLE_IS_READ) return fmi2Error;
        value[i] = D->value[r[i]] != 0.0;
    }
    return fmi2OK;
}
fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Boolean value[]) {
    for (size_t i = 0; i < n; i++) {
        if (r[i] != ANGLE_IS_READ) return fmi2Error;
        D->value[r[i]] = value[i] != fmi2False;
    }
    return fmi2OK;
}

/* co-simulation */

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real now, fmi2Real length, fmi2Boolean no_way_back) {
    (void)no_way_back;
    if (!(length > 0.0)) return fmi2Error;
    D->value[TIME] = now;
    return answer(c, driveline_step(D, length));
}

/* model exchange */

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real now) { D->value[TIME] = now; return fmi2OK; }
fmi2Status fmi2EnterEventMode(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info) {
    memset(info, 0, sizeof *info);
    return answer(c, driveline_remember(D));
}
fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_way_back, fmi2Boolean *event,
                                       fmi2Boolean *terminate) {
    (void)no_way_back;
    *event = *terminate = fmi2False;
    return answer(c, driveline_remember(D));
}
fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n) {
    for (size_t i = 0; i < n && i < CONTINUOUS_COUNT; i++) D->value[STATE + CONTINUOUS[i]] = x[i];
    return n == CONTINUOUS_COUNT ? fmi2OK : fmi2Error;
}
fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n) {
    for (size_t i = 0; i < n && i < CONTINUOUS_COUNT; i++) x[i] = D->value[STATE + CONTINUOUS[i]];
    return n == CONTINUOUS_COUNT ? fmi2OK : fmi2Error;
}
fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real rate[], size_t n) {
    driveline_update(D);
    for (size_t i = 0; i < n && i < CONTINUOUS_COUNT; i++) rate[i] = D->value[DERIVATIVE + CONTINUOUS[i]];
    return n == CONTINUOUS_COUNT ? fmi2OK : fmi2Error;
}
fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real nominal[], size_t n) {
    (void)c;
    for (size_t i = 0; i < n; i++) nominal[i] = 1.0;
    return fmi2OK;
}
fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real indicator[], size_t n) {
    (void)c, (void)indicator;
    return n == 0 ? fmi2OK : fmi2Error;
}
