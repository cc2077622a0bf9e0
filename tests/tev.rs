//! `--tev`: the pictures that a viewer receives over a socket of this machine.

#[path = "common/pixels.rs"]
mod pixels;
#[path = "common/scratch.rs"]
mod scratch;
#[path = "common/viewer.rs"]
mod viewer;

use std::net::TcpListener;

use pixels::pixels;
use scratch::{Scratch, must_fail, stderr};
use viewer::Viewer;

const SCENE: &str = "#Inventor V2.1 ascii\nPerspectiveCamera { position 0 0 4 focalDistance 4 }\n\
    PointLight { location 2 3 4 } Sphere { } Translation { translation 1 .4 .5 } Cube { width .5 }\n";

/// Makes a folder with the scene.
fn room(name: &str) -> Scratch {
    Scratch::new(&format!("tev-{name}"), "room.iv", SCENE)
}

#[test]
fn the_viewer_shows_the_picture_that_is_written() {
    let scratch = room("same");
    // The state at the end of the render and the picture, and states before that.
    for (options, size, least) in [
        ("--samples 9 --size 26x17", (26, 17), 2),
        (
            "--samples 150 --adaptive --checkpoint a.ckpt --size 26x17",
            (26, 17),
            2,
        ),
        ("--samples 64 --target-error 20% --size 26x17", (26, 17), 2),
        (
            "--region 3,5,20,11 --ghosts on --lens double-gauss --samples 4 --size 26x17",
            (20, 11),
            2,
        ),
        ("--time 2s --samples 100000 --size 40x30", (40, 30), 3),
    ] {
        let viewer = Viewer::start(usize::MAX);
        let address = &viewer.address;
        let output = scratch.ivcam(&format!(
            "render room.iv {options} --tev {address} -o a.exr"
        ));
        assert!(output.status.success(), "{}", stderr(&output));
        let shown = viewer.shown();
        assert_eq!(shown.name, "a.exr");
        assert_eq!((shown.width, shown.height), size);
        assert!(shown.states >= least, "{options}: {}", shown.states);
        let written = pixels(&scratch.0.join("a.exr"));
        for (values, name) in shown.channels() {
            let (_, channel) = written.iter().find(|(n, _)| n == name).unwrap();
            assert!(values == *channel);
            assert!(values.iter().any(|v| *v > 0.0));
        }
    }
}

#[test]
fn a_render_goes_on_with_the_same_bits_without_its_viewer() {
    let scratch = room("gone");
    let line = "render room.iv --size 64x40 --samples 64";
    assert!(
        scratch
            .ivcam(&format!("{line} -o once.exr"))
            .status
            .success()
    );
    for packets in [0, 1, 3] {
        let viewer = Viewer::start(packets);
        let output = scratch.ivcam(&format!("{line} --tev {} -o a.exr", viewer.address));
        let said = stderr(&output);
        assert!(output.status.success(), "{said}");
        let lost = "warning: the connection to tev has broken";
        assert_eq!(said.matches(lost).count(), 1, "{said}");
        let [once, again] = ["once.exr", "a.exr"].map(|name| pixels(&scratch.0.join(name)));
        assert!(once == again);
    }
}

#[test]
fn a_render_without_a_viewer_does_not_begin() {
    let scratch = room("none");
    let free = TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap();
    let viewer = TcpListener::bind("127.0.0.1:0").unwrap();
    let open = viewer.local_addr().unwrap();
    for (words, text) in [
        (
            format!("room.iv --tev {free}"),
            "there is no connection to tev",
        ),
        (
            "room.iv --tev nowhere".into(),
            "`--tev nowhere`: there is no connection",
        ),
        (
            format!("room.iv --size 8000x8000 --memory 64MB --tev {open}"),
            "`--tev` needs the whole film at once",
        ),
        (format!(". --tev {open} -o out"), "`--tev` is for one scene"),
    ] {
        must_fail(&scratch.ivcam(&format!("render {words}")), text);
    }
    must_fail(
        &scratch.ivcam(&format!("converge room.iv --tev {open}")),
        "`--tev` goes with a render",
    );
    assert_eq!(std::fs::read_dir(&scratch.0).unwrap().count(), 1);
}
