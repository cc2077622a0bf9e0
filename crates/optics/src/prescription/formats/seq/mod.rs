//! CODE V's sequence files: commands, split by line ends and semicolons, continued by `&`.
//!
//! `S` begins a surface: radius (or curvature, after `RDM N`), thickness, glass. What follows
//! belongs to it: STO, CIR (a semi-diameter), REX, REY, ELX and ELY with ADX, ADY and ARO (other
//! apertures), CON and ASP with K and A to J, CYL, and RDY, CUY, THI and GLA, which change it; with
//! a surface behind the name (`CIR S3 9`, `STO S1..1`) to that one. Glasses are catalogue names
//! with their maker behind an underscore, six-digit codes (`517642`), or private tables (PRV). What
//! tilts, reflects or diffracts is refused by name.

mod apertures;
mod glasses;
mod reader;
mod surfaces;
#[cfg(test)]
mod tests;
mod zoom;

pub(crate) use reader::FORMAT;
