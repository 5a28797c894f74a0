
/* what FMI 3.0 has in a form of its own */

const char *fmi3GetVersion(void) { return fmi3Version; }

static fmi3Status answer(Instance c, int well) {
    if (!well && D->logger)
        ((fmi3LogMessageCallback)D->logger)(D->environment, fmi3Error, "error", "no memory for the delay");
    return well ? fmi3OK : fmi3Error;
}

static Instance instance(fmi3String token, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log) {
    if (strcmp(token, GUID) != 0) {
        if (log) log(environment, fmi3Error, "error", "modelDescription.xml is of another build of this FMU");
        return NULL;
    }
    Driveline *d = driveline_new();
    if (d) d->environment = environment, d->logger = (void *)log;
    return d;
}
Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String where, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early,
                                         const fmi3ValueReference required[], size_t n,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback between) {
    (void)name, (void)where, (void)visible, (void)logging, (void)events, (void)early, (void)required, (void)n;
    (void)between;
    return instance(token, environment, log);
}

fmi3Status fmi3EnterInitializationMode(Instance c, fmi3Boolean defined, Real tolerance, Real start,
                                       fmi3Boolean ends, Real end) {
    (void)defined, (void)tolerance, (void)ends, (void)end;
    D->value[TIME] = start;
    return answer(c, driveline_begin(D));
}

fmi3Status fmi3GetFloat64(Instance c, const fmi3ValueReference r[], size_t n, Real value[], size_t count) {
    return n == count ? get_reals(D, r, n, value) : fmi3Error;
}
fmi3Status fmi3SetFloat64(Instance c, const fmi3ValueReference r[], size_t n, const Real value[],
                          size_t count) {
    return n == count ? set_reals(D, r, n, value) : fmi3Error;
}
fmi3Status fmi3GetBoolean(Instance c, const fmi3ValueReference r[], size_t n, fmi3Boolean value[], size_t count) {
    return n == count ? get_booleans(D, r, n, value) : fmi3Error;
}
fmi3Status fmi3SetBoolean(Instance c, const fmi3ValueReference r[], size_t n, const fmi3Boolean value[],
                          size_t count) {
    return n == count ? set_booleans(D, r, n, value) : fmi3Error;
}

/* co-simulation */

fmi3Status fmi3EnterStepMode(Instance c) { (void)c; return fmi3OK; }
fmi3Status fmi3DoStep(Instance c, Real now, Real length, fmi3Boolean no_way_back,
                      fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early, Real *last) {
    (void)no_way_back;
    *event = *terminate = *early = fmi3False;
    *last = now + length;
    if (!(length > 0.0)) return fmi3Error;
    D->value[TIME] = now;
    return answer(c, driveline_step(D, length));
}
