//! The functions and constants of the language.

use glam::DVec3;

use super::program::{Function, Val};

macro_rules! functions {
    ($($name:literal $count:literal ($($arg:ident: $kind:ident),*) => $out:ident $body:expr;)*) => {
        pub(crate) static FUNCTIONS: &[Function] = &[$(Function {
            name: $name,
            arguments: $count,
            apply: |values, _| match values {
                [$(Val::$kind($arg)),*] => {
                    $(let $arg = *$arg;)*
                    Some(Val::$out($body))
                }
                _ => None,
            },
        }),*];
    };
}

functions! {
    "cos" 1 (x: Number) => Number libm::cos(x);
    "sin" 1 (x: Number) => Number libm::sin(x);
    "tan" 1 (x: Number) => Number libm::tan(x);
    "acos" 1 (x: Number) => Number libm::acos(x);
    "asin" 1 (x: Number) => Number libm::asin(x);
    "atan" 1 (x: Number) => Number libm::atan(x);
    "atan2" 2 (y: Number, x: Number) => Number libm::atan2(y, x);
    "cosh" 1 (x: Number) => Number libm::cosh(x);
    "sinh" 1 (x: Number) => Number libm::sinh(x);
    "tanh" 1 (x: Number) => Number libm::tanh(x);
    "sqrt" 1 (x: Number) => Number x.sqrt();
    "pow" 2 (x: Number, y: Number) => Number libm::pow(x, y);
    "exp" 1 (x: Number) => Number libm::exp(x);
    "log" 1 (x: Number) => Number libm::log(x);
    "log10" 1 (x: Number) => Number libm::log10(x);
    "ceil" 1 (x: Number) => Number x.ceil();
    "floor" 1 (x: Number) => Number x.floor();
    "fabs" 1 (x: Number) => Number x.abs();
    "abs" 1 (x: Number) => Number x.abs();
    "fmod" 2 (x: Number, y: Number) => Number libm::fmod(x, y);
    "cross" 2 (a: Vector, b: Vector) => Vector a.cross(b);
    "dot" 2 (a: Vector, b: Vector) => Number a.dot(b);
    "length" 1 (v: Vector) => Number v.length();
    "normalize" 1 (v: Vector) => Vector v.normalize_or_zero();
    "vec3f" 3 (x: Number, y: Number, z: Number) => Vector DVec3::new(x, y, z);
}

/// The function `rand`, which returns a number from 0 to its argument. The numbers are the same in
/// every run.
pub(super) static RANDOM: Function = Function {
    name: "rand",
    arguments: 1,
    apply: |values, draws| match values {
        [Val::Number(most)] => {
            *draws = draws.wrapping_add(1);
            let mut bits = draws.wrapping_mul(0x9e37_79b9);
            bits = (bits ^ (bits >> 16)).wrapping_mul(0x85eb_ca6b);
            bits = (bits ^ (bits >> 13)).wrapping_mul(0xc2b2_ae35);
            bits ^= bits >> 16;
            Some(Val::Number(most * f64::from(bits) / 4_294_967_296.0))
        }
        _ => None,
    },
};

/// Returns the value of a named constant.
pub(super) fn constant(name: &str) -> Option<f64> {
    use std::f64::consts as c;
    Some(match name {
        "MAXFLOAT" => f64::from(f32::MAX),
        "MINFLOAT" => f64::from(f32::MIN_POSITIVE),
        "M_E" => c::E,
        "M_LOG2E" => c::LOG2_E,
        "M_LOG10E" => c::LOG10_E,
        "M_LN2" => c::LN_2,
        "M_LN10" => c::LN_10,
        "M_PI" => c::PI,
        "M_TWOPI" => c::TAU,
        "M_PI_2" => c::FRAC_PI_2,
        "M_PI_4" => c::FRAC_PI_4,
        "M_1_PI" => c::FRAC_1_PI,
        "M_2_PI" => c::FRAC_2_PI,
        "M_2_SQRTPI" => c::FRAC_2_SQRT_PI,
        "M_SQRT2" => c::SQRT_2,
        "M_SQRT1_2" => c::FRAC_1_SQRT_2,
        "M_RAD" => c::PI / 180.0,
        "M_DEG" => 180.0 / c::PI,
        _ => return None,
    })
}
