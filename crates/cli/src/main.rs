//! The `alhazen` command.
fn main() {}
