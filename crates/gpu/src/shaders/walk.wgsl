// A walk over the tree, from a position in the order to the end. It needs no stack: the next node follows from the
// position of the current one. It tests one node after the other: most rows of `grid_sap.wgsl` test none, and with the
// registers of `bvh.wgsl`'s walk fewer of them would run at once.

// Tests a row with all boxes from `begin` on. Returns `DONE`, or the position at which to go on.
fn walk(row: u32, a: Box, begin: u32) -> u32 {
    var at = begin - 1u;
    var level = 0u;
    var first = 0u;
    var down = false;
    loop {
        if (down) {
            down = false;
        } else {
            at++;
            // The first of eight: test their parent instead.
            while (level < params.top && (at & 7u) == 0u) {
                first += span(level);
                level++;
                at >>= 3u;
            }
        }
        if (at >= span(level)) {
            break;
        }
        if (left == 0u) {
            return at << (3u * level);
        }
        left--;
        let b = boxes[first + at];
        if (a.lo.x <= b.hi.x && b.lo.x <= a.hi.x && overlap_across(a, b)) {
            if (level == 0u) {
                hit(row, a.lo.w, b.lo.w);
            } else {
                level--;
                first -= span(level);
                at <<= 3u;
                down = true;
            }
        }
    }
    return DONE;
}
