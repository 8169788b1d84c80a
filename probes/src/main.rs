//! The command `sapwise`.

mod train;

fn main() {}
