/* Loaded before a program that mpirun starts several times: the clock of process 1 runs a hundred
   times as fast as it should, and that of process 2 a hundred times as slowly. */
#define _GNU_SOURCE
#include <stdlib.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

int clock_gettime(clockid_t clock, struct timespec *now)
{
    static struct timespec first;
    const char *rank = getenv("OMPI_COMM_WORLD_RANK");
    int process = rank ? atoi(rank) : 0;
    int status = (int)syscall(SYS_clock_gettime, clock, now);
    double passed;

    if (status != 0 || clock != CLOCK_MONOTONIC || process < 1 || process > 2) return status;
    if (first.tv_sec == 0) first = *now;
    passed = (double)(now->tv_sec - first.tv_sec) + 1e-9 * (double)(now->tv_nsec - first.tv_nsec);
    passed *= process == 1 ? 100.0 : 0.01;
    now->tv_sec = first.tv_sec + (time_t)passed;
    now->tv_nsec = (long)(1e9 * (passed - (double)(time_t)passed));
    return 0;
}
