//! An archival picture beside the live one.

use egui::accesskit::Role;
use ivcam_optics::film::Resolution;

use super::bench::{Bench, Scratch, exposed};
use super::raster;
use crate::photo::Optics;
use crate::viewer::archive::ArchiveMode;

#[test]
fn an_archival_picture_is_blinked_wiped_and_blended() {
    let mut bench = Bench::open("archive");
    let old = bench.scratch.path("old.png");
    image::RgbImage::from_pixel(12, 8, image::Rgb([250, 10, 10]))
        .save(&old)
        .unwrap();
    bench.change(|m| m.take_file(&old));
    assert_eq!(bench.model().archive.mode, ArchiveMode::Wipe);
    for (mode, name) in ArchiveMode::ALL {
        bench.click(name);
        assert_eq!(bench.model().archive.mode, mode);
        match mode {
            ArchiveMode::Wipe => bench.put(Role::Slider, "line", 0.25),
            ArchiveMode::Onion => bench.put(Role::Slider, "opacity", 0.75),
            ArchiveMode::Off | ArchiveMode::Blink => {}
        }
    }
    let archive = &bench.model().archive;
    assert_eq!((archive.line, archive.opacity), (0.25, 0.75));
    bench.click("Onion skin");
    // In the blend, the picture's red increases where it was dark.
    let middle = bench.at(0.1, 0.1);
    let red = |bench: &Bench| {
        let canvas =
            raster::Canvas::draw(&bench.harness.ctx, bench.harness.output(), &bench.textures);
        canvas.pixels[middle.y as usize * canvas.width + middle.x as usize]
    };
    let with = red(&bench);
    bench.click("Off");
    let without = red(&bench);
    assert!(
        with[0] > without[0] + 0.2 && with[1] < without[1] + 0.05,
        "{with:?} {without:?}"
    );
}

/// The old picture is twice as large as the live one, has a border, and is shifted in it.
#[test]
fn an_archival_picture_is_aligned_with_the_live_one() {
    let scratch = Scratch::new("align");
    let mut plan = scratch.plan();
    plan.optics = Optics::Pinhole;
    plan.resolution = Resolution::of(120, 80);
    let (_, frame) = exposed(&plan, 8);
    let levels = crate::viewer::develop::levels(&frame, 1.0, &plan.response);
    let picture = image::RgbImage::from_raw(120, 80, levels.clone()).unwrap();
    let large =
        image::imageops::resize(&picture, 240, 160, image::imageops::FilterType::CatmullRom);
    let mut old = image::RgbImage::from_pixel(300, 230, image::Rgb([128; 3]));
    image::imageops::overlay(&mut old, &large, 40, 20);
    let path = scratch.path("old.png");
    old.save(&path).unwrap();

    let mut archive = crate::viewer::archive::Archive::default();
    archive.load(&path).unwrap();
    assert_eq!(archive.aspect(), Some(300.0 / 230.0));
    let job = archive.alignment_job(frame.resolution, || levels.clone());
    let aligned = job.unwrap().run().unwrap();
    assert!(
        (aligned.alignment.scale - 0.5).abs() < 0.005,
        "{:?}",
        aligned.alignment
    );
    assert_eq!(aligned.levels.size, [120, 80]);
    let pixels = aligned
        .levels
        .rgba
        .chunks_exact(4)
        .zip(levels.chunks_exact(3));
    let (mut covered, mut difference) = (0, 0.0);
    for (old, new) in pixels.filter(|(old, _)| old[3] == 255) {
        covered += 1;
        difference += (0..3)
            .map(|c| f64::from(old[c].abs_diff(new[c])))
            .sum::<f64>()
            / 3.0;
    }
    assert!(covered > 9000, "{covered} of 9600 pixels");
    assert!(
        difference / f64::from(covered) < 2.0,
        "{difference} levels in all"
    );
    archive.align_done(archive.version, Ok(aligned));
    assert_eq!(archive.aspect(), Some(1.5));
}
