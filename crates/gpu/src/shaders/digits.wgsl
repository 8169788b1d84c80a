// Counting the digits of the radix sort; see `sort.wgsl`. The file before this one declares `counts`.

const DIGITS: u32 = 256u;
// Keys of one workgroup of the scatter.
const BLOCK: u32 = 2048u;

fn blocks() -> u32 {
    return (params.objects + BLOCK - 1u) / BLOCK;
}

// Returns where the count of a digit in a block is. A pass has the counts of all blocks for the first digit, then for
// the second, and so on.
fn counts_at(pass_number: u32, digit: u32, block: u32) -> u32 {
    return (pass_number * DIGITS + digit) * blocks() + block;
}

fn digit_of(key: u32, pass_number: u32) -> u32 {
    return (key >> (pass_number * 8u)) & (DIGITS - 1u);
}

// Counts the digit of a key that is at a position when a pass begins. The order of the additions does not change the
// sum.
fn note_digit(pass_number: u32, key: u32, at: u32) {
    atomicAdd(&counts[counts_at(pass_number, digit_of(key, pass_number), at / BLOCK)], 1u);
}
