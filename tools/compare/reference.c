/*
 * Independent implementations of what no packaged tool measures: the clock by a chain of register additions, the latency of
 * loads around a random cycle, the way of a cache line between two cores, and the cost of a parallel region of OpenMP.
 * Written for the comparison with `sapwise::measure`; they share no code.
 *
 *     reference clock | latency KIBIBYTES | distance | region
 *
 * Prints one number: GHz, or nanoseconds; the median of many times.
 */
#define _GNU_SOURCE
#include <omp.h>
#include <sched.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define SAMPLES 101

static double now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec * 1e9 + (double)t.tv_nsec;
}

static int ascending(const void *left, const void *right)
{
    const double l = *(const double *)left, r = *(const double *)right;
    return (l > r) - (l < r);
}

static double quantile(double *x, int count, double q)
{
    qsort(x, (size_t)count, sizeof *x, ascending);
    return x[(int)(q * (count - 1) + 0.5)];
}

/* The middle of the upper quarter: an interruption can only make a chain slower. */
static double clock_ghz(void)
{
    double x[SAMPLES];
    for (int k = 0; k < SAMPLES; k++) {
        uint64_t sum = 1, addend = 3;
        const long turns = 20000;
        const double start = now_ns();
        for (long i = 0; i < turns; i++) {
#if defined(__x86_64__)
            __asm__ volatile(".rept 100\n\taddq %1, %0\n\t.endr" : "+r"(sum) : "r"(addend) : "cc");
#elif defined(__aarch64__)
            __asm__ volatile(".rept 100\n\tadd %0, %0, %1\n\t.endr" : "+r"(sum) : "r"(addend));
#else
#error "write the chain of additions for this architecture"
#endif
        }
        x[k] = (double)turns * 100.0 / (now_ns() - start);
    }
    return quantile(x, SAMPLES, 0.875);
}

/* Pointers and not indices, a permutation by Sattolo's algorithm from rand(), one pointer to a line of 64 bytes. */
static double latency_ns(long kibibytes)
{
    const size_t lines = (size_t)kibibytes * 1024 / 64;
    char *set = aligned_alloc(4096, lines * 64);
    uint32_t *order = malloc(lines * sizeof *order);
    if (lines < 2 || !set || !order) {
        fprintf(stderr, "reference: no memory for %ld KiB\n", kibibytes);
        exit(1);
    }
    for (size_t i = 0; i < lines; i++)
        order[i] = (uint32_t)i;
    srand(1);
    for (size_t i = lines - 1; i > 0; i--) {
        const size_t j = (((size_t)rand() << 31) | (size_t)rand()) % i;
        const uint32_t swap = order[i];
        order[i] = order[j];
        order[j] = swap;
    }
    for (size_t i = 0; i < lines; i++)
        *(void **)(set + i * 64) = set + (size_t)order[i] * 64;
    free(order);
    void **at = (void **)set;
    const long warm = lines < 1 << 18 ? (long)lines * 2 : 1 << 18;
    for (long i = 0; i < warm; i++)
        at = *at;
    double x[SAMPLES];
    const long steps = 1 << 15;
    for (int k = 0; k < SAMPLES; k++) {
        const double start = now_ns();
        for (long i = 0; i < steps; i++)
            at = *at;
        /* The address must be known before the time is taken. */
        __asm__ volatile("" : "+r"(at) : : "memory");
        x[k] = (now_ns() - start) / (double)steps;
    }
    return quantile(x, SAMPLES, 0.5);
}

/* Binds thread k of the team to the k-th CPU that the process may use. */
static void bind(int k)
{
    cpu_set_t may, one;
    sched_getaffinity(0, sizeof may, &may);
    for (int cpu = 0; cpu < CPU_SETSIZE; cpu++)
        if (CPU_ISSET(cpu, &may) && k-- == 0) {
            CPU_ZERO(&one);
            CPU_SET(cpu, &one);
            sched_setaffinity(0, sizeof one, &one);
            return;
        }
}

static _Alignas(128) atomic_int owner;

static double distance_ns(void)
{
    static double x[SAMPLES];
    const int trips = 200;
#pragma omp parallel num_threads(2)
    {
        const int me = omp_get_thread_num();
        bind(me);
#pragma omp barrier
        for (int k = 0; k < SAMPLES; k++) {
            const double start = now_ns();
            for (int i = 0; i < trips; i++) {
                while (atomic_load_explicit(&owner, memory_order_acquire) != me)
                    ;
                atomic_store_explicit(&owner, 1 - me, memory_order_release);
            }
            if (me == 0)
                x[k] = (now_ns() - start) / (2.0 * trips);
        }
    }
    return quantile(x, SAMPLES, 0.5);
}

static void spin(double ns)
{
    const double start = now_ns();
    while (now_ns() - start < ns)
        ;
}

/* A region in which every thread spins for 20 us, less one such body: the measure of EPCC's OpenMP benchmarks. */
static double region_ns(void)
{
    static double x[SAMPLES], body[SAMPLES];
#pragma omp parallel
    bind(omp_get_thread_num());
    for (int k = 0; k < SAMPLES; k++) {
        double start = now_ns();
        spin(20e3);
        body[k] = now_ns() - start;
        start = now_ns();
#pragma omp parallel
        spin(20e3);
        x[k] = now_ns() - start;
    }
    return quantile(x, SAMPLES, 0.5) - quantile(body, SAMPLES, 0.5);
}

int main(int argc, char **argv)
{
    double figure;
    if (argc == 2 && !strcmp(argv[1], "clock"))
        figure = clock_ghz();
    else if (argc == 3 && !strcmp(argv[1], "latency") && atol(argv[2]) > 0)
        figure = latency_ns(atol(argv[2]));
    else if (argc == 2 && !strcmp(argv[1], "distance"))
        figure = distance_ns();
    else if (argc == 2 && !strcmp(argv[1], "region"))
        figure = region_ns();
    else {
        fprintf(stderr, "usage: reference clock | latency KIBIBYTES | distance | region\n");
        return 2;
    }
    printf("%.4f\n", figure);
    return 0;
}
