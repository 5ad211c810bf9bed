//! LAS.

use super::{Out, Recorded};
use std::io;

/// Writes a scan in this format.
pub(super) fn write(out: &mut dyn Out, scan: &Recorded<'_>, compressed: bool) -> io::Result<()> {
    let _ = (out, scan, compressed);
    Err(io::Error::other("not written yet"))
}
