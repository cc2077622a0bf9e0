//! Tests of lamps that are found through a lens on purpose.

use glam::{DQuat, DVec3};
use ivcam_base::math::{Meters, Mm};
use ivcam_inventor::iv::Document;
use ivcam_inventor::pose::CameraPose;
use ivcam_inventor::snapshot::Snapshot;
use ivcam_optics::film::{Film, FilmFormat, Resolution};
use ivcam_optics::lens::{Coating, FocusMethod, Iris, Lens};
use ivcam_optics::sampling::{Filter, FilterTable, Sampler, SamplerKind};

use super::{Render, Stop};
use crate::camera::{Aim, Camera, LampFinder, LensCamera};
use crate::scene::{CompileOptions, RenderScene};
use crate::shade::{PathOptions, ShadeOptions, Shader, Shading};

/// A ball, the triangles of a cube, a transparent tube, and a cone that is half behind a wall, all
/// about 20 m away, where the radius of the rays' cone is 8 cm.
const LAMPS: &str = "#Inventor V2.1 ascii
Environment { fogType FOG fogColor .2 .1 .1 fogVisibility 90 }
Separator { Material { diffuseColor 0 0 0 emissiveColor 900 500 200 }
    Translation { translation -.15 .05 -20 } Sphere { radius .008 } }
Separator { Material { diffuseColor 0 0 0 emissiveColor 100 400 900 }
    Translation { translation .12 -.05 -21 } RotationXYZ { angle .5 }
    Cube { width .015 height .015 depth .015 } }
Separator { Material { diffuseColor 0 0 0 emissiveColor 300 300 300 transparency .5 }
    Translation { translation .1 .1 -18 } Cylinder { parts SIDES radius .004 height .02 } }
Separator { Material { diffuseColor 0 0 0 emissiveColor 600 600 600 }
    Translation { translation -.05 -.1 -20 } Cone { bottomRadius .008 height .015 } }
Separator { Material { diffuseColor .5 .5 .5 emissiveColor .1 .1 .1 }
    Translation { translation -.025 -.1 -10 } Cube { width .05 height .1 depth .01 } }
Separator { Translation { translation 0 0 -30 } Material { emissiveColor .02 .02 .02 }
    Cube { width 9 height 9 depth 1 } }
";

/// The number of pictures of each kind.
const SEEDS: u64 = 16;

const SIZE: Resolution = Resolution::of(24, 16);

fn scene() -> RenderScene {
    let document = Document::read_headerless("lamps.iv", LAMPS.as_bytes().to_vec()).unwrap();
    let snapshot = Snapshot::at(&document, 0.0);
    RenderScene::compile(&snapshot, &CompileOptions::default()).unwrap()
}

/// A lens of 50 mm at f/2.8.
pub(super) fn lens(name: &str) -> Lens {
    let lens = Lens::named(name).unwrap().scaled_to(Mm(50.0)).unwrap();
    lens.at_f_number(2.8).unwrap()
}

/// A camera at the origin that looks along −z and is focused 2 m away. Its film is 1.5 mm wide.
pub(super) fn camera(lens: Lens, disperses: bool) -> Camera {
    let focus = lens.focus(FocusMethod::Film, Meters(2.0)).unwrap();
    let format = FilmFormat {
        width: 1.5,
        height: 1.0,
    };
    let pose = CameraPose {
        orientation: DQuat::IDENTITY,
        ..CameraPose::view_all((DVec3::NEG_ONE, DVec3::ONE), 1.5)
    };
    let camera = LensCamera::new(lens, focus, format, Aim::ExitPupil, &pose);
    Camera::Lens(Box::new(match disperses {
        true => camera.dispersing(),
        false => camera,
    }))
}

fn photograph(
    scene: &RenderScene,
    camera: &Camera,
    lamps: Option<&LampFinder<'_>>,
    (seed, samples): (u64, u32),
) -> Film {
    let options = ShadeOptions {
        path: PathOptions {
            max_depth: Some(0),
            ..PathOptions::default()
        },
        ..ShadeOptions::default()
    };
    let render = Render {
        shader: &Shader::new(scene, Shading::Path, options),
        camera,
        sampler: Sampler::new(SamplerKind::Sobol, samples, seed),
        resolution: SIZE,
        exposure: 1.0,
        stop: Stop::after(samples),
        filter: &FilterTable::new(Filter::Box),
        adaptive: false,
        team: None,
        lamps,
    };
    render.run(&|_| ()).film
}

/// The light of each block of 4x4 pixels.
fn blocks(film: &Film) -> [DVec3; 24] {
    let mut sums = [DVec3::ZERO; 24];
    for (i, pixel) in film.pixels.iter().enumerate() {
        let (x, y) = (i % 24, i / 24);
        sums[y / 4 * 6 + x / 4] += pixel.mean / 16.0;
    }
    sums
}

/// The mean and the variance of each block over some pictures.
fn statistics(pictures: &[[DVec3; 24]]) -> [[DVec3; 2]; 24] {
    let n = pictures.len() as f64;
    std::array::from_fn(|block| {
        let mean = pictures.iter().map(|p| p[block]).sum::<DVec3>() / n;
        let square = pictures.iter().map(|p| (p[block] - mean).powf(2.0));
        [mean, square.sum::<DVec3>() / (n - 1.0)]
    })
}

/// The mean of both ways is that of plain samples: of the 216 values of Student's t, none is
/// above 5 in 99.8% of the runs of a correct program. The seeds are fixed.
#[test]
fn lamps_found_on_purpose_have_the_light_of_those_found_by_chance() {
    let scene = scene();
    let blades = Iris::Blades {
        count: 6,
        rotation: 0.2,
    };
    let coated = lens("double-gauss").with_coating(Coating::MagnesiumFluoride);
    for (made, disperses) in [
        (lens("canon-50").with_coating(Coating::Bare), false),
        (lens("takumar-50").with_iris(blades), true),
        (coated, true),
    ] {
        let camera = camera(made, disperses);
        let finder = LampFinder::new(&scene, &camera).unwrap();
        let pictures = |lamps: Option<&LampFinder<'_>>, first: u64| {
            let seeds = first..first + SEEDS;
            let all = seeds.map(|seed| blocks(&photograph(&scene, &camera, lamps, (seed, 64))));
            statistics(&all.collect::<Vec<_>>())
        };
        let (plain, found) = (pictures(None, 1), pictures(Some(&finder), 100));
        let (mut noise, mut lit) = ([0.0; 2], 0);
        for ([a, va], [b, vb]) in plain.iter().zip(&found) {
            // Plain samples hit a lamp of up to 900 so seldom in some blocks that their scatter
            // says little. Then that of a Poisson distribution counts.
            let rare = *b * (900.0 / (16.0 * 64.0 * SEEDS as f64));
            let sigma = ((*va + *vb) / SEEDS as f64).max(rare).map(f64::sqrt);
            let z = (*a - *b) / sigma;
            assert!(z.abs().max_element() < 5.0, "{a} {b}: {z}");
            noise[0] += va.element_sum();
            noise[1] += vb.element_sum();
            lit += usize::from(b.max_element() > 0.5);
        }
        assert!(lit >= 3, "{lit}");
        // Measured with the first lens: 0.045.
        assert!(noise[1] < 0.1 * noise[0], "{noise:?}");
    }
}

#[test]
fn lamps_found_on_purpose_have_the_same_bits_at_any_number_of_threads() {
    let scene = scene();
    let camera = camera(lens("takumar-50"), true);
    let films = [1, 3].map(|threads| {
        let finder = LampFinder::new(&scene, &camera).unwrap();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let film = pool
            .unwrap()
            .install(|| photograph(&scene, &camera, Some(&finder), (7, 9)));
        film.pixels.iter().map(|p| p.to_bytes()).collect::<Vec<_>>()
    });
    assert!(films[0] == films[1]);
}

/// A lamp in focus, and one that fills its cone, are left to plain samples.
#[test]
fn only_small_lamps_out_of_focus_are_found_on_purpose() {
    for (place, radius, is_found) in [
        (-20.0, 0.01, true),
        (-2.0, 0.01, false),
        (-20.0, 0.2, false),
    ] {
        let text = format!(
            "#Inventor V2.1 ascii\nMaterial {{ emissiveColor 9 9 9 }}
            Translation {{ translation 0 0 {place} }} Sphere {{ radius {radius} }}"
        );
        let document = Document::read_headerless("lamp.iv", text.into_bytes()).unwrap();
        let snapshot = Snapshot::at(&document, 0.0);
        let scene = RenderScene::compile(&snapshot, &CompileOptions::default()).unwrap();
        let camera = camera(lens("double-gauss"), false);
        let finder = LampFinder::new(&scene, &camera).unwrap();
        assert_eq!(finder.finds_at([0.5, 0.5]), is_found, "{place} {radius}");
        assert!(!finder.finds_at([0.01, 0.01]));
    }
}
