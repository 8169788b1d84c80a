// A row is tested with the boxes that begin within its length on the sweep axis, in its own strip and those beside it. No box
// but those kept apart reaches further than the strip after its own.

// Position of the first box of each slot of each strip; behind the last slot that of the first box kept apart.
@group(0) @binding(8) var<storage, read> table: array<u32>;

fn search(row: u32) {
    let a = boxes[row];
    let key = keys[row];
    if (key >= params.large_key) {
        test_large(row, a, row + 1u);
        return;
    }
    let slot = key % params.slots;
    let strip = key / params.slots;
    let first = vec2<u32>(strip % params.cells.x, strip / params.cells.x);
    // hi.w: slots to the last one covered, then a bit for each axis across on which the next cell is covered too.
    let last = first + vec2<u32>((a.hi.w >> 30u) & 1u, a.hi.w >> 31u);
    let last_slot = slot + (a.hi.w & 0x3fffffffu);
    for (var y = max(first.y, 1u) - 1u; y <= last.y; y++) {
        for (var x = max(first.x, 1u) - 1u; x <= last.x; x++) {
            let base = (y * params.cells.x + x) * params.slots;
            let candidates = part(table[base + slot], table[base + last_slot + 1u]);
            for (var j = candidates.x; j < candidates.y; j++) {
                let b = boxes[j];
                // Of two boxes the one that begins first reports the pair, of two that begin together the one that stands first.
                let behind = b.lo.x > a.lo.x || (b.lo.x == a.lo.x && j > row);
                if (behind && b.lo.x <= a.hi.x && overlap_across(a, b)) {
                    hit(row, a.lo.w, b.lo.w);
                }
            }
        }
    }
    test_large(row, a, table[params.large_key]);
}

// The boxes kept apart from `begin` on.
fn test_large(row: u32, a: Box, begin: u32) {
    let candidates = part(begin, params.objects);
    for (var j = candidates.x; j < candidates.y; j++) {
        let b = boxes[j];
        if (a.lo.x <= b.hi.x && b.lo.x <= a.hi.x && overlap_across(a, b)) {
            hit(row, a.lo.w, b.lo.w);
        }
    }
}
