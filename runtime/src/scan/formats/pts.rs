//! PTS.

use crate::scan::cloud::{Input, Points};
use crate::scan::error::ScanFault;

/// Reads a file of this format.
pub(in crate::scan) fn read(input: Input, points: &mut dyn Points) -> Result<(), ScanFault> {
    let (_, _) = (input, points);
    Err(ScanFault::malformed("PTS", "header", "not read yet"))
}

/// Whether a file that begins so is of this format.
pub(in crate::scan) fn recognise(head: &[u8]) -> bool {
    let _ = head;
    false
}
