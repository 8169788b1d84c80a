// No filter.

fn filter_for(row: u32) {}

fn passes(other: u32) -> bool {
    return true;
}
