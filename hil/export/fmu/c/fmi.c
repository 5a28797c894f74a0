/* The functions of FMI, first those that are alike in its versions. What this model has no use for is in stubs.c. */
#include "driveline.h"
#include "fmiXFunctions.h"

#include <string.h>

#define D ((Driveline *)c)

typedef TYPE_OF_INSTANCE Instance;
typedef TYPE_OF_REAL Real;

static fmiXStatus answer(Instance c, int well);

void fmiXFreeInstance(Instance c) { driveline_free(c); }
fmiXStatus fmiXSetDebugLogging(Instance c, fmiXBoolean on, size_t n, const fmiXString categories[]) {
    (void)c, (void)on, (void)n, (void)categories;
    return fmiXOK;
}
fmiXStatus fmiXExitInitializationMode(Instance c) {
    D->history.count = 0;
    return answer(c, driveline_begin(D));
}
fmiXStatus fmiXEnterEventMode(Instance c) { (void)c; return fmiXOK; }
fmiXStatus fmiXTerminate(Instance c) { (void)c; return fmiXOK; }
fmiXStatus fmiXReset(Instance c) { driveline_reset(D); return fmiXOK; }

static fmiXStatus get_reals(Driveline *d, const fmiXValueReference r[], size_t n, Real value[]) {
    driveline_update(d);
    for (size_t i = 0; i < n; i++) {
        if (r[i] >= VALUES) return fmiXError;
        value[i] = d->value[r[i]];
    }
    return fmiXOK;
}
static fmiXStatus set_reals(Driveline *d, const fmiXValueReference r[], size_t n, const Real value[]) {
    for (size_t i = 0; i < n; i++) {
        if (r[i] >= VALUES) return fmiXError;
        d->value[r[i]] = value[i];
    }
    return fmiXOK;
}
static fmiXStatus get_booleans(Driveline *d, const fmiXValueReference r[], size_t n, fmiXBoolean value[]) {
    for (size_t i = 0; i < n; i++) {
        if (r[i] != ANGLE_IS_READ) return fmiXError;
        value[i] = d->value[r[i]] != 0.0;
    }
    return fmiXOK;
}
static fmiXStatus set_booleans(Driveline *d, const fmiXValueReference r[], size_t n, const fmiXBoolean value[]) {
    for (size_t i = 0; i < n; i++) {
        if (r[i] != ANGLE_IS_READ) return fmiXError;
        d->value[r[i]] = value[i] != fmiXFalse;
    }
    return fmiXOK;
}

