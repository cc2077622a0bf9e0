//! Traces a fan of rays through a lens, from the film: `cargo run --example trace_rays -- [LENS]`.
//!
//! Lens space is in millimeters: light from the scene travels toward +z, the first vertex is the
//! origin, and the film is at positive z.

use glam::{DVec2, DVec3};
use ivcam::Lens;
use ivcam::glam;
use ivcam::lens::LensRay;
use ivcam::math::meters;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let name = std::env::args().nth(1).unwrap_or("double-gauss".into());
    let lens = Lens::open(&name)?;
    let first = lens.first_order();
    println!("{name}: focal length {:.2} mm", first.efl());
    if let Some(f_number) = first.f_number() {
        println!("f/{f_number:.2}");
    }
    let focus = lens.focus(Default::default(), meters(2.0))?;
    println!("focused at 2 m with the film at {:.3} mm", focus.film_z);

    let film = DVec2::ZERO.extend(focus.film_z);
    for step in -8..=8 {
        let aim = DVec3::new(0.0, f64::from(step) * first.efl() / 32.0, lens.length());
        let ray = LensRay::new(film, (aim - film).normalize());
        match lens.trace_from_film(&ray) {
            Ok(out) => println!("{:8.3} mm: leaves at {:.3}", aim.y, out.origin),
            Err(loss) => println!("{:8.3} mm: {loss:?}", aim.y),
        }
    }
    Ok(())
}
