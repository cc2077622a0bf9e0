//! The scenes of the coverage table: two shipped ones and twelve that are written here.
//!
//! Each is hard for an error estimate in one way. None needs a file from outside the repository.
//! Those of model `path` are in `light_scenes`.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use ivcam::photo::{Era, LensChoice, Optics, Plan};
use ivcam_base::math::Meters;

/// A scene of the table.
pub(super) struct Case<'a> {
    pub name: &'a str,
    /// The lens, with its f-number if it is stopped down.
    pub lens: (&'static str, Option<f64>),
    /// The distance in focus in meters; the camera's own if `None`.
    pub focus: Option<f64>,
    /// How many times as many samples as usual the truth needs.
    pub truth: u32,
    /// The files of the scene: one for each moment of the exposure.
    pub source: Source<'a>,
    /// Makes the choices of a plan that this scene needs besides its lens.
    pub choose: fn(&mut Plan),
}

pub(super) enum Source<'a> {
    /// A file of the repository.
    Shipped(&'static str),
    /// A file of the caller.
    File(&'a Path),
    /// The text of each moment after the header.
    Written(fn() -> Vec<String>),
}

const WIDE: (&str, Option<f64>) = ("wide-angle", None);

pub(super) const CASES: [Case<'static>; 15] = [
    case("room", Source::Shipped("scenes/livroom/livroom.iv")),
    case("street", Source::Shipped("scenes/street/street.iv")),
    case("fog", Source::Written(fog)),
    case("textured", Source::Written(textured)),
    case("glossy", Source::Written(glossy)),
    case("mirror corridor", Source::Written(corridor)),
    Case {
        truth: 4,
        ..case("tiny bright emitter", Source::Written(emitter))
    },
    Case {
        truth: 4,
        ..case("three tiny lamps", Source::Written(tiny_lamps))
    },
    Case {
        truth: 4,
        ..case("tiny lamp behind bars", Source::Written(barred_lamp))
    },
    case("thin bright lines", Source::Written(lines)),
    Case {
        lens: ("tessar", None),
        ..case("dispersion", Source::Written(stripes))
    },
    Case {
        lens: ("double-gauss", None),
        focus: Some(1.0),
        ..case("deep defocus", Source::Written(highlights))
    },
    case("motion blur", Source::Written(motion)),
    case("open shutter", Source::Written(shutter)),
    case("mostly black", Source::Written(black)),
];

pub(super) const fn case<'a>(name: &'a str, source: Source<'a>) -> Case<'a> {
    Case {
        name,
        lens: WIDE,
        focus: None,
        truth: 1,
        source,
        choose: |_| (),
    }
}

impl<'a> Case<'a> {
    /// Returns a file's scene through the double Gauss lens.
    pub(super) fn of_file(file: &'a Path) -> Self {
        Self {
            lens: ("double-gauss", None),
            ..case(file.to_str().unwrap_or("scene"), Source::File(file))
        }
    }

    /// Returns the plan of each moment. Written scenes are put into a folder.
    ///
    /// # Errors
    /// Fails if a file cannot be written.
    pub(super) fn plans(&self, folder: &Path) -> std::io::Result<Vec<Plan>> {
        let files = match self.source {
            Source::Shipped(file) => vec![root().join(file)],
            Source::File(file) => vec![file.to_path_buf()],
            Source::Written(texts) => texts()
                .iter()
                .enumerate()
                .map(|(i, text)| {
                    let file = folder.join(format!("{}-{i}.iv", self.name.replace(' ', "-")));
                    std::fs::write(&file, format!("#Inventor V2.1 ascii\n{text}"))?;
                    Ok(file)
                })
                .collect::<std::io::Result<Vec<PathBuf>>>()?,
        };
        let plan = |file| {
            let mut plan = Plan::of_era(Era::Modern, file);
            let mut lens = LensChoice::named(self.lens.0);
            lens.f_number = self.lens.1;
            plan.optics = Optics::Lens(lens);
            plan.focus = self.focus.map(Meters);
            (self.choose)(&mut plan);
            plan
        };
        Ok(files.into_iter().map(plan).collect())
    }
}

/// The folder of the repository.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

pub(super) const CAMERA: &str = "PerspectiveCamera { position 0 0 4 focalDistance 4 }\n";
const LIGHT: &str = "PointLight { location 2 3 4 }\n";

/// A shape in a separator of its own, with the fields of its material.
pub(super) fn shape(material: &str, [x, y, z]: [f64; 3], shape: &str) -> String {
    format!(
        "Separator {{ Material {{ {material} }} Translation {{ translation {x} {y} {z} }} \
         {shape} }}\n"
    )
}

/// Numbers from 0 to 1 that look random and are the same in every run.
pub(super) fn scattered(key: u64) -> f64 {
    ivcam_optics::sampling::unit(ivcam_optics::sampling::mix(key))
}

/// Posts in haze, most of them almost of its color.
fn fog() -> Vec<String> {
    let mut text = format!(
        "{CAMERA}{LIGHT}Environment {{ fogType FOG fogColor .6 .65 .7 fogVisibility 14 }}\n"
    );
    text += &shape(
        "diffuseColor .5 .5 .5",
        [0., 0., -40.],
        "Cube { width 90 height 90 depth 1 }",
    );
    for i in 0..40 {
        let place = [
            8.0 * scattered(2 * i) - 4.0,
            -0.5,
            2.0 - 14.0 * scattered(2 * i + 1),
        ];
        text += &shape(
            "diffuseColor .2 .1 .1",
            place,
            "Cylinder { radius .04 height 3 }",
        );
    }
    vec![text]
}

/// A floor and a wall with a picture of random texels, repeated until it is finer than pixels.
fn textured() -> Vec<String> {
    let mut texels = String::new();
    for i in 0..64 {
        let _ = write!(texels, " {}", if scattered(i) < 0.5 { 20 } else { 240 });
    }
    let texture = format!("Texture2 {{ image 8 8 1{texels} }}\n");
    let repeat = |n: u32| format!("Texture2Transform {{ scaleFactor {n} {n} }}\n");
    vec![format!(
        "{CAMERA}{LIGHT}{texture}{}{}{}{}",
        repeat(40),
        shape(
            "diffuseColor .8 .8 .8",
            [0., -1., -3.],
            "Cube { width 12 height .1 depth 14 }"
        ),
        repeat(6),
        shape(
            "diffuseColor .8 .6 .5",
            [0., 1., -6.],
            "Cube { width 9 height 6 depth .1 }"
        ),
    )]
}

/// Polished balls with small highlights.
fn glossy() -> Vec<String> {
    let mut text = format!("{CAMERA}{LIGHT}PointLight {{ location -3 1 3 intensity .7 }}\n");
    for i in 0..12_u32 {
        let place = [
            f64::from(i % 4) - 1.5,
            0.9 * f64::from(i / 4) - 0.9,
            -scattered(u64::from(i)),
        ];
        let polished = "diffuseColor .3 .1 .1 specularColor .6 .6 .6 shininess .95";
        text += &shape(polished, place, "Sphere { radius .4 }");
    }
    vec![text]
}

/// Colored balls between two mirrors that face each other.
fn corridor() -> Vec<String> {
    let mut text = format!("{CAMERA}PointLight {{ location .3 .9 2 }}\n");
    let mirror = "diffuseColor .02 .02 .02 specularColor .95 .95 .95 shininess 1";
    for x in [-1.2, 1.2] {
        text += &shape(mirror, [x, 0., -2.], "Cube { width .05 height 3 depth 16 }");
    }
    for i in 0..6 {
        let place = [
            1.6 * scattered(2 * i) - 0.8,
            1.6 * scattered(2 * i + 1) - 0.8,
            1.0 - i as f64,
        ];
        text += &shape("diffuseColor .7 .6 .2", place, "Sphere { radius .15 }");
    }
    vec![text]
}

/// A lit wall before which a ball, about a quarter of a small picture's pixel, is 2,000 times as
/// bright as the wall. A third of the pictures of four samples per pixel miss it.
fn emitter() -> Vec<String> {
    let wall = shape(
        "diffuseColor .2 .2 .2",
        [0., 0., -2.],
        "Cube { width 20 height 20 depth 1 }",
    );
    let ball = "diffuseColor 0 0 0 emissiveColor 400 400 400";
    vec![format!(
        "{CAMERA}{LIGHT}{wall}{}",
        shape(ball, [0.31, 0.22, 0.0], "Sphere { radius .008 }")
    )]
}

/// Three lamps of different light that are smaller than a pixel, before a wall.
fn tiny_lamps() -> Vec<String> {
    let mut text = format!("{CAMERA}{LIGHT}");
    text += &shape(
        "diffuseColor .4 .3 .2",
        [0., 0., -2.],
        "Cube { width 20 height 20 depth 1 }",
    );
    for (light, place, radius) in [
        ("900 700 400", [-0.37, 0.11, 0.1], 0.004),
        ("250 250 300", [0.21, -0.23, 0.3], 0.007),
        ("120 60 30", [0.52, 0.28, -0.4], 0.012),
    ] {
        let lamp = format!("diffuseColor 0 0 0 emissiveColor {light}");
        text += &shape(&lamp, place, &format!("Sphere {{ radius {radius} }}"));
    }
    vec![text]
}

/// A lamp smaller than a pixel, of which a bar hides a part, over a floor.
fn barred_lamp() -> Vec<String> {
    let mut text = format!("{CAMERA}{LIGHT}");
    text += &shape(
        "diffuseColor .5 .5 .5",
        [0., -0.6, 0.],
        "Cube { width 9 height .1 depth 9 }",
    );
    for i in 0..9 {
        let bar = "Cube { width .02 height 2 depth .02 }";
        text += &shape(
            "diffuseColor .6 .2 .2",
            [0.15 * f64::from(i) - 0.6, 0., 0.5],
            bar,
        );
    }
    text += &shape(
        "diffuseColor 0 0 0 emissiveColor 600 600 500",
        [0.006, 0.1, 0.2],
        "Sphere { radius .009 }",
    );
    vec![text]
}

/// Bright wires much thinner than a pixel.
fn lines() -> Vec<String> {
    let mut text = format!("{CAMERA}{LIGHT}");
    text += &shape(
        "diffuseColor .2 .2 .3",
        [0., 0., -2.],
        "Cube { width 20 height 20 depth 1 }",
    );
    for i in 0..8 {
        let turn = format!("Rotation {{ rotation 0 0 1 {:.3} }}", 3.0 * scattered(i));
        let place = [2.0 * scattered(i + 50) - 1.0, 0.0, 0.0];
        let bright = "diffuseColor 0 0 0 emissiveColor 30 30 25";
        let wire = format!("{turn} Cylinder {{ radius .0015 height 3 }}");
        text += &shape(bright, place, &wire);
    }
    vec![text]
}

/// White bars on black, which a lens with dispersion shows with colored edges.
fn stripes() -> Vec<String> {
    let mut text = CAMERA.to_owned();
    for i in 0..12 {
        let place = [0.35 * f64::from(i) - 2.0, 0.0, 0.0];
        let white = "diffuseColor 0 0 0 emissiveColor 1 1 1";
        text += &shape(white, place, "Cube { width .12 height 3 depth .01 }");
    }
    vec![text]
}

/// Small bright balls far behind the plane in focus.
fn highlights() -> Vec<String> {
    let mut text = format!("{CAMERA}{LIGHT}");
    text += &shape(
        "diffuseColor .1 .1 .15",
        [0., 0., -30.],
        "Cube { width 99 height 99 depth 1 }",
    );
    for i in 0..12 {
        let place = [
            10.0 * scattered(3 * i) - 5.0,
            6.0 * scattered(3 * i + 1) - 3.0,
            -12.0 - 8.0 * scattered(3 * i + 2),
        ];
        let bright = "diffuseColor 0 0 0 emissiveColor 30 26 20";
        text += &shape(bright, place, "Sphere { radius .1 }");
    }
    vec![text]
}

/// A ball that crosses the picture while the shutter is open, at four moments.
fn motion() -> Vec<String> {
    let wall = shape(
        "diffuseColor .3 .3 .4",
        [0., 0., -2.],
        "Cube { width 20 height 20 depth 1 }",
    );
    let at = |moment: i32| {
        let place = [0.3 * f64::from(moment) - 0.5, 0.1, 0.0];
        let ball = shape("diffuseColor .9 .7 .2", place, "Sphere { radius .35 }");
        format!("{CAMERA}{LIGHT}{wall}{ball}")
    };
    (0..4).map(at).collect()
}

/// A block that moves before black above a bar at rest, at sixteen moments: with up to 16 samples
/// each of them has a single one.
fn shutter() -> Vec<String> {
    let bar = shape(
        "diffuseColor .8 .1 .1",
        [0., -0.7, 0.],
        "Cube { width 3 height .1 depth .1 }",
    );
    let at = |moment: i32| {
        let place = [0.04 * f64::from(moment) - 0.3, 0.1, 0.0];
        let block = "Cube { width .5 height .5 depth .5 }";
        let block = shape("diffuseColor .9 .9 .9", place, block);
        format!("{CAMERA}{LIGHT}{bar}{block}")
    };
    (0..16).map(at).collect()
}

/// One small lit ball; the rest of the picture is black.
fn black() -> Vec<String> {
    let ball = shape(
        "diffuseColor .9 .9 .9",
        [0.6, 0.3, 0.],
        "Sphere { radius .12 }",
    );
    vec![format!("{CAMERA}{LIGHT}{ball}")]
}
