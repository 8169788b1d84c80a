// Prefix sums over the `THREADS` invocations of a workgroup.

var<workgroup> scan: array<u32, THREADS>;

// Returns the sum of the values before this invocation. Leaves in `scan` the sums up to each.
fn exclusive(t: u32, value: u32) -> u32 {
    scan[t] = value;
    workgroupBarrier();
    for (var step = 1u; step < THREADS; step <<= 1u) {
        var left = 0u;
        if (t >= step) {
            left = scan[t - step];
        }
        workgroupBarrier();
        scan[t] += left;
        workgroupBarrier();
    }
    return scan[t] - value;
}
