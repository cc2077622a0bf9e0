//! Wavelengths and colors: what light of one wavelength adds to a picture.
//!
//! A scene is of RGB colors. Through glass with dispersion its light has to be taken apart into
//! wavelengths and put together again on the film:
//!
//! * a color has the spectrum Σ color_j · basis_j(λ) · D65(λ). The three basis functions are
//!   smooth bands (blue below 490 nm, red above 590 nm) mixed so that each returns its own color;
//!   together they are 1, so white is daylight, and none falls below −0.005;
//! * the eye's answer is CIE 1931 (2 degrees) by the fit of Wyman, Sloan and Shirley, "Simple
//!   Analytic Approximations to the CIE XYZ Color Matching Functions", JCGT 2(2), 2013, and goes
//!   to linear light of sRGB's primaries.
//!
//! The product of the two at a wavelength is a 3×3 matrix on colors, whose integral is the
//! identity. A sample sees four wavelengths at once, a *hero set* (Wilkie et al., "Hero
//! Wavelength Spectral Sampling", 2014). Here each set's matrices sum to the identity, to
//! rounding: where a lens has no dispersion a sample has the color of the scene, without noise.

mod hero;

pub(crate) use hero::{HERO, Line, SETS, Spectrum};
