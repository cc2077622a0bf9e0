//! The twelve scenes of the coverage table of model `path`: light that reaches a picture on ways
//! that are easy or hard to find.

use ivcam::photo::{Optics, Plan, Shading, Surroundings};
use ivcam_base::math::{Meters, Mm};
use ivcam_render::shade::ClearSky;

use super::scenes::{Case, Source, case, scattered, shape};

pub(super) const CASES: [Case<'static>; 12] = [
    lit("room", Source::Written(room)),
    lit("door ajar", Source::Written(door)),
    Case {
        choose: |plan| {
            path(plan);
            plan.mirrors = Some(0.3);
        },
        ..lit("mirrors", Source::Written(mirrors))
    },
    lit("glass", Source::Written(glass)),
    Case {
        choose: |plan| {
            path(plan);
            plan.light.surroundings = Some(Surroundings::Sky(ClearSky {
                elevation: 0.5,
                azimuth: 0.8,
                turbidity: 3.0,
            }));
        },
        ..lit("sky", Source::Written(court))
    },
    lit("even sky", Source::Written(even_sky)),
    Case {
        choose: |plan| {
            path(plan);
            plan.light.studio = true;
        },
        ..lit("studio", Source::Written(studio))
    },
    lit("forty lamps", Source::Written(lamps)),
    Case {
        lens: ("double-gauss", None),
        focus: Some(1.0),
        truth: 4,
        ..lit("lamps out of focus", Source::Written(far_lamps))
    },
    Case {
        choose: |plan| {
            path(plan);
            plan.light.light_size = Meters(0.4);
            plan.light.sun_size = 0.1;
        },
        ..lit("soft lights", Source::Written(soft))
    },
    lit("screen", Source::Written(screen)),
    lit("evening", Source::Shipped("scenes/livroom/evening.iv")),
];

/// A scene of model `path` without other choices.
const fn lit(name: &'static str, source: Source<'static>) -> Case<'static> {
    Case {
        choose: path,
        ..case(name, source)
    }
}

/// The focal length of the lens, at which it sees what the camera of the scene does.
const EFL: Mm = Mm(29.0);

fn path(plan: &mut Plan) {
    plan.shading = Shading::Path;
    if let Optics::Lens(lens) = &mut plan.optics {
        lens.efl = Some(EFL);
    }
}

const CAMERA: &str = "PerspectiveCamera { position 0 0 4 focalDistance 4 }\n\
    Environment { ambientIntensity 0 }\n";

/// The walls, the floor and the ceiling of a room, open to the camera.
fn walls() -> String {
    let mut text = String::new();
    for (color, place, size) in [
        (".7 .1 .1", [-1.55, 0., 0.], "width .1 height 3 depth 9"),
        (".1 .6 .15", [1.55, 0., 0.], "width .1 height 3 depth 9"),
        (".75 .7 .65", [0., -1.55, 0.], "width 3 height .1 depth 9"),
        (".75 .75 .75", [0., 1.55, 0.], "width 3 height .1 depth 9"),
        (".75 .75 .75", [0., 0., -1.55], "width 3 height 3 depth .1"),
    ] {
        text += &shape(
            &format!("diffuseColor {color}"),
            place,
            &format!("Cube {{ {size} }}"),
        );
    }
    text
}

const LAMP: &str = "diffuseColor 0 0 0 emissiveColor 3 2.6 2";

/// A room with a lamp below its ceiling.
fn room() -> Vec<String> {
    let lamp = shape(
        LAMP,
        [0., 1.45, 0.],
        "Cube { width .8 height .02 depth .8 }",
    );
    let ball = shape(
        "diffuseColor .6 .6 .7 specularColor .2 .2 .2 shininess .6",
        [0.5, -1., 0.2],
        "Sphere { radius .5 }",
    );
    vec![format!("{CAMERA}{}{lamp}{ball}", walls())]
}

/// The same room, whose only lamp is behind a wall with a narrow gap.
fn door() -> Vec<String> {
    let lamp = shape(LAMP, [-1.2, 1.2, -1.2], "Sphere { radius .2 }");
    let door = shape(
        "diffuseColor .6 .5 .4",
        [-0.9, 0., -0.3],
        "Cube { width .05 height 2.9 depth 2.3 }",
    );
    vec![format!("{CAMERA}{}{lamp}{door}", walls())]
}

/// Balls and a small lamp between two mirrors that face each other.
fn mirrors() -> Vec<String> {
    let mut text = CAMERA.to_owned();
    let mirror = "diffuseColor .02 .02 .02 specularColor .95 .95 .95 shininess 1";
    for x in [-1.2, 1.2] {
        text += &shape(mirror, [x, 0., -2.], "Cube { width .05 height 3 depth 12 }");
    }
    text += &shape(LAMP, [0.2, 1.0, 0.5], "Sphere { radius .15 }");
    text += &shape(
        "diffuseColor .6 .6 .6",
        [0., -1.5, -2.],
        "Cube { width 2.4 height .1 depth 12 }",
    );
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

/// A ball of glass on a floor, and the light that it gathers there.
fn glass() -> Vec<String> {
    let floor = shape(
        "diffuseColor .7 .7 .7",
        [0., -1., 0.],
        "Cube { width 8 height .1 depth 8 }",
    );
    let lamp = shape(LAMP, [-1., 2.5, -0.5], "Sphere { radius .5 }");
    let glass = "fields [ MFColor diffuseColor, MFFloat transparency, SFFloat refractionIndex ] \
        diffuseColor 0 0 0 transparency 1 refractionIndex 1.5";
    let ball = shape(glass, [0., -0.4, 0.5], "Sphere { radius .55 }");
    vec![format!("{CAMERA}{floor}{lamp}{ball}")]
}

/// Blocks on the floor of a court, which leaves a part of the sky.
fn court() -> Vec<String> {
    let mut text = CAMERA.to_owned();
    text += &shape(
        "diffuseColor .6 .6 .55",
        [0., -1.1, -2.],
        "Cube { width 6 height .1 depth 9 }",
    );
    for (x, z, size) in [
        (-2.6, -2., "width .2 height 3 depth 9"),
        (2.6, -2., "width .2 height 3 depth 9"),
        (0., -5., "width 5 height 3 depth .2"),
    ] {
        text += &shape(
            "diffuseColor .7 .5 .4",
            [x, 0.4, z],
            &format!("Cube {{ {size} }}"),
        );
    }
    for i in 0..6 {
        let place = [3. * scattered(i) - 1.5, -0.8, 1.0 - 3. * scattered(i + 9)];
        text += &shape(
            "diffuseColor .3 .4 .7",
            place,
            "Cube { width .5 height .5 depth .5 }",
        );
    }
    vec![text]
}

/// The court under ambient light.
fn even_sky() -> Vec<String> {
    let sky = "Environment { ambientIntensity .8 ambientColor .8 .9 1 }\n";
    court()
        .into_iter()
        .map(|text| text.replace("Environment { ambientIntensity 0 }\n", sky))
        .collect()
}

/// Shapes that a studio photographs.
fn studio() -> Vec<String> {
    let ball = "diffuseColor .7 .2 .1 specularColor .3 .3 .3 shininess .7";
    vec![format!(
        "{}{}",
        shape(ball, [0., 0., 0.], "Sphere { radius 1 }"),
        shape(
            "diffuseColor .2 .5 .6",
            [1.4, -0.4, 0.6],
            "Cylinder { radius .4 height 1.2 }"
        )
    )]
}

/// A room under forty small lamps of different brightness.
fn lamps() -> Vec<String> {
    let mut text = format!("{CAMERA}{}", walls());
    for i in 0..40_u32 {
        let place = [
            0.6 * f64::from(i % 5) - 1.2,
            1.3 - 0.4 * scattered(u64::from(i)),
            0.5 * f64::from(i / 5) - 1.2,
        ];
        let level = 1.0 + 6.0 * scattered(u64::from(i) + 70);
        let bright = format!("diffuseColor 0 0 0 emissiveColor {level:.2} {level:.2} 2");
        text += &shape(&bright, place, "Sphere { radius .03 }");
    }
    vec![text]
}

/// Small bright lamps far behind the plane in focus, which also light a floor.
fn far_lamps() -> Vec<String> {
    let mut text = CAMERA.to_owned();
    text += &shape(
        "diffuseColor .3 .3 .35",
        [0., -3., -12.],
        "Cube { width 30 height .1 depth 34 }",
    );
    for i in 0..12 {
        let place = [
            10.0 * scattered(3 * i) - 5.0,
            5.0 * scattered(3 * i + 1) - 2.0,
            -12.0 - 8.0 * scattered(3 * i + 2),
        ];
        let bright = "diffuseColor 0 0 0 emissiveColor 5 4.6 4";
        text += &shape(bright, place, "Sphere { radius .1 }");
    }
    vec![text]
}

/// Posts before a wall, under lights with a size.
fn soft() -> Vec<String> {
    let lights = "PointLight { location 2 3 4 intensity .7 }\n\
        SpotLight { location -2 3 3 direction 2 -3 -4 cutOffAngle .5 intensity .8 }\n\
        DirectionalLight { direction -1 -1 -1 intensity .4 }\n";
    let mut text = format!("{CAMERA}{lights}");
    text += &shape(
        "diffuseColor .7 .7 .7",
        [0., 0., -2.],
        "Cube { width 9 height 9 depth 1 }",
    );
    for i in 0..9_u32 {
        let place = [0.5 * f64::from(i) - 2., -0.2, -0.5];
        text += &shape(
            "diffuseColor .3 .6 .3",
            place,
            "Cylinder { radius .05 height 2 }",
        );
    }
    vec![text]
}

/// A screen of bright and dark texels that lights what is before it.
fn screen() -> Vec<String> {
    let mut texels = String::new();
    for i in 0..64 {
        texels += if scattered(i) < 0.3 { " 255" } else { " 10" };
    }
    let screen = format!(
        "Separator {{ LightModel {{ model BASE_COLOR }} Texture2 {{ image 8 8 1{texels} }} \
         Translation {{ translation 0 .3 -2 }} Cube {{ width 3 height 2 depth .1 }} }}\n"
    );
    let floor = shape(
        "diffuseColor .6 .6 .6",
        [0., -1., 0.],
        "Cube { width 6 height .1 depth 8 }",
    );
    let ball = shape(
        "diffuseColor .2 .2 .2 specularColor .4 .4 .4 shininess .9",
        [0.3, -0.5, 0.3],
        "Sphere { radius .45 }",
    );
    vec![format!("{CAMERA}{screen}{floor}{ball}")]
}
