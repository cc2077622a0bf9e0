//! URIs of the scheme `data`, which contain the bytes of a file (RFC 2397).

use ivcam_base::diag::{Diagnostic, ErrorKind, Result};

/// The characters of base64 (RFC 4648), by their value.
const CHARACTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/// Returns whether a reference is such a URI.
pub(super) fn is_data(reference: &str) -> bool {
    reference
        .get(..5)
        .is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:"))
}

/// Returns a short name and the bytes of a URI. The name tells different contents apart.
///
/// # Errors
/// Returns an error if the URI has no comma, or has characters that base64 does not.
pub(super) fn decoded(reference: &str) -> Result<(String, Vec<u8>)> {
    let damaged = |why| {
        let begins: String = reference.chars().take(40).collect();
        Diagnostic::error(format!("the URI `{begins}…` {why}")).of_kind(ErrorKind::Damaged)
    };
    let (head, body) = reference
        .split_once(',')
        .ok_or_else(|| damaged("has no comma"))?;
    let bytes = match head.ends_with(";base64") {
        true => base64(body.as_bytes()).ok_or_else(|| damaged("is not base64"))?,
        false => percent(body.as_bytes()),
    };
    let name = format!(
        "{} of {} bytes, {:08x}",
        head,
        bytes.len(),
        checksum(&bytes)
    );
    Ok((name, bytes))
}

/// Returns a URI with some bytes.
pub(super) fn encoded(media_type: &str, bytes: &[u8]) -> String {
    let mut out = format!("data:{media_type};base64,");
    out.reserve(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let byte = |i: usize| u32::from(chunk.get(i).copied().unwrap_or(0));
        let bits = byte(0) << 16 | byte(1) << 8 | byte(2);
        for i in 0..4 {
            let sextet = (bits >> (18 - 6 * i)) as usize & 63;
            out.push(if i > chunk.len() {
                '='
            } else {
                char::from(CHARACTERS[sextet])
            });
        }
    }
    out
}

/// Decodes base64, also that of URLs. Padding and white space have no meaning.
fn base64(text: &[u8]) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut count) = (0u32, 0);
    for &c in text {
        let sextet = match c {
            b'A'..=b'Z' => c - b'A',
            b'a'..=b'z' => c - b'a' + 26,
            b'0'..=b'9' => c - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            b'=' | b' ' | b'\t' | b'\n' | b'\r' => continue,
            _ => return None,
        };
        bits = bits << 6 | u32::from(sextet);
        count += 6;
        if count >= 8 {
            count -= 8;
            out.push((bits >> count) as u8);
        }
    }
    Some(out)
}

/// Decodes `%20` and the like.
pub(super) fn percent(text: &[u8]) -> Vec<u8> {
    let mut out = Vec::with_capacity(text.len());
    let mut rest = text;
    while let [first, tail @ ..] = rest {
        let digits = tail.get(..2).and_then(|d| std::str::from_utf8(d).ok());
        let byte = digits.and_then(|d| u8::from_str_radix(d, 16).ok());
        match byte.filter(|_| *first == b'%') {
            Some(byte) => {
                out.push(byte);
                rest = &tail[2..];
            }
            None => {
                out.push(*first);
                rest = tail;
            }
        }
    }
    out
}

/// A number that differs for different contents: 32-bit FNV-1a.
fn checksum(bytes: &[u8]) -> u32 {
    let step = |hash: u32, &byte: &u8| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193);
    bytes.iter().fold(0x811c_9dc5, step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_the_same_after_encoding_and_decoding() {
        for length in 0..20u8 {
            let bytes: Vec<u8> = (0..length).map(|n| n.wrapping_mul(37) ^ 0x5a).collect();
            let uri = encoded("image/png", &bytes);
            assert!(is_data(&uri));
            assert_eq!(decoded(&uri).expect("a URI").1, bytes, "{uri}");
        }
        assert_eq!(encoded("a/b", b"Man"), "data:a/b;base64,TWFu");
        assert_eq!(encoded("a/b", b"Ma"), "data:a/b;base64,TWE=");
    }

    #[test]
    fn text_in_a_uri_may_have_escapes() {
        assert_eq!(decoded("data:,a%20b%zz").expect("a URI").1, b"a b%zz");
        assert!(decoded("data:image/png;base64").is_err());
        assert!(decoded("data:;base64,*").is_err());
    }
}
