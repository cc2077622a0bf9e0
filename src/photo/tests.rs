//! Tests of sessions that change.

use std::path::Path;
use std::sync::Arc;

use glam::{DVec3, Vec3};
use indexmap::IndexMap;
use ivcam_base::diag::Severity;
use ivcam_base::math::{Meters, mm};
use ivcam_base::memory::MemoryLimit;
use ivcam_inventor::pose::Projection;
use ivcam_optics::film::{Region, Resolution};
use ivcam_optics::picture::ChannelImage;
use ivcam_render::camera::Camera;
use ivcam_render::render::{Exposure, Stop, crew};
use ivcam_render::scene::Unneeded;
use ivcam_render::shade::{ClearSky, Shading};
use ivcam_render::team::threads;

use super::light_plan::Surroundings;
use super::plan::IdealChoice;
use super::{CameraChoice, CameraNode, Era, Headlight, Optics, Override, Plan, Session};
use crate::folder::Folder;

const SCENE: &str = "#Inventor V2.1 ascii\nPerspectiveCamera { position 0 0 4 }\n\
    PointLight { location 2 3 4 }\nSphere { }\nTranslation { translation 1.5 .4 .5 } Cube { }\n";

fn plan(folder: &Folder) -> Plan {
    let scene = folder.file("scene.iv", SCENE);
    let mut plan = Plan::of_era(Era::Modern, scene);
    plan.resolution = Resolution::of(36, 24);
    plan.focus = Some(Meters(3.0));
    plan
}

#[test]
fn a_studio_stops_the_lens_down_for_where_the_camera_has_moved() {
    let folder = Folder::new("studio-aim");
    let mut plan = plan(&folder);
    plan.set_studio(true);
    plan.lens_mut().unwrap().efl = Some(mm(50.0));
    let mut session = Session::open(plan.clone()).expect("the scene is whole");
    let mut pose = session.pose.clone();
    pose.position += 3.0 * DVec3::Z;
    session.aim(plan.clone(), pose.clone()).unwrap();
    plan.camera = Some(CameraChoice::Node(CameraNode::from_pose(&pose)));
    let afresh = Session::open(plan).expect("the scene is whole");
    let stop = |session: &Session| match &session.camera {
        Camera::Lens(camera) => camera.lens.real_f_number().unwrap(),
        _ => unreachable!("the plan has a lens"),
    };
    assert!((stop(&session) / stop(&afresh) - 1.0).abs() < 1e-9);
}

/// The scene is compiled in single precision with its camera as the origin. A camera one meter away
/// has other rounding errors: the pictures agree to 1e-4 except for rays at an edge.
#[test]
fn a_camera_that_is_only_aimed_sees_what_it_sees_after_compiling() {
    let folder = Folder::new("plan");
    let mut session = Session::open(plan(&folder)).expect("the scene is whole");
    let mut pose = session.pose.clone();
    pose.position += DVec3::new(1.0, 0.2, -0.1);
    pose.orientation = glam::DQuat::from_rotation_y(0.2);
    let plan = session.plan.clone();
    session.aim(plan.clone(), pose.clone()).unwrap();
    let aimed = session.expose(&|_| ()).film;
    session.change(plan, pose.clone()).unwrap();
    assert_eq!(session.scene.origin, pose.position);
    let compiled = session.expose(&|_| ()).film;
    let apart = |(a, b): (&ivcam_optics::film::Exposed, &ivcam_optics::film::Exposed)| {
        (a.mean - b.mean).abs().max_element() > 1e-4
    };
    let off = aimed
        .pixels
        .iter()
        .zip(&compiled.pixels)
        .filter(|p| apart(*p));
    assert!(off.count() < 8);
    assert!(compiled.mean() > 0.01);
}

/// The resolution of textures and lines depends on the lens, also if the lens consists of solids.
#[test]
fn the_scene_is_compiled_for_what_the_lens_sees() {
    let folder = Folder::new("seen");
    let mut session = Session::open(plan(&folder)).expect("the scene is whole");
    let tangent = |session: &Session| match session.projection {
        Projection::Perspective { height_angle } => libm::tan(0.5 * height_angle),
        Projection::Orthographic { .. } => f64::NAN,
    };
    let Camera::Lens(lens) = &session.camera else {
        panic!("the plan has a lens")
    };
    let sees = 12.0 / lens.focus.image_distance;
    assert!((tangent(&session) / sees - 1.0).abs() < 1e-12);

    let mut solid = session.plan.clone();
    solid.solids = true;
    let solid = Session::open(solid).expect("its surfaces are spheres");
    // The angle goes through a file, as a float.
    assert!((tangent(&solid) / sees - 1.0).abs() < 1e-6);

    let mut nearer = session.plan.clone();
    nearer.focus = Some(Meters(0.8));
    let pose = session.pose.clone();
    session.change(nearer, pose).unwrap();
    assert!(session.is_compiled_from_here());
    assert!(tangent(&session) < sees);
}

/// A wall fills the picture at z = 1, and the camera is at z = 4 and looks along −z.
#[test]
fn layers_hold_what_each_pixel_shows() {
    let folder = Folder::new("layers");
    let mut plan = plan(&folder);
    let scene = "#Inventor V2.1 ascii\nPerspectiveCamera { position 0 0 4 }\n\
        PointLight { location 0 0 3 } Material { diffuseColor .2 .4 .6 }\n\
        Translation { translation 10.03 0 0 } Cube { width 20 height 90 }\n";
    std::fs::write(&plan.scene, scene).expect("the scene can be written");
    plan.stop = ivcam_render::render::Stop::after(16);
    let session = Session::open(plan).expect("the scene is whole");
    let exposure = session.expose(&|_| ());
    let picture = session.develop(&exposure, "");
    let image = session.layers(&exposure, &picture, &session.surfaces_of(&exposure));
    let channel = |name: &str| image.channels[name].as_slice();
    // The left half of the picture is empty, the right half shows the wall.
    let (empty, wall) = (12 * 36 + 3, 12 * 36 + 30);
    let at =
        |names: &[&str], i: usize| -> Vec<f32> { names.iter().map(|n| channel(n)[i]).collect() };
    assert_eq!(at(&["A", "Z", "N.Z", "R"], empty), [0.0, 1e10, 0.0, 0.0]);
    assert_eq!(at(&["A", "N.X", "N.Y", "N.Z"], wall), [1.0, 0.0, 0.0, 1.0]);
    let near = |value: f32, expected: f32| (value - expected).abs() < 1e-5;
    assert!(near(channel("Z")[wall], 3.0) && near(channel("P.Z")[wall], 1.0));
    let albedo = at(&["albedo.R", "albedo.G", "albedo.B"], wall);
    assert!(albedo.iter().zip([0.2, 0.4, 0.6]).all(|(a, b)| near(*a, b)));
    assert_eq!(channel("samples.Y")[wall], 16.0);
    let lost = channel("lost.Y")[wall];
    let passed = 1.0 - exposure.counts.passed_share() as f32;
    assert!((lost - passed).abs() < 0.2, "{lost} {passed}");
    // Where the wall is evenly lit, its picture has almost no error, but at its blurred edge.
    let edge = 12 * 36 + 18;
    assert!(channel("error.R")[edge] > channel("error.R")[wall]);
    assert_eq!(image.channels["R"][wall], picture.pixels[wall][0]);
}

#[test]
fn the_report_names_what_the_scene_did_not_need() {
    let folder = Folder::new("unneeded");
    let mut plan = plan(&folder);
    plan.shading = ivcam_render::shade::Shading::Recursive;
    plan.headlight = Headlight::Set(false);
    let left_out = |text: &str| {
        let text = format!("#Inventor V2.1 ascii\n{text}\n");
        std::fs::write(&plan.scene, text).expect("the scene can be written");
        let session = Session::open(plan.clone()).expect("the scene is whole");
        session.report(&session.expose(&|_| ())).left_out
    };
    let bare = left_out(
        "Cube { } Switch { Cube { } Sphere { } } Separator { PointLight { } } Translation { }",
    );
    let expected = [
        "textures (none)",
        "fog (none)",
        "fonts (no text)",
        "visibility of hits (nothing clipped or culled)",
        "1 lights (light no shape)",
        "2 shapes (not reached)",
        "shadow rays (no lights)",
        "reflected rays (no mirrors)",
        "refracted rays (nothing transparent)",
    ];
    for part in expected {
        assert!(bare.contains(&part.to_owned()), "{part}: {bare:?}");
    }
    let rich = left_out(
        "Environment { fogType HAZE } PointLight { } ClipPlane { plane 0 1 0 -9 }
         Material { specularColor 1 1 1 shininess .5 transparency .5 }
         Texture2 { image 1 1 1 0x80 } Cube { } Text3 { string \"a\" }",
    );
    for part in expected {
        assert!(!rich.contains(&part.to_owned()), "{part}: {rich:?}");
    }
}

/// The noise of neighboring pixels is mixed, so the error is not that of the rays.
#[test]
fn the_error_of_a_picture_with_diffraction_is_that_of_its_rays_by_name_only() {
    let folder = Folder::new("diffracted");
    let mut plan = plan(&folder);
    for diffraction in [false, true] {
        plan.diffraction = diffraction;
        let session = Session::open(plan.clone()).expect("the scene is whole");
        let exposure = session.expose(&|_| ());
        let picture = session.develop(&exposure, "");
        let rays = exposure.film.error();
        let error = session.error_of(&picture, rays);
        assert_eq!(error.is_ok(), rays.is_ok() && !diffraction, "{error:?}");
        let stated = &picture.provenance["ivcam:error"];
        assert_eq!(
            stated.contains("diffraction spreads the noise"),
            diffraction,
            "{stated}"
        );
    }
}

#[test]
fn a_scene_with_nothing_to_see_needs_no_rays() {
    let folder = Folder::new("nothing");
    let mut plan = plan(&folder);
    let scene = plan.scene.clone();
    let write = |text: &str| std::fs::write(&scene, text).expect("the scene can be written");
    write("#Inventor V2.1 ascii\nPointLight { }\n");
    let session = Session::open(plan.clone()).expect("the scene is whole");
    let exposure = session.expose(&|_| ());
    assert_eq!(exposure.counts.film_rays, 0);
    let report = session.report(&exposure);
    assert!(
        report
            .left_out
            .iter()
            .any(|part| part == "all rays (nothing to see)")
    );
    let picture = session.develop(&exposure, "");
    let warning = session.warn_if_black_or_clipped(&exposure.counts, &picture);
    assert!(
        warning
            .expect("a warning")
            .message
            .contains("nothing to see")
    );
    // A background is something to see, and so are surroundings.
    write("#VRML V2.0 utf8\nBackground { skyColor 0 0 1 }\n");
    let session = Session::open(plan.clone()).expect("the scene is whole");
    let exposure = session.expose(&|_| ());
    assert!(exposure.counts.film_rays > 0 && exposure.film.mean() > 0.1);
    plan.shading = Shading::Path;
    let sky = ClearSky {
        elevation: 0.5,
        azimuth: 0.0,
        turbidity: 3.0,
    };
    plan.light.surroundings = Some(Surroundings::Sky(sky));
    write("#VRML V2.0 utf8\n");
    let mean = |plan: &Plan| {
        let session = Session::open(plan.clone()).expect("the scene is whole");
        session.expose(&|_| ()).film.mean()
    };
    assert!(mean(&plan) > 0.1);
    // A black background that is stated hides them.
    write("#VRML V2.0 utf8\nBackground { }\n");
    assert_eq!(mean(&plan), 0.0);
    write("#VRML V2.0 utf8\n");
    plan.background = Some(Override::Always(Vec3::ZERO));
    assert_eq!(mean(&plan), 0.0);
}

/// The broken pixels are in the middle of what the camera sees, and elsewhere it is gray.
#[test]
fn a_picture_of_light_that_is_broken_or_no_panorama_is_named() {
    let folder = Folder::new("broken-light");
    let mut plan = plan(&folder);
    std::fs::write(&plan.scene, "#VRML V2.0 utf8\n").expect("written");
    plan.shading = Shading::Path;
    let mut taken = |width: u32, height: u32, broken: &[[f64; 3]]| {
        let mut picture = ChannelImage {
            width,
            height,
            channels: IndexMap::new(),
            provenance: IndexMap::new(),
        };
        let first = (width * height / 2 + width / 2) as usize;
        picture.add(["R", "G", "B"], |pixel| {
            let number = pixel.checked_sub(first);
            let broken = number.and_then(|number| broken.get(number));
            broken.copied().unwrap_or([0.5; 3])
        });
        let path = folder.path("light.exr");
        picture.save(&path).expect("written");
        plan.light.surroundings = Some(Surroundings::Picture(path.into()));
        let session = Session::open(plan.clone()).expect("the scene is whole");
        let messages = session.sink.items().iter().map(|d| d.message.clone());
        let messages: Vec<String> = messages.filter(|m| m.contains("light.exr")).collect();
        (session.expose(&|_| ()).film.mean(), messages)
    };
    let (whole, messages) = taken(64, 32, &[]);
    assert!(whole > 0.1 && messages.is_empty(), "{whole} {messages:?}");
    let broken = [[f64::INFINITY, 1.0, 1.0], [f64::NAN; 3], [-3.0, 0.5, 0.5]];
    let (dark, messages) = taken(64, 32, &broken);
    assert!(dark < whole && dark > 0.1, "{dark} {whole}");
    assert!(
        messages.len() == 1 && messages[0].contains("3 pixels"),
        "{messages:?}"
    );
    let (_, messages) = taken(32, 32, &[]);
    assert!(
        messages.len() == 1 && messages[0].contains("32x32"),
        "{messages:?}"
    );
    assert!(taken(33, 16, &[]).1.is_empty());
}

#[test]
fn pixels_that_are_not_square_are_named_wherever_there_is_a_film() {
    let folder = Folder::new("not-square");
    let mut plan = plan(&folder);
    std::fs::write(&plan.scene, "#Inventor V2.1 ascii\nSphere { }\n").expect("written");
    plan.resolution = Resolution::of(50, 50);
    let ideal = Optics::Ideal(IdealChoice::default());
    for (optics, warns) in [(Optics::Pinhole, false), (ideal, true)] {
        plan.optics = optics;
        let session = Session::open(plan.clone()).expect("the scene is whole");
        let mut messages = session.sink.items().iter().map(|d| &d.message);
        let is_named = messages.any(|m| m.starts_with("pixels are not square"));
        assert_eq!(is_named, warns);
    }
}

/// Processes that share the work make the bits of one process, at any number of threads.
#[test]
fn a_team_makes_the_same_bits_as_one_process() {
    let folder = Folder::new("team");
    let mut plan = plan(&folder);
    plan.stop = Stop::after(8);
    let mut adaptive = plan.clone();
    (adaptive.adaptive, adaptive.dispersion) = (true, true);
    let mut until = plan.clone();
    until.stop = Stop {
        error: Some(0.02),
        ..Stop::after(64)
    };
    let mut part = plan.clone();
    part.region = Some(Region::new([5, 3], [20, 14]));
    for plan in [plan, adaptive, until, part] {
        let alone = Session::open(plan.clone()).expect("the scene is whole");
        let alone = alone.expose(&|_| ());
        for (size, count) in [(1, 1), (2, 1), (2, 2), (3, 1), (4, 2)] {
            let made = threads(size, |team| {
                let mut session = Session::open(plan.clone()).expect("the scene is whole");
                let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build();
                let pool = pool.expect("threads start");
                if team.rank() > 0 {
                    pool.install(|| session.serve(&team));
                    return None;
                }
                let team = Arc::new(team);
                session.team = Some(team.clone());
                let exposure = pool.install(|| session.expose(&|_| ()));
                crew::end(&team);
                Some(exposure)
            });
            let made = made.into_iter().flatten().next().expect("the first has it");
            assert!(made.film.pixels == alone.film.pixels, "{size} {count}");
            assert_eq!(made.film.squared_error, alone.film.squared_error);
            assert_eq!(made.samples, alone.samples);
            let rays = |e: &Exposure| (e.counts.film_rays, e.counts.passed, e.counts.shadow_rays);
            assert_eq!(rays(&made), rays(&alone));
        }
    }
}

/// What a shading model does not use is not compiled, and what the scene lacks is not computed. The
/// picture has the same bits with it. Points that are lit one by one differ by rounding.
#[test]
fn what_is_left_out_does_not_change_the_picture() {
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden");
    let scenes = [
        "lights/three.iv",
        "textures/model-modulate.iv",
        "shapes/solids.iv",
    ];
    for scene in scenes {
        for shading in ivcam_render::shade::Shading::ALL {
            let mut plan = Plan::of_era(Era::Modern, golden.join(scene));
            plan.resolution = Resolution::of(24, 16);
            plan.shading = shading;
            plan.stop = ivcam_render::render::Stop::after(2);
            let mut session = Session::open(plan).expect("the scene is whole");
            let lean = session.expose(&|_| ()).film;
            session.compile_everything().expect("the scene is whole");
            let whole = session.expose(&|_| ()).film;
            assert!(lean.mean() > 0.0, "{scene} {shading:?}");
            assert!(lean.pixels == whole.pixels, "{scene} {shading:?}");
            session.force(Unneeded::Transparency);
            session.force(Unneeded::Visibility);
            let forced = session.expose(&|_| ()).film;
            assert!(lean.pixels == forced.pixels, "{scene} {shading:?}");
            session.force(Unneeded::Points);
            let forced = session.expose(&|_| ()).film;
            let mut pairs = lean.pixels.iter().zip(&forced.pixels);
            let same = pairs.all(|(a, b)| (a.mean - b.mean).abs().max_element() < 1e-6);
            assert!(same, "{scene} {shading:?}");
        }
    }
}

/// A source of rows that the test reads itself.
fn rows_of(session: &Session) -> (Vec<[f32; 3]>, ivcam_render::render::Summary, usize) {
    let (mut pixels, mut pieces) = (Vec::new(), 0);
    let made = session
        .expose_in_strips("", &|_| (), |heading, rows| {
            assert_eq!(heading.resolution, session.region().resolution());
            while let Some(more) = rows.next_rows().unwrap() {
                pixels.extend(more.iter().copied());
                pieces += 1;
            }
            Ok(())
        })
        .unwrap();
    assert!(!made.sample.pixels.is_empty());
    (pixels, made.summary, pieces)
}

#[test]
fn a_picture_in_strips_has_the_pixels_of_the_whole_and_an_error_like_it() {
    let region = Region::new([3, 5], [41, 38]);
    let folder = Folder::new("strips");
    let mut compared = 0;
    for (adaptive, part) in [(false, None), (true, None), (true, Some(region))] {
        let mut plan = plan(&folder);
        plan.resolution = Resolution::of(60, 45);
        (plan.adaptive, plan.region) = (adaptive, part);
        plan.stop = ivcam_render::render::Stop::after(16);
        let mut session = Session::open(plan).unwrap();
        let whole = session.expose(&|_| ());
        // A quarter of it is for the 60 or 41 pixels of 16 rows.
        session.plan.memory = MemoryLimit::Bytes(64 << 10);
        session.plan.whole_film = None;
        assert!(session.is_in_strips());
        let (pixels, summary, pieces) = rows_of(&session);
        assert!(pieces == 3, "{pieces} strips");
        assert!(pixels == session.develop(&whole, "").pixels);
        assert_eq!(summary.counts.film_rays, whole.counts.film_rays);
        // The error of a few pixels is not always known.
        if let (Ok(a), Ok(b)) = (summary.error, whole.film.error()) {
            assert!(a.low < b.high && b.low < a.high, "{a:?} {b:?}");
            compared += 1;
        }
    }
    assert!(compared > 0);
}

/// Bands of other heights get their samples in other passes, in any order. Half of a unit of 64
/// samples is a pass too.
#[test]
fn a_picture_that_is_joined_from_parts_has_the_bits_of_one_render() {
    let folder = Folder::new("parts");
    let mut plan = plan(&folder);
    plan.stop = Stop::after(70);
    let session = Session::open(plan.clone()).expect("the scene is whole");
    let whole = session.expose(&|_| ());
    let bands = [
        (16, 8, &[70][..]),
        (0, 5, &[1, 4, 70]),
        (5, 11, &[33, 64, 70]),
    ];
    let parts = bands.map(|(top, height, passes)| {
        let region = Region::new([0, top], [36, height]);
        let more = |sums: Option<Vec<u8>>, samples: &u32| {
            let made = session.expose_part(region, *samples, sums.as_deref());
            Some(made.expect("a part").0)
        };
        passes.iter().fold(None, more).expect("sums")
    });
    let joined = session
        .join_parts(parts.iter().map(Vec::as_slice))
        .expect("the whole picture");
    let levels = |exposure: &Exposure| -> Vec<[u64; 3]> {
        let bits = |p: &ivcam_optics::film::Exposed| p.mean.to_array().map(f64::to_bits);
        exposure.film.pixels.iter().map(bits).collect()
    };
    assert_eq!(levels(&joined), levels(&whole));
    assert_eq!(joined.film.error(), whole.film.error());
    assert_eq!(joined.samples, 70);

    let without_one = session.join_parts(parts[1..].iter().map(Vec::as_slice));
    assert!(
        without_one
            .unwrap_err()
            .message
            .contains("one whole picture")
    );
    let cut = session.join_parts([&parts[0][..100]]).unwrap_err();
    assert!(cut.message.contains("damaged"), "{}", cut.message);
}

#[test]
fn a_lens_says_where_it_cannot_show_what_the_scenes_camera_sees() {
    let folder = Folder::new("field");
    for (camera, expected) in [
        (
            "FrustumCamera { left -.2 right .6 }",
            "the view of the scene's camera is off its axis, and the lens is on it",
        ),
        (
            "PerspectiveCamera { heightAngle 0 }",
            "the camera's `heightAngle` should be above 0",
        ),
        (
            "OrthographicCamera { height 4 focalDistance 5 nearDistance -1 }",
            "the scene's camera is orthographic, and the lens makes a perspective",
        ),
        (
            "OrthographicCamera { height 4 focalDistance 5 }",
            "the scene's camera sees 44° from bottom to top",
        ),
    ] {
        let mut plan = plan(&folder);
        let scene = format!("#Inventor V2.1 ascii\n{camera} Cube {{ }}\n");
        plan.scene = folder.file("seen.iv", &scene).into();
        let session = Session::open(plan).expect("the scene is whole");
        let found: Vec<String> = session
            .sink
            .items()
            .iter()
            .map(|d| d.render(false))
            .collect();
        assert!(
            found.iter().any(|text| text.contains(expected)),
            "{found:?}"
        );
    }
}

#[test]
fn a_picture_says_what_it_does_not_show_of_the_scenes_cameras() {
    let folder = Folder::new("cameras-in-force");
    let frame = "PerspectiveCamera { viewportMapping CROP_VIEWPORT_LINE_FRAME aspectRatio 1 }";
    let two = "Separator { PerspectiveCamera { } } PerspectiveCamera { position 0 0 9 }";
    for (cameras, size, expected) in [
        (
            frame,
            [36, 24],
            "the frame of `CROP_VIEWPORT_LINE_FRAME` is left out",
        ),
        (frame, [24, 24], ""),
        (two, [36, 24], "this `PerspectiveCamera` acts on its shapes"),
    ] {
        let mut plan = plan(&folder);
        (plan.optics, plan.focus) = (Optics::Pinhole, None);
        plan.resolution = Resolution::of(size[0], size[1]);
        let scene = format!("#Inventor V2.1 ascii\n{cameras} Cube {{ }}\n");
        plan.scene = folder.file("seen.iv", &scene).into();
        let session = Session::open(plan).expect("the scene is whole");
        let found = session.sink.items();
        let mut printed = found.iter().filter(|d| d.severity >= Severity::Warning);
        let said = printed.any(|d| d.message.contains(expected));
        assert!(said != expected.is_empty(), "{cameras}: {found:?}");
    }
}
