//! GLTF.

use crate::scan::error::ScanFault;
use crate::scan::raw::RawMesh;

/// Reads a file of this format.
pub(in crate::scan) fn read(bytes: &[u8]) -> Result<RawMesh, ScanFault> {
    let _ = bytes;
    Err(ScanFault::malformed("GLTF", "header", "not read yet"))
}

/// Whether a file that begins so is of this format: the header of the binary kind, or an object with a key "asset".
pub(in crate::scan) fn recognise(head: &[u8]) -> bool {
    head.starts_with(b"glTF")
}
