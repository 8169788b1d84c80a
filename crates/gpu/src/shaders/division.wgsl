// The cells of an axis. It is divided into parts in which the boxes lie evenly, and each part into cells of one width.

// Parts of an axis.
const PARTS: u32 = 16u;
// Index of the grid's first axis in `params.segments`, behind those of the curve.
const GRID: u32 = 3u * PARTS;

// Returns a bound as a float whose sums and differences are finite. Clamps the bits, because drivers may assume that
// there are no infinities.
fn tame(bits: u32) -> f32 {
    // 1e38.
    let magnitude = min(bits & 0x7fffffffu, 0x7e967699u);
    return bitcast<f32>(magnitude | (bits & 0x80000000u));
}

// Returns the cell of a value on the axis whose parts begin at `base`. Values outside belong to the first or last
// cell.
//
// The cell is monotonic in the value, which is all that the grid needs to be correct: within a part the difference
// and the product are, and the last cell of a part comes before the first of the next. Only one kernel computes
// cells, because another might round differently.
fn cell(value: f32, base: u32) -> u32 {
    var at = base;
    for (var step = PARTS / 2u; step > 0u; step >>= 1u) {
        if (params.segments[at + step].begin <= value) {
            at += step;
        }
    }
    let part = params.segments[at];
    let c = (value - part.begin) * part.per_length;
    return part.first + min(u32(clamp(c, 0.0, f32(part.last))), part.last);
}
