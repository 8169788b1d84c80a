/*
 * Memory bandwidth by the triad a = b + s * c, by the rules of STREAM: arrays of at least four times the last-level
 * caches, touched first by the threads that use them, 24 bytes an element, first repetition dropped, values checked at
 * the end. Written for the comparison with `sapwise::measure`; no code of STREAM is in it.
 *
 *     triad MEBIBYTES_PER_ARRAY [REPETITIONS]
 *
 * Prints one line, best and median GB/s, for the threads that OMP_NUM_THREADS allows.
 */
#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>

static int ascending(const void *left, const void *right)
{
    const double l = *(const double *)left, r = *(const double *)right;
    return (l > r) - (l < r);
}

int main(int argc, char **argv)
{
    const long mebibytes = argc > 1 ? atol(argv[1]) : 0;
    const long repetitions = argc > 2 ? atol(argv[2]) : 13;
    if (mebibytes < 1 || repetitions < 2) {
        fprintf(stderr, "usage: triad MEBIBYTES_PER_ARRAY [REPETITIONS, at least 2]\n");
        return 2;
    }
    const long count = mebibytes * 1024 * 1024 / (long)sizeof(double);
    double *restrict a = malloc((size_t)count * sizeof *a);
    double *restrict b = malloc((size_t)count * sizeof *b);
    double *restrict c = malloc((size_t)count * sizeof *c);
    double *rates = malloc((size_t)repetitions * sizeof *rates);
    if (!a || !b || !c || !rates) {
        fprintf(stderr, "triad: no memory for three arrays of %ld MiB\n", mebibytes);
        return 1;
    }
#pragma omp parallel for schedule(static)
    for (long i = 0; i < count; i++) {
        a[i] = 0.0;
        b[i] = 1.0;
        c[i] = 2.0;
    }
    /* The factor differs in each repetition, so that no repetition can be left out. */
    for (long r = 0; r < repetitions; r++) {
        const double factor = 3.0 + (double)r;
        const double start = omp_get_wtime();
#pragma omp parallel for schedule(static)
        for (long i = 0; i < count; i++)
            a[i] = b[i] + factor * c[i];
        rates[r] = 24.0 * (double)count / (omp_get_wtime() - start) / 1e9;
    }
    const double expected = 1.0 + 2.0 * (3.0 + (double)(repetitions - 1));
    for (long i = 0; i < count; i++) {
        if (fabs(a[i] - expected) > 1e-12 * expected) {
            fprintf(stderr, "triad: element %ld is %g, not %g\n", i, a[i], expected);
            return 1;
        }
    }
    const long kept = repetitions - 1;
    qsort(rates + 1, (size_t)kept, sizeof *rates, ascending);
    const double median = kept % 2 ? rates[1 + kept / 2] : (rates[kept / 2] + rates[1 + kept / 2]) / 2.0;
    printf("%.3f %.3f\n", rates[kept], median);
    return 0;
}
