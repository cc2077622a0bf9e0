//! Parses numbers. The loops are written by hand, because most of a large file is numbers. Each
//! public function is a nom parser.

use nom::Parser;
use nom::combinator::map_opt;

use super::syntax_error::{Parsed, Problem, fail, or};
use super::tokens::def_name;

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
    let mut i = 0;
    let negative = input.first() == Some(&b'-');
    if matches!(input.first(), Some(b'-' | b'+')) {
        i = 1;
    }
    let (mut digits, mut seen, mut significant, mut exponent) = (0u64, 0usize, 0u32, 0i32);
    while let Some(d) = input
        .get(i)
        .map(|b| b.wrapping_sub(b'0'))
        .filter(|&d| d < 10)
    {
        digits = digits.wrapping_mul(10).wrapping_add(u64::from(d));
        significant += u32::from(digits != 0);
        seen += 1;
        i += 1;
    }
    if input.get(i) == Some(&b'.') {
        i += 1;
        while let Some(d) = input
            .get(i)
            .map(|b| b.wrapping_sub(b'0'))
            .filter(|&d| d < 10)
        {
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
        while let Some(d) = input
            .get(k)
            .map(|b| b.wrapping_sub(b'0'))
            .filter(|&d| d < 10)
        {
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
        if n.to_bits() & 0x1fff_ffff != 0x1000_0000
            && (n == 0.0 || n.abs() >= f64::from(f32::MIN_POSITIVE))
        {
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
