//! The time of data sheets of lenses with many surfaces.

use std::fmt::Write as _;
use std::hint::black_box;

use ivcam_optics::lens::{Aberrations, Lens, Prescription, SheetSetting, Surface};
use ivcam_optics::prescription::Medium;

/// Writes the table. `clock` returns the seconds that the calling thread has worked.
pub(in super::super) fn table(report: &mut String, clock: &dyn Fn() -> f64) {
    report.push_str(
        "## Data sheets\n\nSeconds of one thread for a data sheet with all aberrations: the double \
         Gauss with thin plates of glass in front of it.\n\n| surfaces | seconds |\n|---|---|\n",
    );
    for surfaces in [11, 101, 301, 901] {
        let Some(lens) = with_plates(surfaces) else {
            continue;
        };
        let start = clock();
        black_box(Aberrations::with_sheet(&lens, &SheetSetting::default()));
        let _ = writeln!(report, "| {surfaces} | {:.2} |", clock() - start);
    }
}

/// The double Gauss with so many plates in front that it has an odd number of surfaces.
fn with_plates(surfaces: usize) -> Option<Lens> {
    let mut lens = Lens::named("double-gauss").ok()?.prescription().clone();
    let plates = surfaces.saturating_sub(lens.surfaces.len()) / 2;
    let faces = [Medium::constant(1.5168), Medium::air()];
    let face = |medium: &Medium| Surface::sphere(0.0, 0.1, medium.clone(), 40.0);
    let mut all: Vec<Surface> = (0..plates).flat_map(|_| faces.iter().map(face)).collect();
    all.append(&mut lens.surfaces);
    Some(Lens::new(Prescription {
        surfaces: all,
        ..lens
    }))
}
