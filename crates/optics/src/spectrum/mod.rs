//! Wavelengths and colors: what light of one wavelength adds to a picture.
//!
//! A scene has RGB colors. For glass with dispersion its light must be converted to a spectrum, and
//! back to colors on the film:
//!
//! * A color has the spectrum Σ color_j · basis_j(λ) · D65(λ). The three basis functions are smooth
//!   bands (blue below 490 nm, red above 590 nm), mixed so that each returns its own color. They
//!   add up to 1, so that white is daylight, and none falls below −0.005.
//! * The response is that of the CIE 1931 standard observer (2 degrees) by the fit of Wyman, Sloan
//!   and Shirley, "Simple Analytic Approximations to the CIE XYZ Color Matching Functions", JCGT
//!   2(2), 2013. It is converted to linear sRGB.
//!
//! The product of the two at a wavelength is a 3×3 matrix on colors, whose integral is the
//! identity. A sample has four wavelengths, a *hero set* (Wilkie et al., "Hero Wavelength Spectral
//! Sampling", 2014). Here each set's matrices add up to the identity within rounding: if a lens has
//! no dispersion, a sample has the color of the scene, without noise.

mod hero;

pub use hero::{HERO, MAIN, OTHERS, RGB_FROM_XYZ, SETS, SpectralLine, Spectrum};
