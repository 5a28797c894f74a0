
/* what FMI 2.0 has in a form of its own */

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

static fmi2Status answer(Instance c, int well) {
    if (!well && D->logger)
        ((fmi2CallbackLogger)D->logger)(D->environment, "driveline", fmi2Error, "error", "no memory for the delay");
    return well ? fmi2OK : fmi2Error;
}

Instance fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String where,
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

fmi2Status fmi2SetupExperiment(Instance c, fmi2Boolean defined, Real tolerance, Real start,
                               fmi2Boolean ends, Real end) {
    (void)defined, (void)tolerance, (void)ends, (void)end;
    D->value[TIME] = start;
    return fmi2OK;
}
fmi2Status fmi2EnterInitializationMode(Instance c) { return answer(c, driveline_begin(D)); }

fmi2Status fmi2GetReal(Instance c, const fmi2ValueReference r[], size_t n, Real value[]) {
    return get_reals(D, r, n, value);
}
fmi2Status fmi2SetReal(Instance c, const fmi2ValueReference r[], size_t n, const Real value[]) {
    return set_reals(D, r, n, value);
}
fmi2Status fmi2GetBoolean(Instance c, const fmi2ValueReference r[], size_t n, fmi2Boolean value[]) {
    return get_booleans(D, r, n, value);
}
fmi2Status fmi2SetBoolean(Instance c, const fmi2ValueReference r[], size_t n, const fmi2Boolean value[]) {
    return set_booleans(D, r, n, value);
}

/* co-simulation */

fmi2Status fmi2DoStep(Instance c, Real now, Real length, fmi2Boolean no_way_back) {
    (void)no_way_back;
    if (!(length > 0.0)) return fmi2Error;
    D->value[TIME] = now;
    return answer(c, driveline_step(D, length));
}
