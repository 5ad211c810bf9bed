//! LZF, the compression of PCD (Lehmann, liblzf): runs of literal bytes, and copies of what came shortly before.

/// A copy of 264 bytes takes three: no data unpack to more than so many times their size.
pub(super) const MOST_GROWTH: usize = 88;

/// Unpacks to `size` bytes; the error is the number of bytes that it unpacks to instead, or up to its fault.
pub(super) fn unpack(packed: &[u8], size: usize) -> Result<Vec<u8>, usize> {
    if size > packed.len().saturating_mul(MOST_GROWTH) {
        return Err(packed.len().saturating_mul(MOST_GROWTH));
    }
    let mut all = Vec::with_capacity(size);
    let mut rest = packed;
    while let Some((&control, behind)) = rest.split_first() {
        if control < 32 {
            let (literal, behind) = behind.split_at_checked(usize::from(control) + 1).ok_or(all.len())?;
            all.extend_from_slice(literal);
            rest = behind;
        } else {
            rest = copy(&mut all, control, behind).ok_or(all.len())?;
        }
        if all.len() > size {
            return Err(all.len());
        }
    }
    if all.len() == size { Ok(all) } else { Err(all.len()) }
}

/// Repeats what came before; what is left of the packed bytes.
fn copy<'a>(all: &mut Vec<u8>, control: u8, rest: &'a [u8]) -> Option<&'a [u8]> {
    let (mut length, mut rest) = (usize::from(control >> 5), rest);
    if length == 7 {
        let (&more, behind) = rest.split_first()?;
        length += usize::from(more);
        rest = behind;
    }
    length += 2;
    let (&low, rest) = rest.split_first()?;
    let distance = (usize::from(control & 31) << 8 | usize::from(low)) + 1;
    let start = all.len().checked_sub(distance)?;
    // A copy may reach into itself: it repeats then.
    while length > 0 {
        let part = length.min(all.len() - start);
        all.extend_from_within(start..start + part);
        length -= part;
    }
    Some(rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn literals_and_copies() {
        assert_eq!(unpack(&[2, b'a', b'b', b'c'], 3), Ok(b"abc".to_vec()));
        // Five bytes from two bytes before, then 264 from one before.
        let packed = [1, b'a', b'b', 3 << 5, 1, 7 << 5, 255, 0];
        let expected = [b"abababa".to_vec(), vec![b'a'; 264]].concat();
        assert_eq!(unpack(&packed, expected.len()), Ok(expected));
    }

    #[test]
    fn faults() {
        assert_eq!(unpack(&[2, b'a'], 3), Err(0));
        assert_eq!(unpack(&[0, b'a', 32, 1], 4), Err(1));
        assert_eq!(unpack(&[0, b'a', 32], 4), Err(1));
        assert_eq!(unpack(&[0, b'a'], 2), Err(1));
        assert_eq!(unpack(&[1, b'a', b'b'], 1), Err(2));
        assert_eq!(unpack(&[0, b'a'], 1 << 40), Err(2 * MOST_GROWTH));
    }
}
