// The boxes as the caller gave them.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> boxes: array<u32>;
@group(0) @binding(2) var<storage, read> ids: array<u32>;
@group(0) @binding(3) var<storage, read_write> header: Header;

fn bound(at: u32, corner: u32, axis: u32) -> u32 {
    return boxes[at * 6u + corner * 3u + (params.axis + axis) % 3u];
}

fn number(at: u32) -> u32 {
    if (params.piece == 1u) {
        return ids[at];
    }
    return at | OWNER;
}

fn load_box(at: u32) -> Box {
    var b: Box;
    b.lo = vec4u(order_key(bound(at, 0u, 0u)), order_key(bound(at, 0u, 1u)), order_key(bound(at, 0u, 2u)), number(at));
    b.hi = vec4u(order_key(bound(at, 1u, 0u)), order_key(bound(at, 1u, 1u)), order_key(bound(at, 1u, 2u)), 0u);
    return b;
}

// Reports the box if it is invalid, by its number in the whole frame.
fn check_box(at: u32) {
    var nan = false;
    var inverted = false;
    for (var k = 0u; k < 3u; k++) {
        let low = boxes[at * 6u + k];
        let high = boxes[at * 6u + 3u + k];
        nan = nan || is_nan(low) || is_nan(high);
        inverted = inverted || order_key(low) > order_key(high);
    }
    if (nan || inverted) {
        atomicMin(&header.invalid, ((number(at) & ~OWNER) << 1u) | select(1u, 0u, nan));
    }
}
