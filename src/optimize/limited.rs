//! Files read up to a size.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// The content of a file of at most `most` bytes; a device that never ends is no way around.
///
/// # Errors
/// Errors of the operating system; [`io::ErrorKind::FileTooLarge`] for a larger file.
pub(crate) fn read_limited(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    read_from(File::open(path)?, most)
}

/// The content of a stream, up to `most` bytes.
///
/// # Errors
/// As [`read_limited`].
pub(crate) fn read_from(stream: impl Read, most: u64) -> io::Result<Vec<u8>> {
    let mut content = Vec::new();
    stream.take(most + 1).read_to_end(&mut content)?;
    if content.len() as u64 > most {
        let message = format!("larger than {most} bytes, the most that is read");
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, message));
    }
    Ok(content)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_too_large_is_refused() {
        assert_eq!(read_from(&b"12345"[..], 5).unwrap(), b"12345");
        assert_eq!(read_from(&b"123456"[..], 5).unwrap_err().kind(), io::ErrorKind::FileTooLarge);
        assert!(read_from(io::repeat(0), 1000).is_err());
    }
}
