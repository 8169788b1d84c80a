// No filter.

fn passes(a: u32, b: u32) -> bool {
    return true;
}
