//! Arithmetic that is the same everywhere, and lengths with units.
//!
//! Inside the crate a length is an `f64` in the unit its module states: millimeters in `lens`,
//! meters in scenes. The types here stand at the borders, where the two meet.

pub mod fourier;
pub mod lanes;
pub mod symmetric;

/// A length in millimeters, the unit of lens prescriptions.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
pub struct Mm(pub f64);

/// A length in meters, the unit of scenes and of the focus distance.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
pub struct Meters(pub f64);

/// A length in millimeters.
pub fn mm(length: f64) -> Mm {
    Mm(length)
}

/// A length in meters.
pub fn meters(length: f64) -> Meters {
    Meters(length)
}

impl From<Meters> for Mm {
    fn from(length: Meters) -> Self {
        Self(1000.0 * length.0)
    }
}

impl From<Mm> for Meters {
    fn from(length: Mm) -> Self {
        Self(length.0 / 1000.0)
    }
}

/// A unit that a written length may carry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LengthUnit {
    Millimeter,
    Centimeter,
    Inch,
    Meter,
}

impl LengthUnit {
    pub fn millimeters(self) -> f64 {
        match self {
            Self::Millimeter => 1.0,
            Self::Centimeter => 10.0,
            Self::Inch => 25.4,
            Self::Meter => 1000.0,
        }
    }

    /// `mm`, `cm`, `in` or `m`, as written after a number.
    pub fn parse(suffix: &str) -> Option<Self> {
        match suffix {
            "mm" | "millimeters" => Some(Self::Millimeter),
            "cm" | "centimeters" => Some(Self::Centimeter),
            "in" | "inch" | "inches" => Some(Self::Inch),
            "m" | "meters" => Some(Self::Meter),
            _ => None,
        }
    }
}

/// Reads `20mm`, `1.2 m`, `2in` or a bare number, which has the unit `bare`. Infinity is a
/// length (a focus distance may be `inf`); NaN is not.
pub fn parse_length(text: &str, bare: LengthUnit) -> Option<Mm> {
    let text = text.trim();
    if let Ok(number) = text.parse::<f64>() {
        return (!number.is_nan()).then_some(Mm(number * bare.millimeters()));
    }
    let letters = text
        .bytes()
        .rev()
        .take_while(u8::is_ascii_alphabetic)
        .count();
    let (number, suffix) = text.split_at(text.len() - letters);
    let number: f64 = number.trim_end().parse().ok()?;
    let unit = LengthUnit::parse(suffix)?;
    (!number.is_nan()).then_some(Mm(number * unit.millimeters()))
}

/// The real roots of `a x² + b x + c`, the smaller first; a linear equation has its root twice.
///
/// The root that would subtract nearly equal numbers is taken from the product of the roots
/// instead, so both keep full precision: with b = 1e9, a = c = 1 the plain formula gives 0.
pub fn quadratic(a: f64, b: f64, c: f64) -> Option<(f64, f64)> {
    if a == 0.0 {
        return (b != 0.0).then(|| (-c / b, -c / b));
    }
    let discriminant = diff_of_products(b, b, 4.0 * a, c);
    if !(discriminant >= 0.0) {
        return None;
    }
    let q = -0.5 * (b + discriminant.sqrt().copysign(b));
    let (x, y) = (q / a, if q == 0.0 { 0.0 } else { c / q });
    Some((x.min(y), x.max(y)))
}

/// `a b − c d` within two units in the last place (Kahan's method).
pub fn diff_of_products(a: f64, b: f64, c: f64, d: f64) -> f64 {
    let cd = c * d;
    let error = (-c).mul_add(d, cd);
    a.mul_add(b, -cd) + error
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_small_root_of_a_stiff_quadratic_survives() {
        let (small, large) = quadratic(1.0, -1e9, 1.0).unwrap();
        assert_eq!((small, large), (1e-9, 1e9));
        assert_eq!(quadratic(1.0, 0.0, 1.0), None);
        assert_eq!(quadratic(0.0, 2.0, -1.0), Some((0.5, 0.5)));
        assert_eq!(quadratic(1.0, 0.0, 0.0), Some((0.0, 0.0)));
    }

    #[test]
    fn a_bare_length_has_the_unit_of_its_flag() {
        assert_eq!(parse_length("1.2", LengthUnit::Meter), Some(Mm(1200.0)));
        assert_eq!(parse_length("20mm", LengthUnit::Meter), Some(Mm(20.0)));
        assert_eq!(parse_length("2 in", LengthUnit::Meter), Some(Mm(50.8)));
        assert_eq!(
            parse_length("inf", LengthUnit::Meter),
            Some(Mm(f64::INFINITY))
        );
        assert_eq!(parse_length("5 furlongs", LengthUnit::Meter), None);
        assert_eq!(parse_length("nan", LengthUnit::Meter), None);
    }
}
