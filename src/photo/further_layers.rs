//! The layers of a picture that are made only if they are asked for.

use ivcam_base::diag::{Diagnostic, ErrorKind, Result};
use ivcam_base::memory::MemoryLimit;
use ivcam_optics::picture::ChannelImage;
use ivcam_render::render::{Exposure, LaterMoment, Mattes, Render};
use ivcam_render::scene::MatteKind;

use super::layer_choice::FurtherLayers;
use super::layers::MOST_SAMPLES;
use super::memory::film_bytes;
use super::options::duration;
use super::session::Session;

/// The time of `motion`, in seconds, unless it is stated: that of a frame of a film.
const USUAL_FRAME: f64 = 1.0 / 24.0;

impl FurtherLayers {
    /// The words of `--layers`.
    pub const WORDS: &'static str = "cryptomatte, uv, motion or motion:TIME";

    /// Reads the words of `--layers`, separated by commas. Returns `None` if one is unknown.
    pub fn read(words: &str) -> Option<Self> {
        let mut layers = Self::default();
        for word in words.split(',') {
            match word.trim() {
                "cryptomatte" => layers.mattes = true,
                "uv" => layers.coordinates = true,
                "motion" => layers.motion = Some(USUAL_FRAME),
                other => {
                    let time = duration(other.strip_prefix("motion:")?)?;
                    layers.motion = Some(time.as_secs_f64());
                }
            }
        }
        Some(layers)
    }
}

impl Session {
    /// Adds the layers of [`Plan::layers`](super::Plan::layers) to those of an exposure. Uses
    /// rayon's current pool. Returns a warning if a pixel shows more names than are kept.
    ///
    /// # Errors
    /// Fails if the session was opened with a plan without these layers, or if the scene at the
    /// end of the motion cannot be opened or has other primitives.
    pub fn add_further_layers(
        &self,
        exposure: &Exposure,
        image: &mut ChannelImage,
    ) -> Result<Option<Box<Diagnostic>>> {
        let samples = exposure.samples.min(MOST_SAMPLES);
        if self.plan.layers.coordinates {
            let coordinates =
                self.with_own_render(|render| render.coordinates(self.region(), samples));
            image.add(["uv.U", "uv.V"], |i| coordinates[i].to_array());
        }
        if let Some(seconds) = self.plan.layers.motion {
            let later = self.later(seconds)?;
            let moment = LaterMoment {
                scene: &later.scene,
                camera: &later.camera,
            };
            let motion =
                self.with_own_render(|render| render.motion(self.region(), samples, moment));
            image.add(["forward.u", "forward.v"], |i| {
                [motion[i].x, 0.0 - motion[i].y]
            });
        }
        match self.plan.layers.mattes {
            true => self.add_mattes(exposure, image),
            false => Ok(None),
        }
    }

    /// Calls `work` with the settings of the picture's render.
    fn with_own_render<T>(&self, work: impl FnOnce(&Render<'_>) -> T) -> T {
        self.with_render(self.plan.pixel_sampler(), self.plan.stop, work)
    }

    /// Opens the scene some seconds later, with the camera that it then has. It gets the memory
    /// that is left.
    fn later(&self, seconds: f64) -> Result<Session> {
        let mut plan = self.plan.clone();
        plan.memory = MemoryLimit::Bytes(self.memory.remaining() + film_bytes(&plan));
        let mut session = Session::open(plan.clone())?;
        plan.time += seconds;
        let pose = session.scene_pose(&plan);
        session.change(plan, pose.unwrap_or_else(|| self.pose.clone()))?;
        if self.scene.has_primitives_of(&session.scene) {
            return Ok(session);
        }
        let error =
            format!("the scene has other primitives after {seconds} s, so it has no motion");
        Err(Diagnostic::unsupported(error).with_help(
            "choose another `--scene-time`, or leave `motion` out: a switch, a level of detail or a \
             text changes",
        ))
    }

    /// Finds what the samples of an exposure meet, if the scene has names.
    fn mattes(&self, exposure: &Exposure) -> Option<Mattes> {
        let film = &exposure.film;
        let samples: Vec<u32> = (0..film.pixels.len()).map(|i| film.samples(i)).collect();
        self.with_own_render(|render| render.mattes(self.region(), &samples))
    }

    /// Adds the mattes of the samples of an exposure.
    fn add_mattes(
        &self,
        exposure: &Exposure,
        image: &mut ChannelImage,
    ) -> Result<Option<Box<Diagnostic>>> {
        let (Some(mattes), Some(names)) = (self.mattes(exposure), self.scene.names()) else {
            return Err(Diagnostic::error("the scene was opened without names"));
        };
        let layers = ["CryptoObject", "CryptoMaterial"];
        for ((kind, layer), ranks) in MatteKind::ALL.into_iter().zip(layers).zip(&mattes.ranks) {
            let names: Vec<&str> = names.all(kind).collect();
            image.add_cryptomatte(layer, &names, ranks);
        }
        Ok((mattes.cut > 0).then(|| {
            let pixels = ivcam_base::diag::counted(mattes.cut, "pixel");
            Diagnostic::warning(format!(
                "{pixels} show more objects or materials than a matte can hold; those with the \
                 least share are left out of it"
            ))
            .of_kind(ErrorKind::Limit)
            .with_help("a smaller aperture, or a larger picture, has fewer in a pixel")
        }))
    }
}

#[cfg(test)]
mod tests {
    use ivcam_base::math::Meters;
    use ivcam_inventor::events::SnapshotOptions;
    use ivcam_optics::film::Resolution;
    use ivcam_optics::picture::matte_id;
    use ivcam_optics::sampling::{Filter, SamplerKind};
    use ivcam_render::render::Stop;
    use ivcam_render::scene::{CompileOptions, Instancing, RenderScene, snapshot};
    use ivcam_render::shade::Shading;

    use super::*;
    use crate::folder::Folder;
    use crate::photo::{Era, Optics, Plan};

    /// A plan for a small picture of a scene in a folder.
    fn plan(folder: &Folder, scene: &str) -> Plan {
        let path = folder.file("scene.iv", scene);
        let mut plan = Plan::of_era(Era::Modern, path);
        plan.resolution = Resolution::new(36, 24).expect("a size");
        plan.focus = Some(Meters(1.0));
        plan.shading = Shading::Flat;
        plan.dispersion = false;
        plan.stop = Stop::after(16);
        plan.layers.mattes = true;
        plan
    }

    /// Two walls and a sheet that lets half of the light through, of which one is white.
    fn walls(white: usize) -> String {
        let color = |i: usize| {
            if i == white || white == 9 {
                "1 1 1"
            } else {
                "0 0 0"
            }
        };
        format!(
            "#Inventor V2.1 ascii\nPerspectiveCamera {{ position 0 0 4 }}\n\
             DEF left Separator {{ Material {{ diffuseColor {} }}\n\
             Translation {{ translation -1.03 0 -1 }} DEF wall Cube {{ }} }}\n\
             DEF right Separator {{ Material {{ diffuseColor {} }}\n\
             Translation {{ translation 1.03 .3 0 }} DEF wall Cube {{ }} }}\n\
             Material {{ diffuseColor {} transparency .5 }}\n\
             Translation {{ translation 0 -.4 2 }} Cube {{ width .9 height .3 depth 0 }}\n",
            color(0),
            color(1),
            color(2)
        )
    }

    /// The share of an object is the light of the picture in which only the object is white over
    /// that of the picture in which everything is, also out of focus and behind a sheet.
    #[test]
    fn the_share_of_an_object_is_that_of_its_light() {
        let folder = Folder::new("mattes");
        for filter in [Filter::Box, Filter::Gaussian] {
            let expose = |white: usize| {
                let mut plan = plan(&folder, &walls(white));
                plan.filter = filter;
                let session = Session::open(plan).expect("the scene is whole");
                let exposure = session.expose(&|_| ());
                (session, exposure)
            };
            let (session, all) = expose(9);
            let mattes = |threads: usize| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
                pool.expect("threads")
                    .install(|| session.mattes(&all))
                    .expect("names")
            };
            let ranks = mattes(1).ranks;
            assert_eq!(ranks, mattes(3).ranks);
            let names = session.scene.names().expect("names");
            let names: Vec<&str> = names.all(MatteKind::Object).collect();
            assert_eq!(names, ["left/wall", "right/wall", "Cube.3"]);
            let mut mixed = 0;
            for object in 0..3 {
                let (_, own) = expose(object);
                for (pixel, ranks) in ranks[0].iter().enumerate() {
                    let share = ranks.iter().find(|(name, _)| *name as usize == object);
                    let share = share.map_or(0.0, |(_, share)| f64::from(*share));
                    let light = |exposure: &Exposure| exposure.film.pixels[pixel].mean.y;
                    let met: f32 = ranks.iter().map(|(_, share)| share).sum();
                    let expected = light(&own) / light(&all).max(1e-30) * f64::from(met);
                    assert!(
                        (share - expected).abs() < 1e-5,
                        "{pixel} {share} {expected}"
                    );
                    mixed += u32::from(share > 0.01 && share < 0.99);
                }
            }
            assert!(mixed > 100, "{mixed}");
        }
    }

    /// The edge of a wall runs through the middle of a column of pixels, of whose sixteen samples
    /// eight are on each side.
    #[test]
    fn an_object_that_covers_half_of_a_pixel_has_a_share_of_one_half() {
        let folder = Folder::new("half");
        let layers = FurtherLayers {
            mattes: true,
            ..FurtherLayers::default()
        };
        // A pixel is 1/6 m at 4 m, where the wall's left edge is at 1/12 m.
        let scene = "Translation { translation 10.083333 0 0 } \
            DEF a Cube { width 20 height 90 depth 0 }";
        let mut plan = pinhole(&folder, layers, scene);
        plan.sampler = SamplerKind::Sobol;
        plan.stop = Stop::after(16);
        let session = Session::open(plan).expect("the scene is whole");
        let exposure = session.expose(&|_| ());
        let picture = session.develop(&exposure, "");
        let mut image = session.layers(&exposure, &picture, &session.surfaces_of(&exposure));
        let warning = session
            .add_further_layers(&exposure, &mut image)
            .expect("names");
        assert!(warning.is_none());
        let values = |channel: &str| image.channels[channel][12 * 36 + 17..][..3].to_vec();
        assert_eq!(values("CryptoObject00.g"), [0.0, 0.5, 1.0]);
        let id = matte_id("a");
        assert_eq!(values("CryptoObject00.r"), [0.0, id, id]);
        assert_eq!(values("CryptoObject00.b"), [0.0; 3]);
        let manifest = |end: &str| {
            let mut entries = image
                .provenance
                .iter()
                .filter(|(key, _)| key.ends_with(end));
            let mut next = || entries.next().map(|(_, value)| value.clone());
            [next(), next()].map(|value| value.unwrap_or_default())
        };
        let hex = format!("{:08x}", id.to_bits());
        assert_eq!(manifest("/manifest")[0], format!("{{\"a\":\"{hex}\"}}"));
        assert_eq!(manifest("/name"), ["CryptoObject", "CryptoMaterial"]);
    }

    #[test]
    fn names_are_those_of_nodes_and_their_paths() {
        let folder = Folder::new("matte-names");
        let all = |scene: &str, instancing: Instancing| -> [Vec<String>; 2] {
            let session = Session::open(plan(&folder, scene)).expect("the scene is whole");
            let options = CompileOptions {
                names: true,
                instancing,
                ..CompileOptions::default()
            };
            let snapshot = snapshot(&session.document, &SnapshotOptions::default(), &options);
            let scene = RenderScene::compile(&snapshot, &options).expect("it compiles");
            let names = scene.names().expect("names");
            MatteKind::ALL.map(|kind| names.all(kind).map(str::to_owned).collect())
        };
        let inventor = "#Inventor V2.1 ascii\nCube { } DEF red Material { }\n\
            DEF table Separator { DEF leg Separator { Cylinder { } } Separator { USE leg } \
            Material { } Sphere { } BaseColor { } Text3 { string \"two words\" } }\n";
        let [objects, materials] = all(inventor, Instancing::WhereItPays);
        let expected = [
            "Cube.1",
            "table/leg/Cylinder.1",
            "table/Sphere.1",
            "table/Text3.1",
        ];
        assert_eq!(objects, expected);
        assert_eq!(materials, ["default", "red", "Material.2", "BaseColor.1"]);
        // A part that is stored once begins its own path.
        let [objects, _] = all(inventor, Instancing::Everywhere);
        assert!(
            objects.iter().any(|name| name.ends_with("leg/Cylinder.1")),
            "{objects:?}"
        );
        let vrml97 = "#VRML V2.0 utf8\nDEF House Transform { children [ DEF Roof Shape { \
            appearance DEF Tiles Appearance { material Material { } } geometry Cone { } }\n\
            Shape { geometry Box { } appearance Appearance { material DEF Stone Material { } } }\n\
            Shape { geometry DEF Ball Sphere { } appearance Appearance { material Material { } } } \
            Shape { geometry Box { } } ] }\n";
        let [objects, materials] = all(vrml97, Instancing::WhereItPays);
        assert_eq!(
            objects,
            ["House/Roof", "House/Box.1", "House/Ball", "House/Box.2"]
        );
        assert_eq!(materials, ["Tiles", "Stone", "Material.3", "default"]);
    }

    /// A picture of 36×24 pixels from z = 4 by a pinhole whose view is as high as it is far, one
    /// sample in the middle of each pixel.
    fn pinhole(folder: &Folder, layers: FurtherLayers, scene: &str) -> Plan {
        let camera =
            "#Inventor V2.1 ascii\nPerspectiveCamera { position 0 0 4 heightAngle .9272952 }\n";
        let mut plan = plan(folder, &format!("{camera}{scene}"));
        plan.optics = Optics::Pinhole;
        plan.sampler = SamplerKind::Center;
        plan.stop = Stop::after(1);
        plan.layers = layers;
        plan
    }

    /// Returns the layers of a plan.
    fn further(plan: Plan) -> ChannelImage {
        let session = Session::open(plan).expect("the scene is whole");
        let exposure = session.expose(&|_| ());
        let mut image = session.layers(
            &exposure,
            &session.develop(&exposure, ""),
            &session.surfaces_of(&exposure),
        );
        session
            .add_further_layers(&exposure, &mut image)
            .expect("layers");
        image
    }

    /// A square of 2 m at a distance of 4 m is 12 pixels high and wide.
    #[test]
    fn the_coordinates_of_a_square_are_linear_in_the_picture() {
        let folder = Folder::new("coordinates");
        let layers = FurtherLayers {
            coordinates: true,
            ..FurtherLayers::default()
        };
        let square = "TextureCoordinate2 { point [ 0 0, 3 0, 3 5, 0 5 ] }
            Coordinate3 { point [ -1 -1 0, 1 -1 0, 1 1 0, -1 1 0 ] }
            IndexedFaceSet { coordIndex [ 0 1 2 3 -1 ] textureCoordIndex [ 0 1 2 3 -1 ] }";
        let textured = format!(
            "Texture2Transform {{ translation .25 0 }} Texture2 {{ image 1 1 1 0x80 }} {square}"
        );
        for (scene, moved) in [(square, 0.0), (textured.as_str(), 0.25)] {
            let image = further(pinhole(&folder, layers, scene));
            for (x, y) in [(12_u8, 6_u8), (17, 12), (23, 17), (18, 9)] {
                let pixel = usize::from(y) * 36 + usize::from(x);
                let at = |channel: &str| image.channels[channel][pixel];
                let u = 3.0 * (f32::from(x) - 11.5) / 12.0 + moved;
                let v = 5.0 * (17.5 - f32::from(y)) / 12.0;
                assert!((at("uv.U") - u).abs() < 1e-5, "{x} {} {u}", at("uv.U"));
                assert!((at("uv.V") - v).abs() < 1e-5, "{y} {} {v}", at("uv.V"));
            }
            assert_eq!(image.channels["uv.U"][0], 0.0);
        }
    }

    /// A cube moves by 1 m/s to the right and 2 m/s up, with its front 3 m away, where a pixel is
    /// 1/8 m, before a wall that does not move.
    const MOVING: &str =
        "Separator { Translation { translation 0 0 -9 } Cube { width 90 height 90 } }
        Separator { BaseColor { rgb 1 1 1 } Translation { translation 0 0 0 = ComposeVec3f {
        x 0 = DEF T ElapsedTime { } . timeOut y 0 = ElapsedTime { speed 2 } . timeOut } . vector }
        Cube { } }";

    #[test]
    fn what_moves_by_a_known_length_moves_by_its_pixels() {
        let folder = Folder::new("motion");
        let layers = FurtherLayers {
            motion: Some(0.05),
            ..FurtherLayers::default()
        };
        let image = further(pinhole(&folder, layers, MOVING));
        let at = |pixel: usize| ["forward.u", "forward.v"].map(|c| image.channels[c][pixel]);
        let cube = at(12 * 36 + 18);
        assert!(
            (cube[0] - 0.4).abs() < 1e-4 && (cube[1] - 0.8).abs() < 1e-4,
            "{cube:?}"
        );
        assert_eq!(at(0), [0.0; 2]);
    }

    /// Through a lens that is focused elsewhere, the shares of the cube have a center, which moves
    /// as the layer says. Where nothing moves the layer has zeros, so its sum is that of the cube.
    #[test]
    fn motion_through_a_lens_is_that_of_the_blurred_image() {
        let folder = Folder::new("motion-lens");
        let layers = FurtherLayers {
            mattes: true,
            motion: Some(0.05),
            ..FurtherLayers::default()
        };
        let flat = "Scale { scaleFactor .1 .1 .01 } DEF cube Cube { } }";
        let scene = MOVING.replace("Cube { } }", flat);
        let moments = [0.0, 0.05].map(|time| {
            let mut plan = pinhole(&folder, layers, &scene);
            plan.optics = Plan::of_era(Era::Modern, "").optics;
            plan.sampler = SamplerKind::Jittered;
            plan.stop = Stop::after(256);
            plan.time = time;
            let image = further(plan);
            let channel = |name: &str| image.channels[name].iter().map(|v| f64::from(*v));
            let id = f64::from(matte_id("cube"));
            let mut shares = vec![0.0; 36 * 24];
            for [name, share] in [["r", "g"], ["b", "a"]] {
                let names = channel(&format!("CryptoObject00.{name}"));
                let values = channel(&format!("CryptoObject00.{share}"));
                for (sum, (name, value)) in shares.iter_mut().zip(names.zip(values)) {
                    *sum += if name == id { value } else { 0.0 };
                }
            }
            let all: f64 = shares.iter().sum();
            let mean = |place: &dyn Fn(usize) -> f64| -> f64 {
                let sum = shares.iter().enumerate().map(|(i, share)| share * place(i));
                sum.sum::<f64>() / all
            };
            let center = [mean(&|i| (i % 36) as f64), mean(&|i| -((i / 36) as f64))];
            let motion = ["forward.u", "forward.v"].map(|c| channel(c).sum::<f64>() / all);
            (center, motion, all)
        });
        let [(before, motion, all), (after, ..)] = moments;
        assert!(all > 10.0, "{all}");
        for axis in 0..2 {
            let seen = after[axis] - before[axis];
            assert!(seen > 0.5, "{seen}");
            assert!(
                (motion[axis] - seen).abs() < 0.02 * seen,
                "{seen} {motion:?}"
            );
        }
    }

    #[test]
    fn layers_are_named_by_words() {
        let layers = FurtherLayers {
            mattes: true,
            coordinates: true,
            motion: Some(0.02),
        };
        let read = FurtherLayers::read("cryptomatte, uv,motion:20ms");
        assert_eq!(read, Some(layers));
        for unknown in [
            "beauty",
            "cryptomatte,",
            "motion:",
            "motion:fast",
            "motion:0s",
        ] {
            assert_eq!(FurtherLayers::read(unknown), None, "{unknown}");
        }
    }
}
