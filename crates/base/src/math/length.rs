//! Lengths with units, for interfaces between code in millimeters and code in meters.

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

/// A unit of length in text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum LengthUnit {
    /// `mm`.
    Millimeter,
    /// `cm`.
    Centimeter,
    /// `in`.
    Inch,
    /// `m`.
    Meter,
}

impl LengthUnit {
    /// The unit's length in millimeters.
    pub fn millimeters(self) -> f64 {
        match self {
            Self::Millimeter => 1.0,
            Self::Centimeter => 10.0,
            Self::Inch => 25.4,
            Self::Meter => 1000.0,
        }
    }

    /// The unit with an abbreviation (`mm`, `cm`, `in` or `m`) or an English name.
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

/// Parses a length such as `20mm`, `1.2 m` or `2in`. A number without a unit has the unit `bare`.
/// Infinity is accepted, because a focus distance may be `inf`; NaN is not.
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

#[cfg(test)]
mod tests {
    use super::*;

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
