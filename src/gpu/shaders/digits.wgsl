// Counting the digits of the radix sort; see `sort.wgsl`. The file before declares `counts`.

const DIGITS: u32 = 256u;
// Keys of one workgroup of the scatter.
const BLOCK: u32 = 2048u;

fn blocks() -> u32 {
    return (params.objects + BLOCK - 1u) / BLOCK;
}

// Of a pass the counts of each block, digit by digit.
fn counts_at(pass_number: u32, digit: u32, block: u32) -> u32 {
    return (pass_number * DIGITS + digit) * blocks() + block;
}

fn digit_of(key: u32, pass_number: u32) -> u32 {
    return (key >> (pass_number * 8u)) & (DIGITS - 1u);
}

// Counts the digit of a key that stands at a position when a pass begins. A sum does not tell in which order it was formed.
fn note_digit(pass_number: u32, key: u32, at: u32) {
    atomicAdd(&counts[counts_at(pass_number, digit_of(key, pass_number), at / BLOCK)], 1u);
}
