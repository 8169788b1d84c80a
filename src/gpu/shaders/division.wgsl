// How an axis is divided into cells: into parts in which the boxes lie evenly, and each part into cells of one width.

// Parts of an axis.
const PARTS: u32 = 16u;
// Where the axes of the grid begin in `params.segments`, behind those of the curve.
const GRID: u32 = 3u * PARTS;

// A bound as a float of which sums and differences are finite. The clamp is one of bits: drivers may take infinities to be absent.
fn tame(bits: u32) -> f32 {
    // 1e38.
    let magnitude = min(bits & 0x7fffffffu, 0x7e967699u);
    return bitcast<f32>(magnitude | (bits & 0x80000000u));
}

// The cell of a value on the axis whose parts begin at `base`. It never descends as the value ascends, which alone makes the grid correct: within a part
// neither the difference nor the product does, and the last cell of a part lies before the first of the next. It is worked out in one kernel only,
// because another might round in another way. Values outside go to the cells at the ends.
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
