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
    /// `ft`.
    Foot,
    /// `yd`.
    Yard,
    /// `m`.
    Meter,
    /// `km`.
    Kilometer,
    /// `mi`.
    Mile,
}

impl LengthUnit {
    /// The unit's length in millimeters.
    pub fn millimeters(self) -> f64 {
        match self {
            Self::Millimeter => 1.0,
            Self::Centimeter => 10.0,
            Self::Inch => 25.4,
            Self::Foot => 304.8,
            Self::Yard => 914.4,
            Self::Meter => 1000.0,
            Self::Kilometer => 1e6,
            Self::Mile => 1_609_344.0,
        }
    }

    /// The unit with an abbreviation (`mm`, `cm`, `in`, `ft`, `yd`, `m`, `km` or `mi`), a sign (`'`
    /// or `"`) or an English name.
    pub fn parse(suffix: &str) -> Option<Self> {
        match suffix {
            "mm" | "millimeters" => Some(Self::Millimeter),
            "cm" | "centimeters" => Some(Self::Centimeter),
            "in" | "inch" | "inches" | "\"" | "″" => Some(Self::Inch),
            "ft" | "foot" | "feet" | "'" | "′" => Some(Self::Foot),
            "yd" | "yard" | "yards" => Some(Self::Yard),
            "m" | "meter" | "meters" => Some(Self::Meter),
            "km" | "kilometer" | "kilometers" => Some(Self::Kilometer),
            "mi" | "mile" | "miles" => Some(Self::Mile),
            _ => None,
        }
    }
}

/// Parses a length such as `20mm`, `1.2 m`, `2in`, `5'6"` or `5ft 6in`. A number without a unit has
/// the unit `bare`. Infinity is accepted, because a focus distance may be `inf`; NaN is not.
pub fn parse_length(text: &str, bare: LengthUnit) -> Option<Mm> {
    let text = text.trim();
    if let Ok(number) = text.parse::<f64>() {
        return (!number.is_nan()).then_some(Mm(number * bare.millimeters()));
    }
    match text.split_once(['\'', '′']).or(text.split_once("ft")) {
        Some((feet, inches)) if !inches.trim().is_empty() => {
            let feet: f64 = feet.trim_end().parse().ok().filter(|x| *x >= 0.0)?;
            let inches = measured(inches.trim()).filter(|(_, unit)| *unit == LengthUnit::Inch)?;
            let inches = Some(inches.0).filter(|x| (0.0..12.0).contains(x))?;
            Some(Mm((12.0 * feet + inches) * LengthUnit::Inch.millimeters()))
        }
        _ => measured(text).map(|(number, unit)| Mm(number * unit.millimeters())),
    }
}

/// Splits a number and its unit.
fn measured(text: &str) -> Option<(f64, LengthUnit)> {
    let is_unit = |c: &char| c.is_alphabetic() || "'\"′″".contains(*c);
    let unit: usize = text
        .chars()
        .rev()
        .take_while(is_unit)
        .map(char::len_utf8)
        .sum();
    let (number, suffix) = text.split_at(text.len() - unit);
    let number: f64 = number.trim_end().parse().ok()?;
    (!number.is_nan()).then_some((number, LengthUnit::parse(suffix)?))
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
        for (text, inches) in [
            ("5'6\"", 66.0),
            ("5' 6in", 66.0),
            ("5ft 6.5in", 66.5),
            ("6'", 72.0),
            ("6ft", 72.0),
            ("2 yards", 72.0),
            ("1mi", 63_360.0),
        ] {
            let length = parse_length(text, LengthUnit::Meter).expect("a length").0;
            assert!(
                (length / (25.4 * inches) - 1.0).abs() < 1e-15,
                "{text}: {length}"
            );
        }
        assert_eq!(parse_length("2km", LengthUnit::Meter), Some(Mm(2e6)));
        for wrong in [
            "5 furlongs",
            "5'6",
            "5'6m",
            "5'13\"",
            "'6\"",
            "6''",
            "\"",
            "-5'6\"",
        ] {
            assert_eq!(parse_length(wrong, LengthUnit::Meter), None, "{wrong}");
        }
        assert_eq!(parse_length("nan", LengthUnit::Meter), None);
    }
}
