// Where each slot begins in the sorted keys.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> keys: array<u32>;
@group(0) @binding(2) var<storage, read_write> table: array<u32>;

@compute @workgroup_size(256)
fn build(@builtin(workgroup_id) w: vec3<u32>, @builtin(num_workgroups) n: vec3<u32>, @builtin(local_invocation_index) t: u32) {
    let slot = (w.y * n.x + w.x) * 256u + t;
    if (slot > params.large_key) {
        return;
    }
    var low = 0u;
    var high = params.objects;
    while (low < high) {
        let middle = (low + high) / 2u;
        if (keys[middle] < slot) {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    table[slot] = low;
}
