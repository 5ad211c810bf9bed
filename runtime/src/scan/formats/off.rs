//! OFF.

use crate::scan::error::ScanFault;
use crate::scan::raw::RawMesh;

/// Reads a file of this format.
pub(in crate::scan) fn read(bytes: &[u8]) -> Result<RawMesh, ScanFault> {
    let _ = bytes;
    Err(ScanFault::malformed("OFF", "header", "not read yet"))
}
