/* A bare periodic loop: the best this machine can do for a period and a priority, whatever a program does in it.
 * bare_loop PERIOD_NS COUNT PRIORITY: prints how late each cycle began [ns]. PRIORITY 0 is ordinary scheduling.
 * Exit status 3: the system refuses the priority. */
#define _GNU_SOURCE
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <time.h>

static const long long NS_PER_S = 1000000000;

static long long now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec * NS_PER_S + t.tv_nsec;
}

int main(int argc, char **argv)
{
    if (argc != 4)
        return 2;
    const long long period_ns = atoll(argv[1]);
    const int count = atoi(argv[2]);
    const struct sched_param parameters = {.sched_priority = atoi(argv[3])};
    long long *late_ns = calloc(count, sizeof *late_ns);

    if (parameters.sched_priority > 0 && sched_setscheduler(0, SCHED_FIFO, &parameters) != 0)
        return 3;
    mlockall(MCL_CURRENT | MCL_FUTURE);
    prctl(PR_SET_TIMERSLACK, 1, 0, 0, 0);

    long long due_ns = now_ns();
    for (int i = 0; i < count; i++) {
        due_ns += period_ns;
        const struct timespec due = {due_ns / NS_PER_S, due_ns % NS_PER_S};
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, NULL);
        late_ns[i] = now_ns() - due_ns;
        if (late_ns[i] > period_ns / 2) /* as the cycle here: what it ran into is left out */
            due_ns += (late_ns[i] + period_ns / 2) / period_ns * period_ns;
    }
    for (int i = 0; i < count; i++)
        printf("%lld\n", late_ns[i]);
    return 0;
}
