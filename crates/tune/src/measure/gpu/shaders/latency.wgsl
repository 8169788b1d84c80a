// Next to nothing, so that only the cost of asking for it shows.

@group(0) @binding(0) var<storage, read_write> count: array<u32>;

@compute @workgroup_size(1)
fn empty() {}

// Reads what the dispatch before it wrote: dispatches of this kernel can't overlap.
@compute @workgroup_size(1)
fn step() {
    count[0] = count[0] + 1u;
}
