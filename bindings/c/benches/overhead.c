/* The frames of overhead.rs, through the C interface. Their instructions are compared: tools/c.sh overhead */
#include <sapwise.h>
#include <stdio.h>
#include <stdlib.h>

static uint64_t state = 1;

static float next(void) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (float)(state >> 40) / (float)(1 << 24);
}

__attribute__((noinline)) size_t
measured_frame(sw_space *space, const uint64_t *handles, const float *boxes, size_t n) {
    size_t count = 0;
    if (sw_space_set_many(space, handles, boxes, n, 0, NULL) || sw_space_update(space)) exit(1);
    sw_space_pairs(space, &count);
    return count;
}

int main(int argc, char **argv) {
    size_t n = argc > 1 ? strtoul(argv[1], NULL, 10) : 100, pairs = 0;
    sw_options options = {0};
    options.threads = 1;
    options.algorithm = n > 1000 ? "grid-sap@cpu1" : "brute@cpu1";
    sw_space *space = sw_space_new_with(&options);
    float *boxes = malloc(n * 6 * sizeof *boxes);
    uint64_t *handles = malloc(n * sizeof *handles);
    for (int frame = 0; frame < 8; frame++) {
        for (size_t k = 0; k < n; k++) {
            for (int a = 0; a < 3; a++) {
                boxes[6 * k + a] = next() * (n > 1000 ? 100.0f : 10.0f);
                boxes[6 * k + 3 + a] = boxes[6 * k + a] + 1;
            }
        }
        if (frame == 0 && sw_space_insert_many(space, boxes, n, 0, NULL, NULL, handles)) return 1;
        pairs += measured_frame(space, handles, boxes, n);
    }
    printf("%zu pairs\n", pairs);
    free(boxes);
    free(handles);
    return sw_space_free(space);
}
