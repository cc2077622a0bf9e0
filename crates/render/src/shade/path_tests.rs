//! Tests of model `i` on scenes whose light is known.

use std::sync::Arc;

use glam::Vec3;
use ivcam_base::math::lanes::{LANES, Vec3Lanes, of_lane};
use ivcam_inventor::iv::{Document, Limits, NoFiles, linear_of_display};
use ivcam_inventor::snapshot::Snapshot;
use ivcam_optics::sampling::PathPoints;

use super::{EnvironmentLight, Flash, PathOptions, ShadeOptions, Shader, Shading, Work};
use crate::bvh::{PacketHits, Ray, RayPacket};
use crate::scene::{ColorCoding, CompileOptions, Light, RenderScene};

fn compile(text: &str) -> RenderScene {
    let text = format!("#Inventor V2.1 ascii\nEnvironment {{ ambientIntensity 0 }}\n{text}");
    let document = Document::read_headerless("path.iv", text.into_bytes()).unwrap();
    RenderScene::compile(&Snapshot::at(&document, 0.0), &CompileOptions::default()).unwrap()
}

fn with(path: PathOptions) -> ShadeOptions {
    ShadeOptions {
        path,
        ..ShadeOptions::default()
    }
}

fn at_depth(depth: u32) -> ShadeOptions {
    with(PathOptions {
        max_depth: Some(depth),
        ..PathOptions::default()
    })
}

/// The mean radiance along a ray over a number of samples, and its standard error.
fn mean(scene: &RenderScene, options: &ShadeOptions, ray: &Ray, count: u64) -> (f64, f64) {
    let shader = Shader::new(scene, Shading::Path, options.clone());
    let (mut work, mut hits) = (Work::default(), PacketHits::default());
    let mut rays = RayPacket::default();
    (0..LANES).for_each(|lane| rays.set(lane, ray));
    let (mut sum, mut square) = (0.0, 0.0);
    for first in 0..count / LANES as u64 {
        let points = std::array::from_fn(|lane| {
            PathPoints::independent(first * LANES as u64 + lane as u64 + 1)
        });
        let mut radiances = Vec3Lanes::default();
        shader.radiances(&rays, Some(&points), &mut hits, &mut radiances, &mut work);
        for lane in 0..LANES {
            let value = f64::from(of_lane(&radiances, lane).x);
            (sum, square) = (sum + value, square + value * value);
        }
    }
    let n = (count / LANES as u64 * LANES as u64) as f64;
    let mean = sum / n;
    (mean, ((square / n - mean * mean).max(0.0) / n).sqrt())
}

/// Asserts that a mean is as expected: |z| above 4.4 has a probability of 1e-5.
fn expect(name: &str, (mean, sigma): (f64, f64), expected: f64) {
    let z = (mean - expected).abs() / sigma.max(1e-6 * expected.max(1e-3));
    assert!(z < 4.4, "{name}: {mean} ± {sigma}, not {expected}");
}

/// Light that is reflected n times has the share aⁿ of the emission: e/(1 − a) in sum.
#[test]
fn a_closed_room_of_one_material_shows_its_emission_over_what_it_absorbs() {
    for shape in [
        "Sphere { radius 2 }",
        "Cube { width 3 }",
        "Scale { scaleFactor 3 2 2 } Sphere { }",
    ] {
        for albedo in [0.1, 0.5, 0.9, 0.99] {
            let text =
                format!("Material {{ diffuseColor {albedo} 0 0 emissiveColor .5 0 0 }} {shape}");
            let ray = Ray::new(Vec3::new(0.1, 0.2, 0.3), Vec3::new(0.5, 0.3, -0.8));
            let found = mean(&compile(&text), &ShadeOptions::default(), &ray, 20_000);
            expect(&format!("{shape} {albedo}"), found, 0.5 / (1.0 - albedo));
        }
    }
}

/// Rays from above onto a floor with a box.
fn rays() -> impl Iterator<Item = Ray> {
    (0..400u16).map(|i| {
        let at = |k: u16| (f32::from(k) + 0.37) / 20.0 - 0.5;
        let aim = Vec3::new(5.0 * at(i % 20), -1.7, 5.0 * at(i / 20));
        let eye = Vec3::new(0.3, 6.0, 4.0);
        Ray::new(eye, aim - eye)
    })
}

const FLOOR_BELOW: &str = "Separator { Material { diffuseColor .8 0 0 } \
    Translation { translation 0 -.5 0 } Cube { width 90 height 1 depth 9 } }";

const FLOOR: &str = "Translation { translation 0 -1.7 0 } Material { diffuseColor .7 .4 .2 } \
    Separator { Translation { translation 0 -.5 0 } Cube { width 9 height 1 depth 9 } } \
    Translation { translation 0 .5 0 } Cube { height 1 width 1 depth 1 }";

#[test]
fn a_matte_scene_with_one_turn_of_light_is_that_of_model_r() {
    let point = "Environment { attenuation .1 .2 1 ambientIntensity 0 } \
        PointLight { location 2 3 1 intensity .8 color 1 .8 .6 }";
    let sun = "DirectionalLight { direction -1 -2 -.5 intensity .6 }";
    let spot = "SpotLight { location -2 4 1 direction 2 -4 -1 cutOffAngle .5 dropOffRate .3 }";
    for lights in [point, sun, spot] {
        let scene = compile(&format!("{lights} {FLOOR}"));
        let r = Shader::new(&scene, Shading::Recursive, ShadeOptions::default());
        let i = Shader::new(&scene, Shading::Path, at_depth(1));
        let (mut work, mut lit) = (Work::default(), 0);
        for ray in rays() {
            let (known, found) = (r.radiance(&ray, &mut work), i.radiance(&ray, &mut work));
            lit += usize::from(known.x > 0.05);
            let off = (known - found).abs().max_element();
            assert!(off < 2e-5, "{lights}: {known} {found}");
        }
        assert!(lit > 100, "{lights}: {lit}");
    }
    // Of several lights each sample shows one, in the mean all of them.
    let scene = compile(&format!("{point} {sun} {spot} {FLOOR}"));
    let r = Shader::new(&scene, Shading::Recursive, ShadeOptions::default());
    for ray in rays().step_by(37) {
        let known = f64::from(r.radiance(&ray, &mut Work::default()).x);
        expect(
            "three lights",
            mean(&scene, &at_depth(1), &ray, 4_000),
            known,
        );
    }
    let many: String = (0..90)
        .map(|i| {
            format!(
                "PointLight {{ location {} 3 {} intensity .02 }}\n",
                i % 9 - 4,
                i / 9 - 5
            )
        })
        .collect();
    let scene = compile(&format!("{many} {FLOOR}"));
    let r = Shader::new(&scene, Shading::Diffuse, ShadeOptions::default());
    let open = Ray::new(Vec3::new(3.0, 6.0, 3.0), Vec3::NEG_Y);
    let known = f64::from(r.radiance(&open, &mut Work::default()).x);
    expect(
        "ninety lights",
        mean(&scene, &at_depth(1), &open, 4_000),
        known,
    );
}

#[test]
fn a_large_lamp_far_away_brings_the_irradiance_of_a_point() {
    let light = "PointLight { location 1 20 2 } DirectionalLight { direction .2 -1 .1 }";
    let scene = compile(&format!("{light} {FLOOR}"));
    let ray = Ray::new(Vec3::new(3.0, 5.0, 3.0), Vec3::NEG_Y);
    let small = mean(&scene, &at_depth(1), &ray, 20_000);
    let large = with(PathOptions {
        max_depth: Some(1),
        light_radius: 0.5,
        sun_angle: 0.05,
        ..PathOptions::default()
    });
    let (found, sigma) = mean(&scene, &large, &ray, 20_000);
    // The mean cosine over a cone of the half angle α is α²/4 less: 1.6e-4 of the sun's.
    let sigma = sigma.max(5e-5 * found);
    expect("large lamps", (found, sigma), small.0);
    // Half of a large lamp that is half hidden by the edge of a wall.
    let wall = "Separator { Translation { translation -10 5 0 } \
        Cube { width 20 height .1 depth 20 } }";
    let scene = compile(&format!("PointLight {{ location 0 10 0 }} {wall} {FLOOR}"));
    let ray = Ray::new(Vec3::new(0.0, 4.0, 3.0), Vec3::NEG_Y);
    let open = compile(&format!("PointLight {{ location 0 10 0 }} {FLOOR}"));
    let whole = mean(&open, &at_depth(1), &ray, 64).0;
    expect(
        "half of a lamp",
        mean(&scene, &large, &ray, 20_000),
        0.5 * whole,
    );
}

/// A sphere of radiance L and radius r, straight above at a distance d, brings the irradiance
/// π L r²/d²; a disc below it of albedo ρ shows ρ/π of that.
#[test]
fn luminous_shapes_light_the_scene() {
    let floor = "Material { diffuseColor .8 0 0 } Separator { Translation { translation 0 -.5 0 } \
        Cube { width 90 height 1 depth 90 } }";
    let ray = Ray::new(Vec3::new(1.0, 1.0, 0.0), Vec3::new(-1.0, -1.0, 0.0));
    for (shape, share) in [
        (
            "Translation { translation 0 3 0 } Sphere { radius .5 }",
            0.25 / 9.0,
        ),
        // A disc: r²/(r² + d²).
        (
            "Translation { translation 0 3 0 } Cylinder { parts BOTTOM radius 1 height 2 }",
            1.0 / 5.0,
        ),
        // The same disc as a polygon with 400 corners.
        ("DISC", 1.0 / 5.0),
    ] {
        let polygon: String = (0..400)
            .map(|i| {
                let turn = f64::from(i) * std::f64::consts::TAU / 400.0;
                format!("{} 2 {}, ", libm::cos(turn), libm::sin(turn))
            })
            .collect();
        let disc = format!("Coordinate3 {{ point [ {polygon} ] }} FaceSet {{ numVertices 400 }}");
        let shape = shape.replace("DISC", &disc);
        let text = format!("{floor} Material {{ diffuseColor 0 0 0 emissiveColor 4 0 0 }} {shape}");
        let scene = compile(&text);
        let (found, sigma) = mean(&scene, &at_depth(1), &ray, 40_000);
        // The polygon's area is 4e-5 less than the circle's.
        expect(
            &shape[..40],
            (found, sigma.max(1e-4 * found)),
            0.8 * 4.0 * share,
        );
        assert!(sigma < 0.01 * found, "{sigma} of {found}");
    }
}

/// A lamp 2 cm below a ceiling: the rays between them are not much longer than their clearance of
/// the surfaces. Half of all directions from a point above the lamp's edge meet the lamp.
#[test]
fn a_lamp_close_to_the_surface_that_it_lights_is_not_in_its_own_shadow() {
    for height in [0.02, 0.002] {
        let scene = compile(&format!(
            "Translation {{ translation 0 3 -40 }} Material {{ diffuseColor .8 0 0 }}
            Coordinate3 {{ point [ -9 0 -9, 9 0 -9, 9 0 9, -9 0 9 ] }} FaceSet {{ numVertices 4 }}
            Material {{ diffuseColor 0 0 0 emissiveColor 2 0 0 }}
            Translation {{ translation 0 -{height} 0 }}
            Coordinate3 {{ point [ 0 0 -9, 9 0 -9, 9 0 9, 0 0 9 ] }} FaceSet {{ numVertices 4 }}"
        ));
        let eye = Vec3::new(-5.0, 3.0 - height, -40.1);
        let ray = Ray::new(eye, Vec3::new(0.0, 3.0, -40.1) - eye);
        let (found, sigma) = mean(&scene, &at_depth(1), &ray, 200_000);
        // The other half of the directions meets nothing; the lamp's far ends are 9 m away.
        expect("gap", (found, sigma.max(1e-3 * found)), 0.5 * 0.8 * 2.0);
    }
}

#[test]
fn an_even_sky_shows_a_matte_floor_in_its_color() {
    let scene = compile(FLOOR);
    let ray = Ray::new(Vec3::new(3.0, 4.0, 3.0), Vec3::NEG_Y);
    for pixels in [vec![Vec3::splat(2.0); 8], vec![Vec3::splat(2.0); 1]] {
        let (width, height) = if pixels.len() == 8 { (4, 2) } else { (1, 1) };
        let light = EnvironmentLight::new(width, height, pixels).unwrap();
        let options = with(PathOptions {
            max_depth: Some(1),
            environment: Some(light.into()),
            ..PathOptions::default()
        });
        expect("sky", mean(&scene, &options, &ray, 20_000), 2.0 * 0.7);
    }
}

#[test]
fn a_background_that_lights_takes_the_place_of_the_ambient_light() {
    let text =
        format!("#Inventor V2.1 ascii\nEnvironment {{ ambientIntensity .5 }}\n{FLOOR_BELOW}");
    let document = Document::read_headerless("sky.iv", text.into_bytes()).unwrap();
    let options = CompileOptions {
        background: Some((Vec3::ONE, true)),
        ..CompileOptions::default()
    };
    let scene = RenderScene::compile(&Snapshot::at(&document, 0.0), &options).unwrap();
    assert!(scene.ambient_radiance() != Vec3::ZERO);
    let ray = Ray::new(Vec3::new(3.0, 4.0, 3.0), Vec3::NEG_Y);
    let lit = with(PathOptions {
        max_depth: Some(1),
        background_lights: true,
        ..PathOptions::default()
    });
    expect("background", mean(&scene, &lit, &ray, 20_000), 0.8);
}

/// The corners of the box have normals of a sphere, which are seen by rays from inside its walls.
#[test]
fn no_light_leaks_into_a_closed_box() {
    let corners = "-1 -1 -1, 1 -1 -1, 1 1 -1, -1 1 -1, -1 -1 1, 1 -1 1, 1 1 1, -1 1 1";
    let faces = "3 2 1 0 -1 4 5 6 7 -1 0 1 5 4 -1 1 2 6 5 -1 2 3 7 6 -1 3 0 4 7 -1";
    for normals in [
        "",
        "NormalBinding { value PER_VERTEX_INDEXED } Normal { vector [ NORMALS ] }",
    ] {
        let normals = normals.replace("NORMALS", corners);
        let scene = compile(&format!(
            "PointLight {{ location 3 4 5 intensity 100 }} Material {{ diffuseColor .9 .9 .9 \
             specularColor .1 .1 .1 }} Coordinate3 {{ point [ {corners} ] }} {normals} \
             IndexedFaceSet {{ coordIndex [ {faces} ] }} \
             Material {{ emissiveColor 99 99 99 }} Translation {{ translation 0 1.2 0 }} \
             Sphere {{ radius .15 }}"
        ));
        for i in 0..200u16 {
            let turn = f32::from(i) * 0.618_034;
            let toward = Vec3::new(libm::cosf(turn), libm::sinf(3.1 * turn), libm::sinf(turn));
            let ray = Ray::new(Vec3::new(0.1, 0.2, 0.1), toward);
            let found = mean(&scene, &ShadeOptions::default(), &ray, 64);
            assert!(found.0 == 0.0, "{toward}: {found:?}");
        }
    }
}

#[test]
fn hostile_emission_and_dark_and_white_rooms_end_with_a_number() {
    let ray = Ray::new(Vec3::new(0.1, 0.2, 0.3), Vec3::new(0.5, 0.3, -0.8));
    for (material, most) in [
        ("emissiveColor 1e30 -1e30 1e38 diffuseColor .5 .5 .5", 1e11),
        (
            "emissiveColor NaN 1 1 diffuseColor NaN 2 -3 specularColor 1e30 0 0",
            10.0,
        ),
        ("emissiveColor 0 0 0 diffuseColor 0 0 0", 0.0),
        // Nothing is absorbed and nothing shines.
        ("diffuseColor 1 1 1", 0.0),
    ] {
        let scene = compile(&format!("Material {{ {material} }} Cube {{ }}"));
        let (found, sigma) = mean(&scene, &ShadeOptions::default(), &ray, 320);
        assert!(
            (0.0..=most).contains(&found) && sigma.is_finite(),
            "{material}: {found}"
        );
    }
}

/// With probability t a ray goes straight on: a pane shows (1 − t) of itself and t of the wall.
#[test]
fn a_transparent_pane_shows_what_is_behind_it_and_dims_what_shines_through() {
    let pane = "Separator { Translation { translation 0 0 -2 } \
        Material { diffuseColor 0 0 0 emissiveColor 1 0 0 transparency .75 } \
        Cube { width 9 height 9 depth .001 } }";
    let wall = "Translation { translation 0 0 -5 } \
        Material { diffuseColor 0 0 0 emissiveColor 3 0 0 } Cube { width 99 height 99 depth .1 }";
    let scene = compile(&format!("{pane} {wall}"));
    let ray = Ray::new(Vec3::new(0.1, 0.3, 0.0), Vec3::NEG_Z);
    // The pane has two faces.
    let expected = 0.25 + 0.75 * 0.25 + 0.5625 * 3.0;
    expect(
        "pane",
        mean(&scene, &ShadeOptions::default(), &ray, 20_000),
        expected,
    );
}

/// Glass that is lit from everywhere vanishes: what it reflects and what it lets through add up.
#[test]
fn clear_glass_and_mirrors_vanish_in_an_even_light() {
    let room = "Material { diffuseColor 0 0 0 emissiveColor .5 0 0 } Sphere { radius 9 }";
    let glass = "Material { fields [ SFFloat refractionIndex ] diffuseColor 0 0 0 transparency 1
        refractionIndex 1.5 } Sphere { radius 2 }";
    let mirror = "Material { diffuseColor 0 0 0 specularColor 1 1 1 shininess 1 } Cube { }";
    for (shape, mirrors) in [(glass, None), (mirror, Some(0.5))] {
        let scene = compile(&format!("{room} {shape}"));
        let options = ShadeOptions {
            mirrors,
            ..ShadeOptions::default()
        };
        let ray = Ray::new(Vec3::new(0.3, 0.2, 5.0), Vec3::NEG_Z);
        expect(shape, mean(&scene, &options, &ray, 20_000), 0.5);
    }
}

/// A slab of the index 1.5 lets the share (1 − R)/(1 + R) through, where R is 0.04. Its shape may
/// cull back faces, which are those where light leaves a body.
#[test]
fn light_leaves_glass_through_back_faces_that_its_shape_culls() {
    let solid = "ShapeHints { vertexOrdering COUNTERCLOCKWISE shapeType SOLID }";
    let behind = |hints: &str, shape: &str| {
        compile(&format!(
            "Separator {{ Material {{ diffuseColor 0 0 0 emissiveColor 3 0 0 }}
               Translation {{ translation -2 0 -6 }} Cube {{ width 4 height 9 depth .1 }} }}
             {hints} Material {{ fields [ SFFloat refractionIndex ] diffuseColor 0 0 0
               transparency 1 refractionIndex 1.5 }} {shape}"
        ))
    };
    let seen = |scene: &RenderScene, x: f32| {
        let ray = Ray::new(Vec3::new(x, 0.1, 6.0), Vec3::NEG_Z);
        mean(scene, &ShadeOptions::default(), &ray, 10_000)
    };
    for hints in ["", solid] {
        let slab = behind(hints, "Cube { width 9 height 9 depth .5 }");
        expect(hints, seen(&slab, -1.0), 3.0 * 0.96 / 1.04);
    }
    for shape in ["Sphere { radius 1 }", "Cube { width 1 }"] {
        let [plain, culled] = ["", solid].map(|hints| behind(hints, shape));
        for x in [-0.7, -0.3, 0.2, 0.6] {
            assert_eq!(seen(&plain, x), seen(&culled, x), "{shape} {x}");
        }
    }
}

/// Two squares in the light of 5 lux, the left of the color .8 .5 .2 and the right with a texture
/// of the levels 128, 64 and 255.
const LIT_SQUARES: &str = r#"{
    "asset": { "version": "2.0" },
    "extensionsUsed": [ "KHR_lights_punctual", "KHR_materials_specular" ],
    "extensions": { "KHR_lights_punctual": { "lights": [
        { "type": "directional", "intensity": 5, "color": [1, 0.5, 0.25] } ] } },
    "scene": 0, "scenes": [ { "nodes": [0, 1, 2] } ],
    "nodes": [ { "mesh": 0, "translation": [-2, 0, 0] }, { "mesh": 1, "translation": [2, 0, 0] },
        { "extensions": { "KHR_lights_punctual": { "light": 0 } } } ],
    "meshes": [
        { "primitives": [ { "attributes": { "POSITION": 0, "TEXCOORD_0": 1 },
            "indices": 2, "material": 0 } ] },
        { "primitives": [ { "attributes": { "POSITION": 0, "TEXCOORD_0": 1 },
            "indices": 2, "material": 1 } ] } ],
    "materials": [
        { "pbrMetallicRoughness": { "baseColorFactor": [0.8, 0.5, 0.2, 1], "metallicFactor": 0 },
            "extensions": { "KHR_materials_specular": { "specularFactor": 0 } } },
        { "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 }, "metallicFactor": 0 },
            "extensions": { "KHR_materials_specular": { "specularFactor": 0 } } } ],
    "textures": [ { "source": 0 } ], "images": [ { "uri": "PICTURE" } ],
    "accessors": [
        { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3",
            "min": [-1, -1, 0], "max": [1, 1, 0] },
        { "bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2" },
        { "bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR" } ],
    "bufferViews": [ { "buffer": 0, "byteLength": 48 },
        { "buffer": 0, "byteOffset": 48, "byteLength": 32 },
        { "buffer": 0, "byteOffset": 80, "byteLength": 12 } ],
    "buffers": [ { "byteLength": 92, "uri": "data:application/octet-stream;base64,AACAvwAAgL8AAAAAAACAPwAAgL8AAAAAAACAPwAAgD8AAAAAAACAvwAAgD8AAAAAAAAAAAAAAAAAAIA/AAAAAAAAgD8AAIA/AAAAAAAAgD8AAAEAAgAAAAIAAwA=" } ] }"#;

/// A picture of one pixel with the levels 128, 64 and 255.
const PICTURE: &str = "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGNocPgPAAMDAcD+h1vkAAAAAElFTkSuQmCC";
const LEVELS: Vec3 = Vec3::new(128.0 / 255.0, 64.0 / 255.0, 1.0);

/// Compiles a scene of any format with a meaning of its colors.
fn compile_with(colors: ColorCoding, text: &str) -> RenderScene {
    let text = text.replace("PICTURE", PICTURE).into_bytes();
    let document = Document::read("a", text, Arc::new(NoFiles), &Limits::default()).unwrap();
    let options = CompileOptions {
        colors,
        ..CompileOptions::default()
    };
    RenderScene::compile(&Snapshot::at(&document, 0.0), &options).unwrap()
}

/// The direct light of a point of a scene that is seen along −z.
fn direct_light(scene: &RenderScene, x: f32) -> Vec3 {
    let shader = Shader::new(scene, Shading::Path, at_depth(1));
    let ray = Ray::new(Vec3::new(x, 0.1, 5.0), Vec3::NEG_Z);
    shader.radiance(&ray, &mut Work::default())
}

#[track_caller]
fn assert_near(found: Vec3, expected: Vec3) {
    let off = (found - expected).abs().max_element();
    assert!(off < 1e-5, "{found}, not {expected}");
}

/// An albedo ρ sends back ρE/π of the illuminance E.
#[test]
fn what_a_file_states_as_light_is_light_whatever_its_colors_mean() {
    let decoded = LEVELS.map(linear_of_display);
    let light = Vec3::new(5.0, 2.5, 1.25) / std::f32::consts::PI;
    for colors in [ColorCoding::Linear, ColorCoding::Display] {
        let scene = compile_with(colors, LIT_SQUARES);
        let plain = Vec3::new(0.8, 0.5, 0.2);
        assert_near(direct_light(&scene, -2.0), plain * light);
        assert_near(direct_light(&scene, 2.0), decoded * light);
    }
    let own = "#Inventor V2.1 ascii\nEnvironment { ambientIntensity 0 } Material { diffuseColor .5 .5 .5 }
        DirectionalLight { } Cube { }";
    let seen = |colors| direct_light(&compile_with(colors, own), 0.0);
    assert_near(seen(ColorCoding::Linear), Vec3::splat(0.5));
    assert_near(seen(ColorCoding::Display), Vec3::splat(0.214_041));
}

/// A texture without a material has the file's colors, and that of a material of light has levels.
#[test]
fn one_picture_may_have_both_meanings_of_its_colors() {
    let scene = "#X3D V4.0 utf8\nPROFILE Full\n\
        Transform { translation -2 0 0 children Shape {
          appearance Appearance { texture DEF T ImageTexture { url \"PICTURE\" } } geometry Box { } } }
        Transform { translation 2 0 0 children Shape { appearance Appearance {
          material UnlitMaterial { emissiveTexture USE T } } geometry Box { } } }
        Shape { appearance Appearance { material PhysicalMaterial { emissiveColor .5 .25 1 } }
          geometry LineSet { vertexCount 2 coord Coordinate { point [ 0 9 0, 1 9 0 ] } } }";
    let decoded = LEVELS.map(linear_of_display);
    for (colors, own) in [
        (ColorCoding::Levels, LEVELS),
        (ColorCoding::Linear, LEVELS),
        (ColorCoding::Display, decoded),
    ] {
        let scene = compile_with(colors, scene);
        assert_near(direct_light(&scene, -2.0), own);
        let (unlit, line) = match colors {
            ColorCoding::Levels => (LEVELS, Vec3::new(0.735_357, 0.537_099, 1.0)),
            _ => (decoded, Vec3::new(0.5, 0.25, 1.0)),
        };
        assert_near(direct_light(&scene, 2.0), unlit);
        assert_near(scene.surfaces()[2].diffuse[0], line);
    }
}

/// `KHR_materials_specular` with the strength s: F₀ = .04 s at normal incidence, and s at grazing
/// angles.
#[test]
fn the_strength_of_a_physical_material_limits_grazing_reflection() {
    for strength in [1.0f32, 0.5, 0.1] {
        let scene = compile_with(
            ColorCoding::Linear,
            &format!(
                "#X3D V4.0 utf8\nPROFILE Full\n\
                 Shape {{ appearance Appearance {{ material UnlitMaterial {{ }} }}
                   geometry Sphere {{ radius 9 solid FALSE }} }}
                 Shape {{ appearance Appearance {{ material PhysicalMaterial {{
                   baseColor 0 0 0 metallic 0 roughness 0
                   extensions SpecularMaterialExtension {{ specularStrength {strength} }} }} }}
                   geometry Box {{ size 4 4 .2 }} }}"
            ),
        );
        for degrees in [60.0f32, 85.0] {
            let (sin, cos) = (
                libm::sinf(degrees.to_radians()),
                libm::cosf(degrees.to_radians()),
            );
            let ray = Ray::new(
                Vec3::new(2.0 * sin, 0.3, 0.1 + 2.0 * cos),
                Vec3::new(-sin, 0.0, -cos),
            );
            let normal = 0.04 * strength;
            let expected = normal + (strength - normal) * (1.0 - cos).powi(5);
            let found = mean(&scene, &at_depth(1), &ray, 50_000);
            expect(
                &format!("{strength} at {degrees}"),
                found,
                f64::from(expected),
            );
        }
    }
}

#[test]
fn a_headlight_lights_what_the_camera_sees_without_shadows() {
    let scene = compile(FLOOR);
    let options = ShadeOptions {
        headlight: Some(Light::headlight(Vec3::NEG_Y)),
        ..at_depth(1)
    };
    let ray = Ray::new(Vec3::new(3.0, 4.0, 3.0), Vec3::NEG_Y);
    expect("headlight", mean(&scene, &options, &ray, 64), 0.7);
}

/// On a wall that faces the camera, at any distance, and behind a card that the camera sees past.
#[test]
fn a_flash_has_the_light_of_the_headlight_and_throws_shadows() {
    let options = ShadeOptions {
        headlight: Some(Light::headlight(Vec3::NEG_Z)),
        ..with(PathOptions {
            max_depth: Some(1),
            flash: Some(Flash {
                position: Vec3::new(0.5, 0.0, 0.0),
                radius: 0.01,
            }),
            ..PathOptions::default()
        })
    };
    let wall = |z: f32| {
        format!(
            "Separator {{ Translation {{ translation 0 0 {} }} \
             Material {{ diffuseColor .7 0 0 }} Cube {{ width 99 height 99 depth 1 }} }}",
            z - 0.5
        )
    };
    for z in [-5.0, -20.0f32] {
        let ray = Ray::new(Vec3::ZERO, Vec3::new(-0.125, 0.0, z));
        let cosine = f64::from(z.abs()) / f64::from(z.hypot(0.625));
        let found = mean(&compile(&wall(z)), &options, &ray, 6_400);
        expect("wall", found, 0.7 * cosine);
    }
    let card = "Translation { translation 0 0 -4 } Cube { width .1 height .1 depth 1e-5 }";
    let scene = compile(&format!("{} {card}", wall(-5.0)));
    let ray = Ray::new(Vec3::ZERO, Vec3::new(-0.125, 0.0, -5.0));
    expect("in the shadow", mean(&scene, &options, &ray, 640), 0.0);
    // The middle of the shadow's edge: the ray from the flash passes the card's edge at -0.05.
    let edge = Ray::new(Vec3::ZERO, Vec3::new(-0.1875, 0.0, -5.0));
    let (found, sigma) = mean(&scene, &options, &edge, 20_000);
    // The light is even over the disc to 2e-3.
    let half = 0.5 * 0.7 * f64::from(5.0 / 5f32.hypot(0.6875));
    expect("penumbra", (found, sigma.max(2e-3 * found)), half);
}

/// A row of 100 balls, 300 m long, of which the near ones light a floor.
#[test]
fn many_lamps_light_a_point_as_the_sum_of_each_does_with_little_noise() {
    let ray = Ray::new(Vec3::new(0.3, 1.0, 0.5), Vec3::NEG_Y);
    let point = Vec3::new(0.3, 0.0, 0.5);
    let glow = "Material { diffuseColor 0 0 0 emissiveColor 9 0 0 }";
    let (mut balls, mut known) = (String::new(), 0.0);
    for i in -50..50i16 {
        let place = Vec3::new(3.0 * f32::from(i), 2.0, 0.0);
        balls += &format!(
            "Separator {{ Translation {{ translation {} 2 0 }} Sphere {{ radius .1 }} }}\n",
            place.x
        );
        // A ball brings π L r²/d² cos θ, and the floor shows ρ/π of it.
        let to = place - point;
        let square = f64::from(to.length_squared());
        known += 0.8 * 9.0 * 0.01 / square * f64::from(to.y) / square.sqrt();
    }
    let scene = compile(&format!("{FLOOR_BELOW} {glow} {balls}"));
    let (found, sigma) = mean(&scene, &at_depth(1), &ray, 20_000);
    expect("balls", (found, sigma), known);
    // Drawn by their power alone, a sample would have a noise of 7.9 times the mean.
    assert!(sigma * 20_000f64.sqrt() < 1.5 * found, "{sigma} of {found}");
}

/// Most of a box's six sides bring a floor no light. Drawn by their power alone, half of the
/// samples would be on its upper side, so that a sample had a noise of the mean.
#[test]
fn a_box_as_a_lamp_has_little_noise_and_the_light_of_its_lower_side() {
    let scene = compile(&format!(
        "{FLOOR_BELOW} Translation {{ translation 0 1.205 0 }} \
         Material {{ diffuseColor 0 0 0 emissiveColor 9 0 0 }} \
         Cube {{ width .5 height .01 depth .5 }}"
    ));
    let ray = Ray::new(Vec3::new(1.0, 1.0, 0.0), Vec3::new(-1.0, -1.0, 0.0));
    let (found, sigma) = mean(&scene, &at_depth(1), &ray, 20_000);
    // The part of the light of a hemisphere, by the cosine, that comes from a quarter of the
    // square above one of its corners (Siegel and Howell, *Thermal radiation heat transfer*).
    let side = 0.25 / 1.2f64;
    let root = (1.0 + side * side).sqrt();
    let quarter = side / root * libm::atan(side / root) / std::f64::consts::PI;
    expect("box", (found, sigma), 0.8 * 9.0 * 4.0 * quarter);
    assert!(sigma * 20_000f64.sqrt() < 0.3 * found, "{sigma} of {found}");
}

/// A spot of 0.2 m, 2 m above a floor. A point at the edge of its cone sees the part of the lamp
/// from which it is inside the cone, and so does one 3 cm farther out.
#[test]
fn the_edge_of_a_spot_with_a_size_is_soft() {
    let spot = "SpotLight { location 0 2 0 direction 0 -1 0 cutOffAngle .5 dropOffRate 0 }";
    let scene = compile(&format!("{spot} {FLOOR_BELOW}"));
    let options = with(PathOptions {
        max_depth: Some(1),
        light_radius: 0.1,
        ..PathOptions::default()
    });
    for beyond in [-0.2f32, 0.0, 0.03, 0.2] {
        let x = 2.0 * libm::tanf(0.5) + beyond;
        let to = Vec3::new(-x, 2.0, 0.0);
        let (across, toward) = (Vec3::Z, to.normalize());
        let up = toward.cross(across);
        // The disc that faces the point, ring by ring.
        let (mut known, count) = (0.0, 1000u16);
        for i in 0..count {
            for k in 0..count {
                let part = |k: u16| (f32::from(k) + 0.5) / f32::from(count);
                let (r, turn) = (0.1 * part(i).sqrt(), std::f32::consts::TAU * part(k));
                let at = to + r * (libm::cosf(turn) * across + libm::sinf(turn) * up);
                let cosine = f64::from(at.y / at.length());
                known += if cosine > libm::cos(0.5) { cosine } else { 0.0 };
            }
        }
        known *= 0.8 / (f64::from(count) * f64::from(count));
        let ray = Ray::new(Vec3::new(x, 1.0, 0.5), Vec3::new(0.0, -1.0, -0.5));
        let found = mean(&scene, &options, &ray, 40_000);
        if known == 0.0 || beyond < -0.1 {
            assert!(
                (found.0 - known).abs() < 1e-3,
                "{beyond}: {found:?} {known}"
            );
        } else {
            assert!(known > 0.05 && known < 0.6, "{beyond}: {known}");
            expect(&format!("{beyond} m beyond the edge"), found, known);
        }
    }
}
