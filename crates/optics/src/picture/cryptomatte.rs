//! Mattes of named objects in an image of channels, by the Cryptomatte specification 1.2 (Friedman
//! and Jones, *Fully automatic ID mattes with support for motion blur and transparency*, 2015).
//!
//! A name becomes a number by MurmurHash3 and that a float. The channels hold pairs of such a float
//! and of the share of the pixel that it covers, two pairs a layer, the largest share first.

use serde_json::{Map, Value};

use super::channels::ChannelImage;

/// Returns the hash of bytes by MurmurHash3_x86_32 with the seed 0 (Austin Appleby, 2011).
fn murmur3(bytes: &[u8]) -> u32 {
    let scramble = |k: u32| {
        k.wrapping_mul(0xcc9e_2d51)
            .rotate_left(15)
            .wrapping_mul(0x1b87_3593)
    };
    let mut hash = 0u32;
    let mut fours = bytes.chunks_exact(4);
    for four in &mut fours {
        let k = u32::from_le_bytes([four[0], four[1], four[2], four[3]]);
        hash = (hash ^ scramble(k))
            .rotate_left(13)
            .wrapping_mul(5)
            .wrapping_add(0xe654_6b64);
    }
    let rest = fours.remainder().iter().rev();
    hash ^= scramble(rest.fold(0, |k, byte| k << 8 | u32::from(*byte)));
    hash ^= bytes.len() as u32;
    hash = (hash ^ hash >> 16).wrapping_mul(0x85eb_ca6b);
    hash = (hash ^ hash >> 13).wrapping_mul(0xc2b2_ae35);
    hash ^ hash >> 16
}

/// Returns the float that stands for a name. Its bits are those of the hash, but for an exponent
/// of a denormal, an infinity or NaN, whose lowest bit is flipped.
pub fn matte_id(name: &str) -> f32 {
    let hash = murmur3(name.as_bytes());
    let is_special = matches!(hash >> 23 & 0xff, 0 | 0xff);
    f32::from_bits(if is_special { hash ^ 1 << 23 } else { hash })
}

/// Returns the bits of the float of a name as eight hexadecimal digits.
fn hex(name: &str) -> String {
    format!("{:08x}", matte_id(name).to_bits())
}

impl ChannelImage {
    /// Adds the mattes of a layer, such as `CryptoObject`, with its manifest. `ranks` has
    /// the names that each pixel shows, row by row, as numbers in `names`, with the share of each,
    /// the largest first. The manifest has the names that are seen, and there are as many channels
    /// as the pixel with the most names needs.
    pub fn add_cryptomatte(&mut self, layer: &str, names: &[&str], ranks: &[Vec<(u32, f32)>]) {
        let ids: Vec<f32> = names.iter().map(|name| matte_id(name)).collect();
        let mut is_seen = vec![false; names.len()];
        let seen = ranks.iter().flatten();
        seen.for_each(|(name, _)| is_seen[*name as usize] = true);
        let seen = names.iter().zip(is_seen).filter(|(_, is_seen)| *is_seen);
        let manifest: Map<String, Value> = seen
            .map(|(name, _)| ((*name).to_owned(), Value::String(hex(name))))
            .collect();
        let key = |entry: &str| format!("cryptomatte/{}/{entry}", &hex(layer)[..7]);
        for (entry, value) in [
            ("name", layer.to_owned()),
            ("hash", "MurmurHash3_32".to_owned()),
            ("conversion", "uint32_to_float32".to_owned()),
            ("manifest", Value::Object(manifest).to_string()),
        ] {
            self.provenance.insert(key(entry), value);
        }
        let most = ranks.iter().map(Vec::len).max().unwrap_or(0);
        for pair in 0..most.div_ceil(2).max(1) {
            let channels = ["r", "g", "b", "a"].map(|c| format!("{layer}{pair:02}.{c}"));
            self.add(channels.each_ref().map(String::as_str), |pixel| {
                let rank = |at: usize| match ranks[pixel].get(at) {
                    Some(&(name, share)) => [ids[name as usize], share].map(f64::from),
                    None => [0.0; 2],
                };
                let ([a, b], [c, d]) = (rank(2 * pair), rank(2 * pair + 1));
                [a, b, c, d]
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of the reference implementation with the seed 0, as its test vectors list them.
    #[test]
    fn hashes_are_those_of_the_reference() {
        for (text, hash) in [
            ("", 0),
            ("test", 0xba6b_d213),
            ("Hello, world!", 0xc036_3e43),
            ("The quick brown fox jumps over the lazy dog", 0x2e4f_f723),
        ] {
            assert_eq!(murmur3(text.as_bytes()), hash, "{text}");
        }
    }

    #[test]
    fn every_name_is_a_normal_float_with_the_bits_of_its_hash() {
        let mut special = 0;
        for i in 0..20_000 {
            let name = format!("name {i}");
            let (hash, id) = (murmur3(name.as_bytes()), matte_id(&name));
            assert!(id.is_normal(), "{name}");
            let is_plain = f32::from_bits(hash).is_normal();
            special += u32::from(!is_plain);
            assert_eq!(id.to_bits() ^ hash, if is_plain { 0 } else { 1 << 23 });
        }
        // Of 256 exponents two are special.
        assert!((100..220).contains(&special), "{special}");
    }
}
