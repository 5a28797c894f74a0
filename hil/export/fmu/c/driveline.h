/* A driveline as a functional mock-up unit: what FMI 2.0 and 3.0 both need of it. */
#ifndef DRIVELINE_H
#define DRIVELINE_H

#include <stddef.h>

#include "model.h"

/* A torque over time, straight from point to point; two points of one time are a step. */
typedef struct {
    double *time_s, *torque;
    size_t count, room;
} History;

typedef struct {
    double value[VALUES]; /* by value reference: inputs, outputs, parameters, states, derivatives */
    History history;
    void *environment, *logger;
} Driveline;

Driveline *driveline_new(void);
void driveline_free(Driveline *d);
void driveline_reset(Driveline *d);
int driveline_begin(Driveline *d);
int driveline_step(Driveline *d, double length_s);
int driveline_remember(Driveline *d);
void driveline_update(Driveline *d);

#endif
