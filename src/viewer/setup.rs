//! What the window photographs: a plan and where the camera stands, and the command line that
//! makes the same picture without a window.
//!
//! Numbers are kept as the command line would read them back (a camera node holds floats, a
//! distance goes through millimeters), so that what is shown, saved and printed is one thing.

use std::path::Path;

use glam::{DQuat, DVec3};

use crate::camera::Aim;
use crate::film::{FilmFormat, Resolution};
use crate::grammar::value::Rotation;
use crate::lens::{FocusMethod, Iris, Movements};
use crate::math::{Meters, Mm};
use crate::picture::Depth;
use crate::plan::{Era, Headlight, LensChoice, Optics, Plan};
use crate::pose::{CameraPose, Projection, ViewportMapping, quat};
use crate::sampling::DiscMap;

/// A photograph to be made. Undo goes from one to another.
#[derive(Clone, Debug, PartialEq)]
pub struct Setup {
    pub plan: Plan,
    pub pose: CameraPose,
}

impl Setup {
    /// The lens, unless it is the scene's own pinhole.
    pub fn lens(&self) -> Option<&LensChoice> {
        match &self.plan.optics {
            Optics::Lens(choice) => Some(choice),
            Optics::Pinhole | Optics::Ideal(_) => None,
        }
    }

    /// Another lens, wide open and in its own size; how it focuses stays.
    pub fn choose_lens(&mut self, name: &str) {
        let method = self.lens().map(|l| l.method);
        let mut choice = LensChoice::named(name);
        if let Some(method @ (FocusMethod::Film | FocusMethod::Lens | FocusMethod::Best)) = method {
            choice.method = method;
        }
        self.plan.optics = Optics::Lens(choice);
    }

    /// The distance in focus, in meters.
    pub fn focus(&self) -> f64 {
        let own = self.pose.focal_distance;
        let own = if own > 0.0 { own } else { f64::INFINITY };
        self.plan.focus.map_or(own, |d| d.0)
    }

    pub fn set_focus(&mut self, meters: f64) {
        if meters > 0.0 {
            self.plan.focus = Some(Meters(settled(meters)));
        }
    }

    /// Puts the camera elsewhere, to the nearest place that a camera node can say.
    pub fn set_pose(&mut self, pose: &CameraPose) {
        let (text, pose) = node(pose);
        (self.plan.camera, self.pose) = (Some(text.into()), pose);
    }

    /// Another film, with pixels as many and as square as before.
    pub fn set_film(&mut self, film: FilmFormat) {
        let Resolution { width, height } = self.plan.resolution;
        let pixels = f64::from(width) * f64::from(height);
        let aspect = film.width / film.height;
        let side = |x: f64| (x.round() as u32).clamp(1, Resolution::LIMIT);
        self.plan.film = film;
        self.plan.resolution = Resolution {
            width: side((pixels * aspect).sqrt()),
            height: side((pixels / aspect).sqrt()),
        };
    }

    /// The words that make this picture without a window.
    pub fn words(&self, output: &Path) -> Vec<String> {
        let mut words = Words(vec!["ivcam".into()]);
        words.0.push(match self.plan.era {
            Era::Vintage => "--batch".into(),
            Era::Modern => "render".into(),
        });
        words.plan(&self.plan);
        words.put("output", output.display());
        words.0.push(self.plan.scene.display().to_string());
        words.0
    }

    /// The same as one line for a shell.
    pub fn command(&self, output: &Path) -> String {
        crate::plan::command_line(&self.words(output))
    }
}

/// Five digits of a distance, as `--focus` reads them: meters are made of millimeters there.
fn settled(meters: f64) -> f64 {
    if !meters.is_finite() {
        return meters;
    }
    let unit = libm::pow(10.0, 4.0 - libm::floor(libm::log10(meters)));
    let mut here = (meters * unit).round() / unit;
    for _ in 0..4 {
        here = Meters::from(Mm::from(Meters(here))).0;
    }
    here
}

/// Axis and angle in floats. An axis of a quaternion that turns nothing is any.
fn turn(orientation: DQuat) -> (glam::Vec3, f32) {
    let q = if orientation.w < 0.0 {
        -orientation
    } else {
        orientation
    };
    let v = DVec3::new(q.x, q.y, q.z);
    match v.try_normalize() {
        Some(axis) => (axis.as_vec3(), 2.0 * libm::atan2(v.length(), q.w) as f32),
        None => (glam::Vec3::Z, 0.0),
    }
}

/// A camera node that stands as the pose does, and the pose as that node says it: in floats, with
/// a turn by axis and angle.
pub fn node(pose: &CameraPose) -> (String, CameraPose) {
    let float = |x: f64| f64::from(x as f32);
    let p = pose.position.as_vec3();
    let (axis, angle) = turn(pose.orientation);
    let (class, size, projection) = match pose.projection {
        Projection::Perspective { height_angle } => (
            "PerspectiveCamera",
            format!("heightAngle {}", height_angle as f32),
            Projection::Perspective {
                height_angle: float(height_angle),
            },
        ),
        Projection::Orthographic { height } => (
            "OrthographicCamera",
            format!("height {}", height as f32),
            Projection::Orthographic {
                height: float(height),
            },
        ),
    };
    let text = format!(
        "{class} {{ position {} {} {} orientation {} {} {} {angle} nearDistance {} farDistance {} \
         focalDistance {} aspectRatio {} {size}{} }}",
        p.x,
        p.y,
        p.z,
        axis.x,
        axis.y,
        axis.z,
        pose.near as f32,
        pose.far as f32,
        pose.focal_distance as f32,
        pose.aspect_ratio as f32,
        mapping(pose.viewport_mapping),
    );
    let said = CameraPose {
        position: p.as_dvec3(),
        orientation: quat(Rotation { axis, angle }).normalize(),
        projection,
        near: float(pose.near),
        far: float(pose.far),
        focal_distance: float(pose.focal_distance),
        aspect_ratio: float(pose.aspect_ratio),
        viewport_mapping: pose.viewport_mapping,
        film: None,
        source: class.into(),
    };
    (text, said)
}

fn mapping(mapping: ViewportMapping) -> &'static str {
    match mapping {
        ViewportMapping::CropViewportFillFrame => " viewportMapping CROP_VIEWPORT_FILL_FRAME",
        ViewportMapping::CropViewportLineFrame => " viewportMapping CROP_VIEWPORT_LINE_FRAME",
        ViewportMapping::CropViewportNoFrame => " viewportMapping CROP_VIEWPORT_NO_FRAME",
        ViewportMapping::AdjustCamera => "",
        ViewportMapping::LeaveAlone => " viewportMapping LEAVE_ALONE",
    }
}

/// The words of a command line, flag by flag: what differs from the era's own choices.
struct Words(Vec<String>);

impl Words {
    fn put(&mut self, flag: &str, value: impl ToString) {
        let value = value.to_string();
        match (self.0[1].as_str(), old_spelling(flag)) {
            ("--batch", Some(old)) => self.0.extend([format!("-{old}"), value]),
            _ => self.0.extend([format!("--{flag}"), value]),
        }
    }

    fn put_if(&mut self, wanted: bool, flag: &str, value: impl ToString) {
        if wanted {
            self.put(flag, value);
        }
    }

    fn plan(&mut self, plan: &Plan) {
        let own = Plan::of_era(plan.era, &plan.scene);
        self.optics(&plan.optics);
        if let Some(distance) = plan.focus {
            self.put("focus", distance.0);
        }
        if let Some(camera) = &plan.camera {
            self.put("camera", camera.display());
        }
        if let Some(environment) = &plan.environment {
            self.put("environment", environment.display());
        }
        self.put("shading", plan.shading.letter());
        self.put("samples", plan.sampler.samples);
        match plan.headlight {
            Headlight::Automatic | Headlight::Environment => {}
            Headlight::Flipped => self.0.push("--headlight".into()),
            Headlight::Set(on) => self
                .0
                .push(format!("--headlight={}", if on { "on" } else { "off" })),
        }
        self.sampling(plan, &own);
        self.movements(&plan.movements);
        let dispersion = if plan.dispersion { "on" } else { "off" };
        self.put_if(plan.dispersion != own.dispersion, "dispersion", dispersion);
        let (film, size) = (plan.film, plan.resolution);
        self.put_if(
            film != own.film,
            "film",
            format!("{}x{}", film.width, film.height),
        );
        self.put_if(
            size != own.resolution,
            "size",
            format!("{}x{}", size.width, size.height),
        );
        self.put_if(plan.exposure != own.exposure, "exposure", plan.exposure);
        let response = plan.response.name();
        self.put_if(plan.response != own.response, "response", response);
        self.put_if(
            plan.depth != own.depth,
            "depth",
            if plan.depth == Depth::Eight { 8 } else { 16 },
        );
        self.put_if(plan.time != own.time, "scene-time", plan.time);
        if let Optics::Lens(lens) = &plan.optics {
            for file in &lens.catalogues {
                self.put("glass-catalogue", file.display());
            }
        }
        for folder in &plan.search {
            self.put("search", folder.display());
        }
        for folder in plan.fonts.folders() {
            self.put("fonts", folder.display());
        }
    }

    fn optics(&mut self, optics: &Optics) {
        let lens = match optics {
            Optics::Lens(lens) => lens,
            Optics::Ideal(ideal) => {
                self.put("lens", "ideal");
                self.put("efl", format!("{}mm", ideal.efl.0));
                return self.put("aperture", ideal.f_number);
            }
            Optics::Pinhole => return self.put("lens", "none"),
        };
        self.put_if(lens.name != "wide-angle", "lens", &lens.name);
        if let Some(position) = lens.zoom_position {
            self.put("zoom-position", position);
        }
        if let Some(efl) = lens.efl {
            self.put("efl", format!("{}mm", efl.0));
        }
        self.put_if(lens.zoom != 1.0, "zoom", lens.zoom);
        if let Some(n) = lens.f_number {
            self.put("aperture", n);
        }
        if let Iris::Blades { count, rotation } = lens.iris {
            let degrees = (rotation.to_degrees() * 1e6).round() / 1e6;
            self.put(
                "blades",
                if degrees == 0.0 {
                    count.to_string()
                } else {
                    format!("{count}@{degrees}")
                },
            );
        }
        if let Some(coating) = lens.coating {
            let known = crate::lens::Coating::ALL
                .iter()
                .find(|(_, c)| *c == coating);
            self.put("coating", known.map_or("", |(name, _)| name));
        }
        self.put_if(
            lens.method != FocusMethod::Film,
            "focus-method",
            lens.method.name(),
        );
    }

    fn movements(&mut self, moved: &Movements) {
        for (flag, radians) in [("tilt", moved.tilt), ("swing", moved.swing)] {
            self.put_if(
                radians != 0.0,
                flag,
                (radians.to_degrees() * 1e6).round() / 1e6,
            );
        }
        for (flag, mm) in [("rise", moved.rise), ("shift", moved.shift)] {
            self.put_if(mm != 0.0, flag, mm);
        }
        if let Some(radius) = moved.film_radius {
            self.put("film-radius", radius);
        }
    }

    fn sampling(&mut self, plan: &Plan, own: &Plan) {
        let (sampler, usual) = (plan.sampler, own.sampler);
        self.put_if(sampler.kind != usual.kind, "sampler", sampler.kind.name());
        self.put_if(sampler.seed != usual.seed, "seed", sampler.seed);
        if plan.aim != own.aim {
            match plan.aim {
                Aim::ExitPupil => self.put("pupil", "exit"),
                Aim::RearElement(map) => {
                    self.put("pupil", "rear");
                    self.put(
                        "disc",
                        if map == DiscMap::Polar {
                            "polar"
                        } else {
                            "concentric"
                        },
                    );
                }
            }
        }
        if let Some(error) = plan.stop.error {
            self.put("target-error", error);
        }
        if let Some(time) = plan.stop.time {
            self.put("time", format!("{}s", time.as_secs_f64()));
        }
    }
}

/// The paper's own letter for a flag.
fn old_spelling(flag: &str) -> Option<&'static str> {
    Some(match flag {
        "focus" => "f",
        "zoom" => "z",
        "output" => "o",
        "shading" => "s",
        "samples" => "j",
        "environment" => "e",
        _ => return None,
    })
}
