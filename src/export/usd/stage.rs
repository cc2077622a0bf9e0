//! The stage: its header, the tree of prims, and the classes of shared meshes.

use std::collections::HashMap;

use glam::{Affine2, DAffine3, DVec3};
use ivcam_render::scene::model::{Model, Motion, Part};

use super::geometry::MeshLook;
use super::materials::UsdMaterials;
use super::text::{UsdText, quoted};
use super::{geometry, lights};
use crate::export::clipping::SceneSphere;
use crate::export::losses::Losses;
use crate::export::names::Names;

/// Writes a model with its motion. `stem` is the name of the file without its ending, and `losses`
/// receives what USD cannot say. Returns the file and the pictures beside it.
pub(in crate::export) fn write(
    model: &Model,
    motion: &Motion,
    stem: &str,
    losses: &mut Losses,
) -> (Vec<u8>, Vec<(String, Vec<u8>)>) {
    let bounds = model.bounds();
    let center = bounds.map_or(DVec3::ZERO, |(min, max)| 0.5 * (min + max));
    let size = bounds
        .map_or(1.0, |(min, max)| (max - min).length())
        .max(1e-6);
    let mut stage = Stage {
        model,
        motion,
        out: UsdText::default(),
        materials: UsdMaterials::new(model, stem),
        classes: shared(model),
        size,
    };
    stage.header();
    stage
        .out
        .open("def Xform \"Scene\" (\n    kind = \"component\"\n)");
    let mut names = Names::default();
    names.identifier("Materials");
    stage.children(0, &mut names);
    for (number, light) in model.lights.iter().enumerate() {
        let name = names.identifier(&light.name);
        let named = (name.as_str(), light, number);
        lights::light(&mut stage.out, named, motion, (center, size), losses);
    }
    let around = SceneSphere::in_motion(model, motion);
    for (number, camera) in model.cameras.iter().enumerate() {
        let name = names.identifier(&camera.name);
        let named = (name.as_str(), camera, number);
        lights::camera(&mut stage.out, named, motion, around);
    }
    stage.out.open("def Scope \"Materials\"");
    let materials = std::mem::take(&mut stage.materials.text);
    stage.out.text += &materials.text;
    stage.out.close();
    stage.out.close();
    stage.write_classes();
    (stage.out.text.into_bytes(), stage.materials.pictures)
}

/// A mesh with the bits of what a material changes in its lists.
type MeshKey = (usize, [u32; 6], u32);

/// Returns the name of the class of each mesh that several nodes use with the same lists.
fn shared(model: &Model) -> HashMap<MeshKey, String> {
    let mut uses: HashMap<MeshKey, usize> = HashMap::new();
    for part in model.nodes.iter().flat_map(|node| &node.parts) {
        *uses.entry(key(model, *part)).or_default() += 1;
    }
    let mut several: Vec<MeshKey> = uses
        .into_iter()
        .filter(|(_, n)| *n > 1)
        .map(|(key, _)| key)
        .collect();
    several.sort_unstable();
    let named = several.into_iter().enumerate();
    named
        .map(|(i, key)| (key, format!("Mesh_{}", i + 1)))
        .collect()
}

fn key(model: &Model, part: Part) -> MeshKey {
    let MeshLook { matrix, share } = look(model, part);
    let matrix = matrix.to_cols_array().map(f32::to_bits);
    (part.mesh, matrix, share.to_bits())
}

/// What the material of a part changes in the lists of its mesh.
fn look(model: &Model, part: Part) -> MeshLook {
    let material = &model.materials[part.material];
    let is_colorful = !model.meshes[part.mesh].colors.is_empty();
    MeshLook {
        matrix: material
            .texture
            .as_ref()
            .map_or(Affine2::IDENTITY, |t| t.matrix),
        share: if is_colorful {
            material.diffuse_share()
        } else {
            1.0
        },
    }
}

/// A stage that is being written.
struct Stage<'m> {
    model: &'m Model,
    motion: &'m Motion,
    out: UsdText,
    materials: UsdMaterials<'m>,
    /// The names of classes.
    classes: HashMap<MeshKey, String>,
    /// The size of the scene.
    size: f64,
}

impl Stage<'_> {
    fn header(&mut self) {
        let out = &mut self.out;
        out.line("#usda 1.0\n(");
        let DVec3 { x, y, z } = self.model.offset;
        if self.model.offset != DVec3::ZERO {
            out.line(format_args!(
                "    customLayerData = {{\n        double3 offset = ({x}, {y}, {z})\n    }}"
            ));
        }
        out.line("    defaultPrim = \"Scene\"");
        out.line(format_args!("    doc = {}", quoted("by ivcam")));
        out.line("    metersPerUnit = 1");
        if let Some(last) = self.motion.times.last().filter(|_| !self.motion.is_empty()) {
            let codes = lights::CODES_PER_SECOND;
            out.line(format_args!(
                "    startTimeCode = 0\n    endTimeCode = {}",
                last * codes
            ));
            out.line(format_args!("    timeCodesPerSecond = {codes}"));
        }
        out.line("    upAxis = \"Y\"\n)\n");
    }

    /// Writes the children of a node. A tree may be deeper than the program's stack, so the nodes
    /// that are open are on a list.
    fn children(&mut self, root: usize, names: &mut Names) {
        let model = self.model;
        let first = model.nodes[root].children.iter().copied();
        let mut open = vec![(first.collect::<Vec<_>>().into_iter(), std::mem::take(names))];
        while let Some((list, taken)) = open.last_mut() {
            let Some(index) = list.next() else {
                if let Some((_, taken)) = open.pop() {
                    if open.is_empty() {
                        *names = taken;
                    } else {
                        self.out.close();
                    }
                }
                continue;
            };
            let node = &model.nodes[index];
            let name = taken.identifier(node.name());
            self.out.open(format_args!("def Xform \"{name}\""));
            self.transform(index);
            let mut inner = Names::default();
            for part in &node.parts {
                let name = inner.identifier("Geometry");
                self.part(&name, *part);
            }
            open.push((node.children.clone().into_iter(), inner));
        }
    }

    /// Writes the matrix of a node, and when it is hidden.
    fn transform(&mut self, index: usize) {
        let node = &self.model.nodes[index];
        let motion = self.motion;
        let moving = motion.nodes.iter().find(|(n, _)| *n == index);
        let Some((_, matrices)) = moving else {
            return lights::transform(&mut self.out, &node.local, &[]);
        };
        let times = motion.times.iter().copied().zip(matrices);
        let shown: Vec<(f64, DAffine3)> = times
            .clone()
            .filter_map(|(t, m)| Some((t, (*m)?)))
            .collect();
        lights::transform(&mut self.out, &node.local, &shown);
        if shown.len() < matrices.len() {
            let at = |(time, m): (f64, &Option<DAffine3>)| {
                let word = if m.is_some() {
                    "inherited"
                } else {
                    "invisible"
                };
                format!("{}: \"{word}\"", time * lights::CODES_PER_SECOND)
            };
            let list: Vec<String> = times.map(at).collect();
            self.out.line(format_args!(
                "token visibility.timeSamples = {{ {} }}",
                list.join(", ")
            ));
        }
    }

    /// Writes a mesh with its material.
    fn part(&mut self, name: &str, part: Part) {
        let model = self.model;
        let mesh = &model.meshes[part.mesh];
        let material = self.materials.path(part);
        let class = self.classes.get(&key(model, part));
        let out = &mut self.out;
        out.line(format_args!("def {} \"{name}\" (", geometry::schema(mesh)));
        if let Some(class) = class {
            out.line(format_args!("    inherits = </Shared/{class}>"));
        }
        out.line("    prepend apiSchemas = [\"MaterialBindingAPI\"]");
        out.open(")");
        if class.is_none() {
            geometry::write(out, mesh, look(model, part), self.size);
        }
        if model.materials[part.material].double_sided {
            out.line("uniform bool doubleSided = 1");
        }
        out.line(format_args!("rel material:binding = <{material}>"));
        out.close();
    }

    /// Writes the classes of shared meshes.
    fn write_classes(&mut self) {
        if self.classes.is_empty() {
            return;
        }
        self.out.open("class Scope \"Shared\"");
        let mut classes: Vec<_> = self.classes.iter().collect();
        classes.sort_unstable();
        for ((mesh, matrix, share), name) in classes {
            let mesh = &self.model.meshes[*mesh];
            let look = MeshLook {
                matrix: Affine2::from_cols_array(&matrix.map(f32::from_bits)),
                share: f32::from_bits(*share),
            };
            let out = &mut self.out;
            out.open(format_args!("class {} \"{name}\"", geometry::schema(mesh)));
            geometry::write(out, mesh, look, self.size);
            out.close();
        }
        self.out.close();
    }
}
