//! Checksums of E57 files, without which damage to them is told from the checksums alone.

/// Bytes of a page, and of what its checksum is of.
const PAGE: usize = 1024;
const CONTENT: usize = 1020;

/// Makes the checksums of all whole pages right.
pub(crate) fn seal(content: &mut [u8]) {
    for page in content.chunks_exact_mut(PAGE) {
        let sum = checksum(&page[..CONTENT]).to_be_bytes();
        page[CONTENT..].copy_from_slice(&sum);
    }
}

/// CRC-32C (Castagnoli; RFC 3720, appendix B.4), bit by bit.
fn checksum(bytes: &[u8]) -> u32 {
    let step = |sum: u32, _| (sum >> 1) ^ (0x82f6_3b78 & (sum & 1).wrapping_neg());
    !bytes.iter().fold(!0, |sum, byte| (0..8).fold(sum ^ u32::from(*byte), step))
}

#[test]
fn the_checksum_is_the_standards() {
    // RFC 3720, appendix B.4: 32 bytes of zeros.
    assert_eq!(checksum(&[0; 32]), 0x8a91_36aa);
}
