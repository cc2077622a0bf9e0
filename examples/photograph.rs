//! Photographs a scene through a lens: `cargo run --release --example photograph -- SCENE PICTURE`.
//!
//! The camera is the scene's own, or one that sees everything.

use ivcam::math::mm;
use ivcam::photo::LensChoice;
use ivcam::render::Stop;
use ivcam::{Era, Optics, Plan, Session};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let (Some(scene), Some(output)) = (arguments.next(), arguments.next()) else {
        return Err("usage: photograph SCENE PICTURE".into());
    };
    let mut plan = Plan::of_era(Era::Modern, scene);
    plan.optics = Optics::Lens(LensChoice {
        efl: Some(mm(50.0)),
        ..LensChoice::named("double-gauss")
    });
    plan.stop = Stop::after(64);

    let session = Session::open(plan)?;
    for message in session.sink.items() {
        eprintln!("{message}");
    }
    for notice in session.notices() {
        eprintln!("{notice}");
    }
    let exposure = session.expose(&|_progress| {});
    if let Ok(error) = exposure.film.error() {
        println!(
            "relative error of the picture: {:.1}%",
            100.0 * error.relative_rmse
        );
    }
    let picture = session.develop(&exposure, "the example photograph");
    picture.save(output, session.plan.depth)?;
    Ok(())
}
