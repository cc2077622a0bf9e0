//! The hash SHA-256 (FIPS 180-4), by which an archive states that a file is unchanged.

use std::fs::File;
use std::io::Read;
use std::path::Path;

/// The first 32 bits of the fractional parts of the cube roots of the first 64 primes.
const ROUNDS: [u32; 64] = [
    0x428a2f98, 0x71374491, 0xb5c0fbcf, 0xe9b5dba5, 0x3956c25b, 0x59f111f1, 0x923f82a4, 0xab1c5ed5,
    0xd807aa98, 0x12835b01, 0x243185be, 0x550c7dc3, 0x72be5d74, 0x80deb1fe, 0x9bdc06a7, 0xc19bf174,
    0xe49b69c1, 0xefbe4786, 0x0fc19dc6, 0x240ca1cc, 0x2de92c6f, 0x4a7484aa, 0x5cb0a9dc, 0x76f988da,
    0x983e5152, 0xa831c66d, 0xb00327c8, 0xbf597fc7, 0xc6e00bf3, 0xd5a79147, 0x06ca6351, 0x14292967,
    0x27b70a85, 0x2e1b2138, 0x4d2c6dfc, 0x53380d13, 0x650a7354, 0x766a0abb, 0x81c2c92e, 0x92722c85,
    0xa2bfe8a1, 0xa81a664b, 0xc24b8b70, 0xc76c51a3, 0xd192e819, 0xd6990624, 0xf40e3585, 0x106aa070,
    0x19a4c116, 0x1e376c08, 0x2748774c, 0x34b0bcb5, 0x391c0cb3, 0x4ed8aa4a, 0x5b9cca4f, 0x682e6ff3,
    0x748f82ee, 0x78a5636f, 0x84c87814, 0x8cc70208, 0x90befffa, 0xa4506ceb, 0xbef9a3f7, 0xc67178f2,
];
/// The first 32 bits of the fractional parts of the square roots of the first 8 primes.
const START: [u32; 8] = [
    0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a, 0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19,
];

/// The bytes of a hash.
pub(super) type Digest = [u8; 32];

/// Returns the hash of some bytes.
pub(super) fn digest(bytes: &[u8]) -> Digest {
    let mut state = START;
    let (blocks, rest) = bytes.as_chunks::<64>();
    blocks.iter().for_each(|block| mix(&mut state, block));
    finished(state, rest, bytes.len() as u64)
}

/// Returns the hash of a file as 64 hexadecimal digits. The file is not kept in memory.
///
/// # Errors
/// Returns an error if the file cannot be read.
pub(super) fn of_file(path: &Path) -> std::io::Result<String> {
    let (mut file, mut state, mut length) = (File::open(path)?, START, 0);
    let mut buffer = vec![0; 1 << 16];
    loop {
        let filled = read_full(&mut file, &mut buffer)?;
        length += filled as u64;
        let (blocks, rest) = buffer[..filled].as_chunks::<64>();
        blocks.iter().for_each(|block| mix(&mut state, block));
        if filled < buffer.len() {
            return Ok(hex(&finished(state, rest, length)));
        }
    }
}

/// Returns bytes as hexadecimal digits.
pub(super) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Fills a buffer as far as the file has bytes, and returns their number.
fn read_full(file: &mut File, buffer: &mut [u8]) -> std::io::Result<usize> {
    let mut filled = 0;
    while filled < buffer.len() {
        match file.read(&mut buffer[filled..]) {
            Ok(0) => break,
            Ok(n) => filled += n,
            Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
            Err(e) => return Err(e),
        }
    }
    Ok(filled)
}

/// Adds the last bytes, fewer than 64, with the padding: a bit 1, zeros, and the length in bits.
fn finished(mut state: [u32; 8], rest: &[u8], length: u64) -> Digest {
    let mut last = rest.to_vec();
    last.push(0x80);
    last.resize(if last.len() > 56 { 120 } else { 56 }, 0);
    last.extend((8 * length).to_be_bytes());
    let (blocks, _) = last.as_chunks::<64>();
    blocks.iter().for_each(|block| mix(&mut state, block));
    let mut out = [0; 32];
    let words = out.as_chunks_mut::<4>().0.iter_mut();
    words
        .zip(state)
        .for_each(|(bytes, word)| *bytes = word.to_be_bytes());
    out
}

/// Adds a block to the state.
fn mix(state: &mut [u32; 8], block: &[u8; 64]) {
    let mut w = [0_u32; 64];
    let words = block.as_chunks::<4>().0;
    w.iter_mut()
        .zip(words)
        .for_each(|(w, bytes)| *w = u32::from_be_bytes(*bytes));
    for i in 16..64 {
        let (a, b) = (w[i - 15], w[i - 2]);
        let s0 = a.rotate_right(7) ^ a.rotate_right(18) ^ (a >> 3);
        let s1 = b.rotate_right(17) ^ b.rotate_right(19) ^ (b >> 10);
        w[i] = w[i - 16]
            .wrapping_add(s0)
            .wrapping_add(w[i - 7])
            .wrapping_add(s1);
    }
    let [mut a, mut b, mut c, mut d, mut e, mut f, mut g, mut h] = *state;
    for (w, k) in w.into_iter().zip(ROUNDS) {
        let s1 = e.rotate_right(6) ^ e.rotate_right(11) ^ e.rotate_right(25);
        let choice = (e & f) ^ (!e & g);
        let t1 = h
            .wrapping_add(s1)
            .wrapping_add(choice)
            .wrapping_add(k)
            .wrapping_add(w);
        let s0 = a.rotate_right(2) ^ a.rotate_right(13) ^ a.rotate_right(22);
        let t2 = s0.wrapping_add((a & b) ^ (a & c) ^ (b & c));
        (h, g, f, e, d, c, b, a) = (g, f, e, d.wrapping_add(t1), c, b, a, t1.wrapping_add(t2));
    }
    let new = [a, b, c, d, e, f, g, h];
    state
        .iter_mut()
        .zip(new)
        .for_each(|(s, n)| *s = s.wrapping_add(n));
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
