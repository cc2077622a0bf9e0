//! The hash SHA-256, by which an archive states that a file is unchanged.

use std::fs::File;
use std::io::{self, Write};
use std::path::Path;

use sha2::{Digest, Sha256};

/// The hash of what is written to it.
#[derive(Default)]
pub(super) struct HashWriter(Sha256);

impl HashWriter {
    /// Returns the hash as 64 hexadecimal digits.
    pub(super) fn finish(self) -> String {
        hex(&self.0.finalize())
    }
}

impl Write for HashWriter {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.update(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Returns the hash of some bytes.
pub(super) fn digest(bytes: &[u8]) -> [u8; 32] {
    Sha256::digest(bytes).into()
}

/// Returns the hash of a file as 64 hexadecimal digits. The file is not kept in memory.
///
/// # Errors
/// Returns an error if the file cannot be read.
pub(super) fn of_file(path: &Path) -> io::Result<String> {
    let mut hash = HashWriter::default();
    io::copy(&mut File::open(path)?, &mut hash)?;
    Ok(hash.finish())
}

/// Returns bytes as hexadecimal digits.
pub(super) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The values are those of `sha256sum` of coreutils 9.1; the second is the example of FIPS
    /// 180-4.
    #[test]
    fn hashes_are_those_of_the_standard() {
        let million = "a".repeat(1_000_000);
        for (text, expected) in [
            (
                "",
                "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855",
            ),
            (
                "abc",
                "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad",
            ),
            (
                "abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq",
                "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1",
            ),
            (
                &million,
                "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0",
            ),
        ] {
            assert_eq!(hex(&digest(text.as_bytes())), expected);
            let path = std::env::temp_dir().join(format!("ivcam-sha-{}", std::process::id()));
            std::fs::write(&path, text).unwrap();
            let of_file = of_file(&path).unwrap();
            std::fs::remove_file(&path).unwrap();
            assert_eq!(of_file, expected);
        }
    }
}
