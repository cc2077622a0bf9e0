//! What a conversion could not say in the new format.

use glam::DVec2;
use indexmap::IndexMap;
use ivcam_base::diag::Diagnostic;
use ivcam_inventor::iv::NodeRef;
use ivcam_inventor::pose::ViewportMapping;
use ivcam_render::scene::model::{
    Feature, Image, Material, Mesh, Model, Occurrence, Place, Primitives, SceneCamera, SceneLight,
    SceneNode,
};
use serde::Serialize;

use super::appearance::{Appearance, is_approximate, mean_color, replaces_vertex_colors};
use super::inventor;
use super::target::Target;

/// One loss: what is lost, at which node, and how often.
#[derive(Clone, Debug)]
pub struct ConversionLoss {
    /// The name of the kind of loss, for programs: `fog`, `line-width`, ….
    pub code: String,
    /// What the other format gets instead, in lower case.
    pub text: String,
    /// The node that it is about.
    pub place: Place,
    /// The number of uses of the node.
    pub count: u64,
    /// Whether the file states what is lost. Otherwise it is a default of the file's language.
    pub stated: bool,
}

/// All losses of a conversion. Losses of the same kind at the same node are counted.
#[derive(Clone, Debug, Default)]
pub struct Losses {
    list: IndexMap<(String, String, Option<u32>), ConversionLoss>,
}

/// A loss in a report for programs.
#[derive(Serialize)]
struct LossEntry<'a> {
    feature: &'a str,
    text: &'a str,
    node: &'a str,
    name: Option<&'a str>,
    file: Option<&'a str>,
    line: Option<u32>,
    count: u64,
    stated: bool,
}

/// The report of a conversion for programs.
#[derive(Serialize)]
struct Report<'a> {
    scene: &'a str,
    format: &'a str,
    output: &'a str,
    count: u64,
    losses: Vec<LossEntry<'a>>,
}

/// Whether a color of a mesh is above 1.
fn is_bright(mesh: &Mesh, material: &Material) -> bool {
    let above = |color: &[f32; 4]| color[..3].iter().any(|&c| c > 1.0);
    match mesh.colors.is_empty() {
        true => material.diffuse.max_element() > 1.0,
        false => mesh.colors.iter().any(above),
    }
}

/// Whether the faces of a mesh are seen from one side only, and their backs would be seen
/// otherwise: where the mesh is open, and through transparent faces.
fn shows_lost_backs(mesh: &Mesh, material: &Material) -> bool {
    let is_transparent =
        || material.transparency > 0.0 || mesh.colors.iter().any(|&[.., alpha]| alpha < 1.0);
    !material.double_sided
        && !mesh.triangles().is_empty()
        && (is_transparent() || mesh.shows_backs())
}

impl Losses {
    /// Adds a loss. `code` names its kind for programs, and `text` says what becomes of the node.
    pub fn add(&mut self, code: &str, text: impl Into<String>, place: Place, count: u64) {
        self.add_stated(code, text, place, (count, true));
    }

    /// Adds a loss, which the file states or not.
    pub(crate) fn add_stated(
        &mut self,
        code: &str,
        text: impl Into<String>,
        place: Place,
        (count, stated): (u64, bool),
    ) {
        let text = text.into();
        let start = place.at.as_ref().map(|(_, span)| span.start);
        let key = (format!("{code} {text}"), place.class.clone(), start);
        let loss = self.list.entry(key).or_insert_with(|| ConversionLoss {
            code: code.to_owned(),
            text,
            place,
            count: 0,
            stated: false,
        });
        loss.count += count;
        loss.stated |= stated;
    }

    /// Adds the loss of a node.
    pub fn add_node(&mut self, code: &str, text: impl Into<String>, node: NodeRef<'_>) {
        self.add(code, text, Place::of(node), 1);
    }

    /// Adds a feature that the format cannot hold.
    pub(crate) fn feature(&mut self, feature: Feature, place: &Place, count: u64) {
        self.feature_stated(feature, place, (count, true));
    }

    /// Adds a feature that the format cannot hold, with its number of uses and whether the file
    /// states it.
    pub(crate) fn feature_stated(&mut self, feature: Feature, place: &Place, uses: (u64, bool)) {
        self.add_stated(feature.code(), feature.text(), place.clone(), uses);
    }

    /// Adds the features of a model that a format cannot hold.
    pub(crate) fn add_model(&mut self, model: &Model, target: Target) {
        let lost = |feature: &Feature| !target.holds(*feature);
        let found = model.features.iter();
        for Occurrence {
            feature,
            place,
            count,
            stated,
        } in found.filter(|o| lost(&o.feature))
        {
            self.feature_stated(*feature, place, (*count, *stated));
        }
        for lack in &model.not_applied {
            self.add("not-applied", &*lack.text, lack.place.clone(), lack.count);
        }
        self.add_lights_and_cameras(model, target);
        for (mesh, material, _, node) in model.placed_meshes() {
            let is_thin = !matches!(mesh.primitives, Primitives::Triangles(_));
            let is_shaded = material.specular.max_element() > 0.0
                || material.unlit && !is_thin
                || material.emissive.max_element() > 0.0
                || material.transparency > 0.0;
            let texture = material.texture.as_ref();
            let is_blended = match target {
                Target::Inventor => inventor::approximates_texture(material),
                _ => texture.is_some_and(|t| is_approximate(t.model, &model.images[t.image])),
            };
            if is_blended && target.holds(Feature::Texture) {
                self.feature(Feature::TextureBlend, &node.place, 1);
            }
            let shown = texture.filter(|_| target.holds(Feature::Texture));
            let is_repeated_once = shown.is_some_and(|t| t.repeat[0] != t.repeat[1]);
            let has_squares = shown.is_some_and(|t| !t.smooth);
            let is_lit_line = is_thin && !material.unlit && target.holds(Feature::LinesAndPoints);
            let uses = [
                (texture.is_some(), Feature::Texture),
                (is_repeated_once, Feature::TextureRepeat),
                (has_squares, Feature::TextureFilter),
                (!mesh.colors.is_empty(), Feature::VertexColors),
                (is_shaded, Feature::Shading),
                (is_bright(mesh, material), Feature::ColorRange),
                (is_thin, Feature::LinesAndPoints),
                (is_lit_line, Feature::LitLines),
            ];
            for (_, feature) in uses.into_iter().filter(|(used, f)| *used && lost(f)) {
                self.feature(feature, &node.place, 1);
            }
            let image = texture.map(|t| &model.images[t.image]);
            self.add_vertex_colors(target, (mesh, material, image), node);
            if lost(&Feature::OneSided) && shows_lost_backs(mesh, material) {
                self.feature_stated(Feature::OneSided, &node.place, (1, node.states_sides));
            }
        }
        let grouped = model.nodes.iter().skip(1);
        if lost(&Feature::Hierarchy) && grouped.clone().any(|n| n.parts.is_empty()) {
            let groups = grouped.filter(|n| n.parts.is_empty());
            groups.for_each(|group| self.feature(Feature::Hierarchy, &group.place, 1));
        }
    }

    /// Adds the lights and cameras of a model that a format cannot hold.
    fn add_lights_and_cameras(&mut self, model: &Model, target: Target) {
        if !target.holds(Feature::Light) {
            let lights = model.lights.iter();
            lights.for_each(|light| self.feature(Feature::Light, &light.place, 1));
        } else if !target.holds(Feature::AmbientLight) {
            let is_seen = |light: &&SceneLight| {
                let ambient = light.ambient * light.color;
                let mut materials = model.materials.iter();
                materials.any(|material| material.reflects_ambient_light(ambient))
            };
            let lights = model.lights.iter().filter(is_seen);
            lights.for_each(|light| self.feature(Feature::AmbientLight, &light.place, 1));
        }
        for camera in &model.cameras {
            if camera.pose.center != DVec2::ZERO && target != Target::Usda {
                let text = "the view off the camera's axis is written as one around the axis";
                self.add("off-axis-view", text, camera.place.clone(), 1);
            }
            if !target.holds(Feature::Camera) {
                self.feature(Feature::Camera, &camera.place, 1);
            } else if !keeps_view(camera, target) {
                let text = "the `viewportMapping` is left out: a view of another shape may show more or less";
                self.add("viewport-mapping", text, camera.place.clone(), 1);
            }
        }
    }

    /// Adds what a format with colors of vertices loses of those of a mesh.
    fn add_vertex_colors(
        &mut self,
        target: Target,
        (mesh, material, image): (&Mesh, &Material, Option<&Image>),
        node: &SceneNode,
    ) {
        let look = Appearance::of(material, image, true);
        if mesh.colors.is_empty() || !look.keeps_colors || !target.holds(Feature::VertexColors) {
            return;
        }
        let code = Feature::VertexColors.code();
        if image.is_some_and(|image| replaces_vertex_colors(target, image)) {
            let text = "the colors of vertices under a texture become their mean";
            return self.add(code, text, node.place.clone(), 1);
        }
        let [.., mean] = mean_color(mesh);
        let differ = mesh.colors.iter().any(|c| (c[3] - mean).abs() > 1e-3);
        // VRML97 has no material for what is unlit and has colors.
        let is_face = !mesh.triangles().is_empty();
        let is_bare = target == Target::Vrml97 && look.unlit && is_face && image.is_none();
        let text = match target {
            _ if is_bare && (differ || mean < 0.999) => "the opacities of vertices are left out",
            Target::Obj | Target::Vrml97 if differ => "the opacities of vertices become their mean",
            _ => return,
        };
        self.add("vertex-opacity", text, node.place.clone(), 1);
    }

    /// Whether nothing is lost, not even a default.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Whether something is lost that the file states.
    pub fn has_stated(&self) -> bool {
        self.iter().any(|loss| loss.stated)
    }

    /// The losses, in the order in which they were found.
    pub fn iter(&self) -> impl Iterator<Item = &ConversionLoss> {
        self.list.values()
    }

    /// The number of uses of nodes that lost something that the file states.
    pub fn total(&self) -> u64 {
        let stated = self.iter().filter(|loss| loss.stated);
        stated.map(|loss| loss.count).sum()
    }

    /// One message for each kind of loss, with the place of the first one: a warning if the file
    /// states what is lost, or else a note.
    pub(crate) fn messages(&self) -> Vec<Box<Diagnostic>> {
        let mut kinds: IndexMap<(&str, bool), (&ConversionLoss, u64)> = IndexMap::new();
        for loss in self.iter() {
            let kind = kinds.entry((&loss.text, loss.stated));
            kind.or_insert((loss, 0)).1 += loss.count;
        }
        let message = |((text, stated), (loss, count)): ((&str, bool), (&ConversionLoss, u64))| {
            let text = match &*loss.place.class {
                "" => text.to_owned(),
                class => format!("`{class}`: {text}"),
            };
            let mut warning = match stated {
                true => Diagnostic::warning(text),
                false => {
                    Diagnostic::note(format!("{text} (a default that the file does not state)"))
                }
            };
            if let Some((source, span)) = &loss.place.at {
                warning = warning.at(source, *span);
            }
            warning.count = usize::try_from(count).unwrap_or(usize::MAX);
            warning
        };
        kinds.into_iter().map(message).collect()
    }

    /// The report for programs, as JSON.
    pub(crate) fn json(&self, scene: &str, format: &str, output: &str) -> serde_json::Value {
        fn entry(loss: &ConversionLoss) -> LossEntry<'_> {
            LossEntry {
                feature: &loss.code,
                text: &loss.text,
                node: &loss.place.class,
                name: loss.place.name.as_deref(),
                file: loss.place.file(),
                line: loss.place.line(),
                count: loss.count,
                stated: loss.stated,
            }
        }
        let report = Report {
            scene,
            format,
            output,
            count: self.total(),
            losses: self.iter().map(entry).collect(),
        };
        serde_json::to_value(report).expect("strings and numbers are JSON")
    }
}
/// Returns whether a format has the mapping of a camera's view to pictures of other shapes. The
/// rectangle of an `OrthoViewpoint` is that of a camera of Inventor and VRML97 if it is a square.
fn keeps_view(camera: &SceneCamera, target: Target) -> bool {
    match camera.pose.viewport_mapping {
        ViewportMapping::AdjustCamera => true,
        ViewportMapping::ExtendView => {
            !matches!(target, Target::Inventor | Target::Vrml97) || camera.pose.aspect_ratio == 1.0
        }
        _ => false,
    }
}
