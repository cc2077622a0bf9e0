//! Parses numbers. The loops are written by hand, because most of a large file is numbers. Each
//! public function is a nom parser.

use nom::Parser;
use nom::combinator::map_opt;

use super::syntax_error::{Parsed, Problem, fail, or};
use super::tokens::def_name;

/// Returns the number of digits at the start of the input, eight at most, and their value, if there
/// are eight bytes of input. All bytes are processed together, without branches that depend on the
/// length: with a loop over digits, reading takes half as long again.
#[inline(always)]
fn up_to_eight_digits(input: &[u8]) -> Option<(usize, u64)> {
    let bytes = u64::from_le_bytes(*input.first_chunk()?) ^ 0x3030_3030_3030_3030;
    // A digit is now from 0 to 9, so neither it nor its sum with 6 has one of these bits. The sum
    // of another byte may change later bytes only.
    let others = (bytes | bytes.wrapping_add(0x0606_0606_0606_0606)) & 0xf0f0_f0f0_f0f0_f0f0;
    let count = (others.trailing_zeros() / 8) as usize;
    // The digits move to the end of eight, after zeros; then pairs are added, and fours of pairs.
    let digits = bytes.checked_shl(64 - 8 * count as u32).unwrap_or(0);
    let pairs = digits.wrapping_mul(10).wrapping_add(digits >> 8);
    let (even, odd) = (pairs & 0xff_0000_00ff, (pairs >> 16) & 0xff_0000_00ff);
    let upper = even.wrapping_mul(100 + (1_000_000 << 32));
    let lower = odd.wrapping_mul(1 + (10_000 << 32));
    Some((count, upper.wrapping_add(lower) >> 32))
}

/// Returns the number of digits at the start of the input and their value, if there are less than
/// eight and eight bytes of input.
#[inline(always)]
fn few_digits(input: &[u8]) -> Option<(usize, u64)> {
    up_to_eight_digits(input).filter(|&(count, _)| count < 8)
}

/// Returns the same as [`few_digits`] for less than sixteen digits.
#[inline(always)]
fn digits_of_fraction(input: &[u8]) -> Option<(usize, u64)> {
    let (count, upper) = up_to_eight_digits(input)?;
    if count < 8 {
        return Some((count, upper));
    }
    let (more, lower) = few_digits(&input[8..])?;
    Some((8 + more, upper * SMALL_TENS[more] + lower))
}

/// Parses a number without an exponent of at most seven digits before the point and fifteen in all,
/// which an `f64` represents exactly.
#[inline(always)]
fn short_float(input: &[u8]) -> Option<(&[u8], f32)> {
    let negative = *input.first()? == b'-';
    let input = &input[usize::from(negative)..];
    let (whole, mut digits) = few_digits(input)?;
    let (mut rest, mut part) = (&input[whole..], 0);
    if let Some((b'.', after)) = rest.split_first() {
        let below;
        (part, below) = digits_of_fraction(after)?;
        if whole + part > 15 {
            return None;
        }
        digits = digits * SMALL_TENS[part] + below;
        rest = &after[part..];
    }
    if whole + part == 0 || matches!(rest.first(), Some(b'e' | b'E' | b'#')) {
        return None;
    }
    let n = digits as f64 / TENS[part];
    let n = if negative { -n } else { n };
    (!is_halfway(n)).then_some((rest, n as f32))
}

/// Whether an `f64` is exactly halfway between two `f32`.
#[inline(always)]
fn is_halfway(n: f64) -> bool {
    n.to_bits() & 0x1fff_ffff == 0x1000_0000
}

/// A decimal number before rounding: digits · 10^exponent.
struct Decimal {
    /// The number of bytes of its text.
    length: usize,
    negative: bool,
    digits: u64,
    exponent: i32,
    /// Whether the number has more digits than a `u64` can represent.
    long: bool,
}

/// Scans a decimal number at the start of the input.
#[inline]
fn decimal(input: &[u8]) -> Option<Decimal> {
    let digit = |at: usize| Some(input.get(at)?.wrapping_sub(b'0')).filter(|&d| d < 10);
    let mut i = 0;
    let negative = input.first() == Some(&b'-');
    if matches!(input.first(), Some(b'-' | b'+')) {
        i = 1;
    }
    let (mut digits, mut seen, mut significant, mut exponent) = (0u64, 0usize, 0u32, 0i32);
    while let Some(d) = digit(i) {
        digits = digits.wrapping_mul(10).wrapping_add(u64::from(d));
        significant += u32::from(digits != 0);
        seen += 1;
        i += 1;
    }
    if input.get(i) == Some(&b'.') {
        i += 1;
        while let Some(d) = digit(i) {
            digits = digits.wrapping_mul(10).wrapping_add(u64::from(d));
            significant += u32::from(digits != 0);
            exponent -= 1;
            seen += 1;
            i += 1;
        }
    }
    if seen == 0 {
        return None;
    }
    if matches!(input.get(i), Some(b'e' | b'E')) {
        let mut k = i + 1;
        let down = input.get(k) == Some(&b'-');
        if matches!(input.get(k), Some(b'-' | b'+')) {
            k += 1;
        }
        let first = k;
        let mut e = 0i32;
        while let Some(d) = digit(k) {
            e = e.saturating_mul(10).saturating_add(i32::from(d));
            k += 1;
        }
        if k > first {
            exponent = exponent.saturating_add(if down { -e } else { e });
            i = k;
        }
    }
    Some(Decimal {
        length: i,
        negative,
        digits,
        exponent,
        long: significant > 19,
    })
}

/// The powers of ten that an `f64` represents exactly.
static TENS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];

/// The powers of ten by which [`short_float`] moves digits.
static SMALL_TENS: [u64; 16] = {
    let mut tens = [1; 16];
    let mut i = 1;
    while i < 16 {
        tens[i] = 10 * tens[i - 1];
        i += 1;
    }
    tens
};

impl Decimal {
    /// Returns the nearest `f64` if one operation on exact operands computes it. This is Clinger's
    /// fast path (How to Read Floating Point Numbers Accurately, 1990).
    #[inline]
    fn exact(&self) -> Option<f64> {
        if self.long || self.digits >= 1 << 53 || self.exponent.unsigned_abs() > 22 {
            return None;
        }
        let ten = TENS[self.exponent.unsigned_abs() as usize];
        let n = self.digits as f64;
        let n = if self.exponent < 0 { n / ten } else { n * ten };
        Some(if self.negative { -n } else { n })
    }
}

/// Parses a number in single precision: `1`, `+1`, `1.`, `.5`, `-1e-3`, `nan`, `inf`, `-1.#IND`.
#[inline]
pub(super) fn float(input: &[u8]) -> Parsed<'_, f32> {
    match short_float(input) {
        Some(found) => Ok(found),
        None => long_float(input),
    }
}

#[inline(never)]
fn long_float(input: &[u8]) -> Parsed<'_, f32> {
    let Some(d) = decimal(input) else {
        return nan_or_infinity(input).map(|(rest, n)| (rest, n as f32));
    };
    let rest = &input[d.length..];
    if let [b'#', ..] = rest
        && let Some((rest, n)) = microsoft(d.negative, rest)
    {
        return Ok((rest, n as f32));
    }
    if let Some(n) = d.exact() {
        // Rounding twice can be wrong only if the `f64` is exactly halfway between two `f32`.
        if !is_halfway(n) && (n == 0.0 || n.abs() >= f64::from(f32::MIN_POSITIVE)) {
            return Ok((rest, n as f32));
        }
    }
    let slow = std::str::from_utf8(&input[..d.length])
        .ok()
        .and_then(|s| s.parse().ok());
    Ok((rest, slow.unwrap_or(0.0)))
}

/// Parses a number in double precision, in the same spellings as [`float`].
pub(super) fn double(input: &[u8]) -> Parsed<'_, f64> {
    let Some(d) = decimal(input) else {
        return nan_or_infinity(input);
    };
    let rest = &input[d.length..];
    if let Some(found) = microsoft(d.negative, rest) {
        return Ok(found);
    }
    let slow = || {
        std::str::from_utf8(&input[..d.length])
            .ok()
            .and_then(|s| s.parse().ok())
    };
    Ok((rest, d.exact().or_else(slow).unwrap_or(0.0)))
}

/// Parses NaN or infinity in any of the spellings that `printf` implementations write.
#[cold]
fn nan_or_infinity(input: &[u8]) -> Parsed<'_, f64> {
    let odd = map_opt(def_name, |token: &[u8]| {
        let lower = String::from_utf8_lossy(token).to_lowercase();
        let (sign, name) = match lower.strip_prefix('-') {
            Some(name) => (-1.0, name),
            None => (1.0, lower.trim_start_matches('+')),
        };
        match name {
            "inf" | "infinity" => Some(sign * f64::INFINITY),
            _ if name.starts_with("nan") => Some(f64::NAN.copysign(sign)),
            _ => None,
        }
    });
    or(Problem::Expected("a number"), odd)(input)
}

/// Parses what follows `1.` in the NaN and infinity of Microsoft's C library before 2015:
/// `-1.#IND`, `1.#INF00`, `1.#QNAN`.
#[cold]
fn microsoft(negative: bool, rest: &[u8]) -> Option<(&[u8], f64)> {
    let sign = if negative { -1.0 } else { 1.0 };
    let spellings: [(&[u8], f64); 4] = [
        (b"#INF", f64::INFINITY),
        (b"#IND", f64::NAN),
        (b"#QNAN", f64::NAN),
        (b"#SNAN", f64::NAN),
    ];
    let (name, value) = spellings.into_iter().find(|(name, _)| {
        rest.get(..name.len())
            .is_some_and(|start| start.eq_ignore_ascii_case(name))
    })?;
    let rest = &rest[name.len()..];
    let zeros = rest.iter().take_while(|b| **b == b'0').count();
    Some((&rest[zeros..], value * sign))
}

/// Parses an integer: decimal, hexadecimal with `0x`, or octal with a leading 0, as in C. A decimal
/// number with a fraction is truncated.
#[inline]
pub(super) fn integer(input: &[u8]) -> Parsed<'_, i64> {
    match short_integer(input) {
        Some(found) => Ok(found),
        None => long_integer(input),
    }
}

/// Parses a decimal integer of at most seven digits.
#[inline(always)]
fn short_integer(input: &[u8]) -> Option<(&[u8], i64)> {
    let negative = *input.first()? == b'-';
    let digits = &input[usize::from(negative)..];
    let (count, n) = few_digits(digits)?;
    let rest = &digits[count..];
    let is_octal = count > 1 && digits[0] == b'0';
    if count == 0 || is_octal || matches!(rest.first(), Some(b'.' | b'e' | b'E' | b'x' | b'X')) {
        return None;
    }
    Some((rest, if negative { -(n as i64) } else { n as i64 }))
}

#[inline(never)]
fn long_integer(input: &[u8]) -> Parsed<'_, i64> {
    let signed = matches!(input.first(), Some(b'-' | b'+'));
    let digits = &input[usize::from(signed)..];
    let (radix, digits) = match digits {
        [b'0', b'x' | b'X', rest @ ..] => (16, rest),
        [b'0', b'0'..=b'7', ..] => (8, digits),
        _ => (10, digits),
    };
    let (mut n, mut i) = (0i64, 0);
    while let Some(d) = digits.get(i).and_then(|&b| char::from(b).to_digit(radix)) {
        n = n
            .saturating_mul(i64::from(radix))
            .saturating_add(i64::from(d));
        i += 1;
    }
    let rest = &digits[i..];
    if i == 0 || (radix != 16 && matches!(rest.first(), Some(b'.' | b'e' | b'E' | b'8' | b'9'))) {
        return match double(input) {
            Ok((rest, n)) if n.abs() < 9e15 => Ok((rest, n as i64)),
            _ => fail(input, Problem::Expected("an integer")),
        };
    }
    Ok((rest, if input[0] == b'-' { -n } else { n }))
}

/// Parses an integer of 32 bits. Values above 2^31 − 1 wrap, so that `0xffffffff` is −1.
#[inline]
pub(super) fn int32(input: &[u8]) -> Parsed<'_, i32> {
    let (rest, n) = integer(input)?;
    if n < i64::from(i32::MIN) || n > i64::from(u32::MAX) {
        return fail(input, Problem::MoreThan32Bits);
    }
    Ok((rest, n as i32))
}

/// Parses an unsigned integer of 32 bits. Negative values wrap, so that −1 is `0xffffffff`.
#[inline]
pub(super) fn uint32(input: &[u8]) -> Parsed<'_, u32> {
    int32.map(|n| n as u32).parse(input)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The fast ways and the general ones read the same from the same bytes.
    #[test]
    fn a_short_number_is_read_as_a_long_one() {
        let starts = [
            "", "-", "+", "0", "00", "0x", "7", "08", "12", "-345", "9999999", "12345678",
        ];
        let middles = [
            "",
            ".",
            ".0",
            ".5",
            ".25000",
            ".1234567",
            ".12345678",
            ".00000001",
            ".99999999999999",
            ".123456789012345",
            ".1234567890123456",
            "e3",
            ".5e-2",
            "#",
        ];
        let ends = [
            " ",
            ",",
            "]",
            "e",
            "E+",
            "x",
            "#INF",
            " 1 2 3 4 5 6 7 8",
            "\u{e9}\u{e9}\u{e9}\u{e9}",
        ];
        let mut short = 0;
        for (start, middle) in starts
            .iter()
            .flat_map(|s| middles.iter().map(move |m| (s, m)))
        {
            for end in ends {
                let text = format!("{start}{middle}{end}");
                for padded in [text.clone(), format!("{text}            ")] {
                    let input = padded.as_bytes();
                    short += u32::from(short_float(input).is_some());
                    let bits =
                        |n: Parsed<'_, f32>| n.ok().map(|(rest, n)| (rest.len(), n.to_bits()));
                    assert_eq!(bits(float(input)), bits(long_float(input)), "{padded}");
                    let whole = |n: Parsed<'_, i64>| n.ok().map(|(rest, n)| (rest.len(), n));
                    assert_eq!(
                        whole(integer(input)),
                        whole(long_integer(input)),
                        "{padded}"
                    );
                }
            }
        }
        assert!(short > 500, "{short}");
        for n in 0..10_000_000 / 7 {
            let text = format!("{} ........", 7 * n);
            assert_eq!(few_digits(text.as_bytes()), Some((text.len() - 9, 7 * n)));
        }
        for n in 0..1_000_000u64 {
            let text = format!("{:012} ........", 999_983 * n);
            let found = digits_of_fraction(text.as_bytes());
            assert_eq!(found, Some((12, 999_983 * n)));
        }
    }
}
