// A row is tested with the boxes behind it until one begins after its end.

fn search(row: u32) {
    let a = boxes[row];
    let begin = min(row + 1u + passed, params.objects);
    let end = min(begin + left, params.objects);
    for (var j = begin; j < end; j++) {
        let b = boxes[j];
        if (b.lo.x > a.hi.x) {
            return;
        }
        if (overlap_across(a, b)) {
            hit(row, a.lo.w, b.lo.w);
        }
    }
    more = end < params.objects && boxes[end].lo.x <= a.hi.x;
}
