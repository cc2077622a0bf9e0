//! Names of files below a folder: text of which the path can be made again.

use std::path::{Path, PathBuf};

/// Returns a path with `/` between its parts. A byte that is not UTF-8 is written as in `\xE4`, so
/// that different paths have different names.
pub(crate) fn name_of(path: &Path) -> String {
    let parts = path.components().map(|part| {
        let mut name = String::new();
        for chunk in part.as_os_str().as_encoded_bytes().utf8_chunks() {
            name += chunk.valid();
            chunk
                .invalid()
                .iter()
                .for_each(|byte| name += &format!("\\x{byte:02X}"));
        }
        name
    });
    parts.collect::<Vec<_>>().join("/")
}

/// Returns the bytes of the path of a name.
pub(crate) fn bytes_of(name: &str) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(name.len());
    let mut rest = name;
    while let Some((before, after)) = rest.split_once("\\x") {
        bytes.extend(before.as_bytes());
        let byte = after
            .get(..2)
            .and_then(|digits| u8::from_str_radix(digits, 16).ok());
        rest = match byte.filter(|byte| !byte.is_ascii()) {
            Some(byte) => {
                bytes.push(byte);
                &after[2..]
            }
            None => {
                bytes.extend(b"\\x");
                after
            }
        };
    }
    bytes.extend(rest.as_bytes());
    bytes
}

/// Returns the path of a name.
#[cfg(unix)]
pub(crate) fn path_of(name: &str) -> PathBuf {
    use std::os::unix::ffi::OsStringExt;
    std::ffi::OsString::from_vec(bytes_of(name)).into()
}

/// Returns the path of a name.
#[cfg(not(unix))]
pub(crate) fn path_of(name: &str) -> PathBuf {
    name.into()
}

#[cfg(all(test, unix))]
mod tests {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;

    use super::*;

    #[test]
    fn a_name_leads_back_to_its_path_whatever_its_bytes() {
        for (bytes, name) in [
            (b"a/b\xe4r.iv".as_slice(), "a/b\\xE4r.iv"),
            (b"a/b\xf6r.iv", "a/b\\xF6r.iv"),
            ("b\u{e4}r \\x.iv".as_bytes(), "b\u{e4}r \\x.iv"),
            (b"\\x41", "\\x41"),
        ] {
            let path = Path::new(OsStr::from_bytes(bytes));
            assert_eq!(name_of(path), name);
            assert_eq!(path_of(name), path);
        }
    }
}
