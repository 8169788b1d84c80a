// Sums over the `THREADS` invocations of a workgroup.

// The sums of a step are read from one half and written to the other, so that a step takes one barrier.
var<workgroup> scan: array<u32, 2u * THREADS>;
// The sum of all values.
var<workgroup> all: atomic<u32>;

// Returns the sum of all values. A barrier must separate two calls.
fn sum(t: u32, value: u32) -> u32 {
    if (t == 0u) {
        atomicStore(&all, 0u);
    }
    workgroupBarrier();
    atomicAdd(&all, value);
    workgroupBarrier();
    return atomicLoad(&all);
}

// Returns the sum of the values before this invocation. A barrier must separate two calls.
fn exclusive(t: u32, value: u32) -> u32 {
    var half = 0u;
    var upto = value;
    scan[t] = upto;
    workgroupBarrier();
    for (var step = 1u; step < THREADS; step <<= 1u) {
        if (t >= step) {
            upto += scan[half + t - step];
        }
        half = THREADS - half;
        scan[half + t] = upto;
        workgroupBarrier();
    }
    return upto - value;
}
