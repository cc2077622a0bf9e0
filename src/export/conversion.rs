//! Converts a document to the bytes of a file, and reports what is lost.

use glam::DVec3;
use ivcam_base::diag::{Diagnostic, Result};
use ivcam_inventor::iv::{Document, Format, FormatLoss, NodeRef};
use ivcam_render::scene::model::{
    Feature, LightShape, Material, Model, ModelOptions, Motion, Place, Sampling,
};
use ivcam_render::scene::{draws_nothing, snapshot};

use super::losses::Losses;
use super::target::Target;
use super::{gltf, inventor, obj, ply, usd, web3d};
use crate::photo::snapshot_options;

/// The options of a conversion.
#[derive(Clone, Debug, Default)]
pub struct ExportOptions {
    /// Seconds since the scene was opened. Default: 0.
    pub time: f64,
    /// How the scene is made into triangles.
    pub model: ModelOptions,
    /// How motion is sampled, if it is wanted. Default: none.
    pub sampling: Option<Sampling>,
    /// The name of the file without its ending, for files beside it. Default: empty.
    pub stem: String,
}

/// A converted scene.
#[derive(Clone, Debug, Default)]
pub struct Conversion {
    /// The bytes of the file.
    pub bytes: Vec<u8>,
    /// The files beside it, with their names.
    pub beside: Vec<(String, Vec<u8>)>,
    /// What could not be said in the format.
    pub losses: Losses,
    /// What is wrong with the scene.
    pub diagnostics: Vec<Diagnostic>,
    /// Whether the scene has nothing to draw, or nothing of it could be written.
    pub is_empty: bool,
    /// Whether the file names other files as the scene does.
    pub keeps_addresses: bool,
}

/// Converts a document.
///
/// # Errors
/// Fails if the file would be larger than the format can be.
pub fn convert(document: &Document, target: Target, options: &ExportOptions) -> Result<Conversion> {
    let has_own_nodes = document.is_vrml97() || document.is_x3d();
    if target == Target::Inventor && !has_own_nodes {
        let document = document.in_inventor(Format::Ascii);
        return Ok(Conversion {
            bytes: document.write(Format::Ascii),
            ..rewriting(&document, Format::Ascii, options)
        });
    }
    let at = snapshot_options(options.time);
    let taken = snapshot(document, &at, &options.model.compile);
    if let Some(mut conversion) = web3d::rewritten(document, target) {
        add(
            &mut conversion.losses,
            document,
            document.unwritten_edits(Format::Ascii),
        );
        conversion.is_empty = draws_nothing(&taken, &options.model.compile);
        return Ok(conversion);
    }
    let mut model = Model::of(&taken, &options.model);
    let mut conversion = Conversion {
        is_empty: model.is_empty(),
        diagnostics: model.diagnostics.clone(),
        ..Conversion::default()
    };
    let losses = &mut conversion.losses;
    losses.add_model(&model, target);
    if model.offset != DVec3::ZERO && !target.holds(Feature::Offset) {
        losses.feature(Feature::Offset, &Place::default(), 1);
    }
    let motion = motion(document, &model, options);
    for id in &motion.changing {
        losses.feature(Feature::ChangingValue, &Place::of(document.node(*id)), 1);
    }
    if !target.holds(Feature::Motion) {
        let nodes = motion.nodes.iter().map(|(i, _)| &model.nodes[*i].place);
        let cameras = motion.cameras.iter().map(|(i, _)| &model.cameras[*i].place);
        let lights = motion.lights.iter().map(|(i, _)| &model.lights[*i].place);
        // A camera or light that is left out is a loss of its own.
        let cameras = cameras.filter(|_| target.holds(Feature::Camera));
        let lights = lights.filter(|_| target.holds(Feature::Light));
        for place in nodes.chain(cameras).chain(lights) {
            losses.feature(Feature::Motion, place, 1);
        }
    }
    let shines = |m: &Material| !m.unlit && m.specular.max_element() > 0.0;
    if !has_own_nodes && target.has_near_viewer() && model.materials.iter().any(shines) {
        let text = "highlights are those of a viewer at its place, and Inventor's is at infinity";
        losses.add_stated("highlight", text, Place::default(), (1, false));
    }
    if matches!(target, Target::X3d | Target::Vrml97 | Target::Inventor) {
        light_by_levels(&mut model, target, losses);
    }
    let viewing = || inventor::Viewing::of(&taken, &options.model.compile.limits);
    if has_own_nodes && matches!(target, Target::Glb | Target::Gltf | Target::Usda) {
        let viewing = viewing();
        let is_lit = !model.lights.is_empty();
        let lost = match viewing.headlight {
            true => is_lit.then_some("the headlight beside the lights is left out"),
            false => (!is_lit).then_some("the headlight is off, but a viewer may add a light"),
        };
        if let Some(text) = lost {
            viewing.report_headlight(text, losses);
        }
    }
    match target {
        Target::Glb | Target::Gltf => {
            let packing = match target {
                Target::Glb => gltf::Packing::Binary,
                _ => gltf::Packing::Json,
            };
            conversion.bytes = gltf::write(&model, &motion, packing, losses)?;
        }
        Target::Obj => (conversion.bytes, conversion.beside) = obj::write(&model, &options.stem),
        Target::Ply => conversion.bytes = ply::write(&model)?,
        Target::X3d => conversion.bytes = web3d::x3d(&model, losses),
        Target::Vrml97 => {
            (conversion.bytes, conversion.beside) = web3d::vrml97(&model, &options.stem, losses);
        }
        Target::Inventor => {
            (conversion.bytes, conversion.beside) =
                inventor::write(&model, &viewing(), &options.stem, losses);
        }
        Target::Usda => {
            (conversion.bytes, conversion.beside) =
                usd::write(&model, &motion, &options.stem, losses);
        }
    }
    Ok(conversion)
}

/// Replaces lights of glTF by lights of a screen's levels, which are right at the scene's center.
fn light_by_levels(model: &mut Model, target: Target, losses: &mut Losses) {
    let bounds = model.bounds().unwrap_or((DVec3::NEG_ONE, DVec3::ONE));
    let (center, radius) = (
        0.5 * (bounds.0 + bounds.1),
        0.5 * (bounds.1 - bounds.0).length(),
    );
    for light in model.lights.iter_mut().filter(|light| light.linear) {
        if light.shape != LightShape::Directional {
            let text =
                "the light falls off by the distance, which is near the inverse square of light";
            losses.add(Feature::LightFalloff.code(), text, light.place.clone(), 1);
        }
        // What is written as Inventor names every spot of two angles.
        if target != Target::Inventor
            && let LightShape::Spot { inner, outer, .. } = light.shape
            && inner < outer
        {
            losses.feature(Feature::SpotFalloff, &light.place, 1);
        }
        let distance = light.position.distance(center).max(0.1 * radius).max(1e-6);
        *light = light.on_screen(distance);
    }
}

/// Reports what a scene in the terms of a format ([`Document::in_inventor`]) loses in the language
/// of its file. The bytes are left to [`Document::write_to`], which needs no memory for them.
pub(crate) fn rewriting(
    document: &Document,
    format: Format,
    options: &ExportOptions,
) -> Conversion {
    let mut losses = Losses::default();
    add(&mut losses, document, document.losses(format));
    let compile = &options.model.compile;
    let taken = snapshot(document, &snapshot_options(options.time), compile);
    Conversion {
        losses,
        is_empty: draws_nothing(&taken, compile),
        keeps_addresses: true,
        ..Conversion::default()
    }
}

/// Adds what a format loses of a document.
fn add(losses: &mut Losses, document: &Document, all: Vec<FormatLoss>) {
    for FormatLoss { code, text, node } in all {
        let place = node.map(|id| Place::of(NodeRef { document, id }));
        losses.add(code, text, place.unwrap_or_default(), 1);
    }
}

/// Returns the motion of a model, if it is wanted.
fn motion(document: &Document, model: &Model, options: &ExportOptions) -> Motion {
    let Some(sampling) = &options.sampling else {
        return Motion::default();
    };
    let start = snapshot_options(options.time);
    Motion::of(document, model, &start, &options.model, sampling)
}
