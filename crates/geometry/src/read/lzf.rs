//! LZF, the packing of compressed PCD files: runs of plain bytes, and repetitions of what was unpacked before.
//!
//! ```text
//! 000n nnnn                             n + 1 plain bytes follow
//! lllo oooo  [llll llll]  oooo oooo     l + 2 bytes from o + 1 bytes back; where l is 7, the next byte is added to it
//! ```

/// A repetition of 264 bytes takes three: no packed byte can stand for more than this many.
const MOST_GAIN: usize = 88;

/// The bytes that were packed; `None` where they are not exactly `length` or a repetition starts before the first one.
pub(super) fn unpack(mut packed: &[u8], length: usize) -> Option<Vec<u8>> {
    if length > packed.len().saturating_mul(MOST_GAIN) {
        return None;
    }
    let mut bytes = Vec::with_capacity(length);
    while let Some((&control, rest)) = packed.split_first() {
        packed = rest;
        let control = usize::from(control);
        if control < 32 {
            let (run, rest) = packed.split_at_checked(control + 1)?;
            bytes.extend_from_slice(run);
            packed = rest;
        } else {
            let mut next = || {
                let (&byte, rest) = packed.split_first()?;
                packed = rest;
                Some(usize::from(byte))
            };
            let count = 2 + match control >> 5 {
                7 => 7 + next()?,
                short => short,
            };
            let back = ((control & 31) << 8) + next()? + 1;
            let start = bytes.len().checked_sub(back)?;
            // Byte by byte: a repetition may run into what it writes.
            for at in start..start + count {
                bytes.push(bytes[at]);
            }
        }
        if bytes.len() > length {
            return None;
        }
    }
    (bytes.len() == length).then_some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As the program python-lzf 0.2.6 packs and unpacks them.
    #[test]
    fn runs_and_repetitions() {
        assert_eq!(unpack(&[2, b'a', b'b', b'c'], 3).unwrap(), b"abc");
        assert_eq!(unpack(&[0, b'a', 0x20, 0], 4).unwrap(), b"aaaa");
        let packed = [3, 97, 98, 99, 97, 224, 75, 2, 1, 98, 99];
        assert_eq!(unpack(&packed, 90).unwrap(), b"abc".repeat(30));
        let packed = [1, 97, 97, 224, 255, 0, 224, 23, 0, 1, 97, 97];
        assert_eq!(unpack(&packed, 300).unwrap(), [b'a'; 300]);
    }

    #[test]
    fn wrong_bytes_give_nothing() {
        for (packed, length) in [
            (&[2, b'a', b'b'][..], 3), // a run cut short
            (&[0x20, 0], 3),           // a repetition of nothing
            (&[0, b'a', 0xe0], 9),     // a repetition without its length
            (&[0, b'a', 0x20, 0], 3),  // longer than declared
            (&[0, b'a'], 2),           // shorter than declared
            (&[0, b'a'], usize::MAX),
        ] {
            assert_eq!(unpack(packed, length), None, "{packed:?}");
        }
    }
}
