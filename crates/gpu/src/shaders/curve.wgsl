// The place of a box on the Hilbert curve: boxes near each other on the curve are near each other in space. By the
// transposition of Skilling ("Programming the Hilbert curve", 2004). Large boxes follow the others, by size, because
// one large box makes a large node. No choice here can lose a pair.

// Spreads bits 0 to 9 to every third bit.
fn spread(bits: u32) -> u32 {
    var b = (bits | (bits << 16u)) & 0x030000ffu;
    b = (b | (b << 8u)) & 0x0300f00fu;
    b = (b | (b << 4u)) & 0x030c30c3u;
    return (b | (b << 2u)) & 0x09249249u;
}

fn hilbert(place: vec3u) -> u32 {
    var p = place;
    for (var bit = 512u; bit > 1u; bit >>= 1u) {
        let below = bit - 1u;
        if ((p.x & bit) != 0u) {
            p.x ^= below;
        }
        if ((p.y & bit) != 0u) {
            p.x ^= below;
        } else {
            let t = (p.x ^ p.y) & below;
            p.x ^= t;
            p.y ^= t;
        }
        if ((p.z & bit) != 0u) {
            p.x ^= below;
        } else {
            let t = (p.x ^ p.z) & below;
            p.x ^= t;
            p.z ^= t;
        }
    }
    p.y ^= p.x;
    p.z ^= p.y;
    var t = 0u;
    for (var bit = 512u; bit > 1u; bit >>= 1u) {
        if ((p.z & bit) != 0u) {
            t ^= bit - 1u;
        }
    }
    p ^= vec3u(t, t, t);
    return (spread(p.x) << 2u) | (spread(p.y) << 1u) | spread(p.z);
}

// Returns two bits of size, then those of the place of the centre. If the grid has less than 1024 cells on an axis, the
// upper bits of the place are zero.
fn curve(at: u32) -> u32 {
    let low = vec3f(tame(bound(at, 0u, 0u)), tame(bound(at, 0u, 1u)), tame(bound(at, 0u, 2u)));
    let high = vec3f(tame(bound(at, 1u, 0u)), tame(bound(at, 1u, 1u)), tame(bound(at, 1u, 2u)));
    let extent = high - low;
    let longest = max(max(extent.x, extent.y), extent.z) * params.usual;
    let size = u32(longest > 8.0) + u32(longest > 64.0) + u32(longest > 512.0);
    let middle = low + extent * 0.5;
    let place = vec3u(cell(middle.x, 0u), cell(middle.y, PARTS), cell(middle.z, 2u * PARTS));
    return (size << params.curve_bits) | hilbert(place);
}
