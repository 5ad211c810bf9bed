//! gmlc
fn main() {}
