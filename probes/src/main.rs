//! The command `sapwise`.

mod boxes;
mod files;

fn main() {}
