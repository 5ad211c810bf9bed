//! XYZ.

use super::{Out, Recorded};
use std::io;

/// Writes a scan in this format.
pub(super) fn write(out: &mut dyn Out, scan: &Recorded<'_>) -> io::Result<()> {
    let _ = (out, scan);
    Err(io::Error::other("not written yet"))
}
