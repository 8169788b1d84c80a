// A row is tested with the boxes behind it until one begins after its end.

fn search(row: u32) {
    let a = boxes[row];
    for (var j = row + 1u; j < params.objects; j++) {
        let b = boxes[j];
        if (b.lo.x > a.hi.x) {
            break;
        }
        if (overlap_across(a, b)) {
            hit(row, a.lo.w, b.lo.w);
        }
    }
}
