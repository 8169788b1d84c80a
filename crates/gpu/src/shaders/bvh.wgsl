// A row is tested with the boxes behind it in the order of the tree. Large boxes come last, so that small boxes find
// them and they never search among small ones.
//
// A walk over the tree, from a position in the order to the end. Eight siblings are tested together, so that their
// loads overlap. The siblings that are left on each level are eight bits of a stack.

// Without a barrier, which software GPUs make expensive if a kernel needs many registers.
fn before(row: u32, t: u32, count: u32) -> u32 {
    var sum = 0u;
    for (var k = row - t; k < row; k++) {
        sum += rows[k];
    }
    return sum;
}

fn first_state(row: u32) -> u32 {
    return row + 1u;
}

fn search(row: u32, state: u32) -> u32 {
    return walk(row, boxes[row], state);
}

fn bit(a: Box, at: u32) -> u32 {
    let b = boxes[at];
    return u32(a.lo.x <= b.hi.x && b.lo.x <= a.hi.x && overlap_across(a, b));
}

// Tests the eight boxes or nodes around `at`, of the level that begins at `first`. Returns a bit for each that
// overlaps.
fn eight(a: Box, first: u32, at: u32, level: u32) -> u32 {
    left -= min(left, 8u);
    let group = at & ~7u;
    let k = first + group;
    let low = bit(a, k) | (bit(a, k + 1u) << 1u) | (bit(a, k + 2u) << 2u) | (bit(a, k + 3u) << 3u);
    let high = bit(a, k + 4u) | (bit(a, k + 5u) << 1u) | (bit(a, k + 6u) << 2u) | (bit(a, k + 7u) << 3u);
    // The last eight may be fewer.
    return (low | (high << 4u)) & ((1u << min(span(level) - group, 8u)) - 1u);
}

// Tests a row with all boxes from `begin` on. Returns `DONE`, or the position at which to go on.
fn walk(row: u32, a: Box, begin: u32) -> u32 {
    if (begin >= params.objects) {
        return DONE;
    }
    var at = begin;
    var level = 0u;
    var first = 0u;
    // The first of eight: test their parent instead.
    while (level < params.top && (at & 7u) == 0u) {
        first += span(level);
        level++;
        at >>= 3u;
    }
    // Siblings that count.
    var wanted = 0xffu << (at & 7u);
    var stack = vec3u();
    var depth = 0u;
    loop {
        var mask = eight(a, first, at, level) & wanted;
        if (level == 0u) {
            while (mask != 0u) {
                hit(row, a.lo.w, boxes[(at & ~7u) | firstTrailingBit(mask)].lo.w);
                mask &= mask - 1u;
            }
        }
        wanted = 0xffu;
        while (mask == 0u) {
            let next = (at | 7u) + 1u;
            if (next >= span(level)) {
                return DONE;
            }
            if (left == 0u) {
                return next << (3u * level);
            }
            if (level == params.top) {
                at = next;
                break;
            }
            first += span(level);
            level++;
            at >>= 3u;
            if (depth > 0u) {
                depth--;
                mask = stack.x & 0xffu;
                stack = (stack >> vec3u(8u)) | vec3u(stack.y << 24u, stack.z << 24u, 0u);
            } else if ((at & 7u) < 7u) {
                wanted = 0xfeu << (at & 7u);
                break;
            }
        }
        if (mask != 0u) {
            depth++;
            stack = (stack << vec3u(8u)) | vec3u(mask & (mask - 1u), stack.x >> 24u, stack.y >> 24u);
            at = ((at & ~7u) | firstTrailingBit(mask)) << 3u;
            level--;
            first -= span(level);
        }
    }
    return DONE;
}
