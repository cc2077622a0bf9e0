//! Writes a model as glTF: its nodes, and what they refer to.

use glam::{DQuat, DVec3};
use ivcam_base::diag::Result;
use ivcam_render::scene::model::{Model, Motion};
use serde_json::{Map, Value, json};

use super::animation::animate;
use super::assets::Assets;
use super::container::{Packing, pack};
use super::lights;
use super::nodes::NodeList;
use super::schema::{Index, Node, Root, Scene};
use crate::export::clipping::SceneSphere;
use crate::export::losses::Losses;
use crate::export::trs::{Trs, split};

/// Writes a model with its motion. `losses` receives what glTF cannot say.
///
/// # Errors
/// Fails if the file would be larger than the format allows.
pub(in crate::export) fn write(
    model: &Model,
    motion: &Motion,
    packing: Packing,
    losses: &mut Losses,
) -> Result<Vec<u8>> {
    let mut assets = Assets::default();
    let mut root = Root {
        scenes: vec![Scene { nodes: vec![0] }],
        ..Root::default()
    };
    let mut nodes = nodes(model, &mut assets);
    add_cameras(model, motion, &mut root, &mut nodes);
    let punctual = add_lights(model, &mut nodes, losses);
    if !punctual.is_empty() {
        let name = "KHR_lights_punctual";
        root.extensions_used.insert(name);
        root.extensions
            .insert(name.into(), json!({ "lights": punctual }));
    }
    let animation = animate(model, motion, &mut nodes, &mut assets.buffer, losses);
    root.animations.extend(animation);
    root.nodes = nodes.list;
    root.extensions_used
        .extend(assets.materials.extensions.iter().copied());
    root.meshes = assets.meshes.meshes;
    root.materials = assets.materials.materials;
    root.textures = assets.materials.textures;
    root.samplers = assets.materials.samplers;
    root.images = assets.materials.images;
    root.accessors = assets.buffer.accessors;
    root.buffer_views = assets.buffer.views;
    pack(root, assets.buffer.bytes, packing)
}

/// Makes the nodes of the model's tree.
fn nodes(model: &Model, assets: &mut Assets) -> NodeList {
    let mut list: Vec<Node> = Vec::with_capacity(model.nodes.len());
    let mut of_model: Vec<Index> = Vec::with_capacity(model.nodes.len());
    // The node that children are attached to: the inner one if the matrix shears.
    let mut attach: Vec<Index> = Vec::with_capacity(model.nodes.len());
    for node in &model.nodes {
        let parts = split(&node.local);
        let index = list.len();
        let mut entry = Node {
            name: node.name().to_owned(),
            ..Node::default()
        };
        set_trs(&mut entry, &parts.outer);
        let mesh = (!node.parts.is_empty()).then(|| {
            let named = (node.name(), &node.parts[..]);
            assets
                .meshes
                .entry(model, named, &mut assets.materials, &mut assets.buffer)
        });
        if let Some(parent) = node.parent {
            list[attach[parent]].children.push(index);
        }
        match parts.inner {
            None => {
                entry.mesh = mesh;
                list.push(entry);
                attach.push(index);
            }
            Some(turn) => {
                entry.children.push(index + 1);
                list.push(entry);
                let mut inner = Node {
                    mesh,
                    ..Node::default()
                };
                let rotation = Trs {
                    rotation: turn,
                    ..Trs::IDENTITY
                };
                set_trs(&mut inner, &rotation);
                list.push(inner);
                attach.push(index + 1);
            }
        }
        of_model.push(index);
    }
    if model.offset != DVec3::ZERO {
        let offset = json!(model.offset.to_array());
        list[0].extras = Map::from_iter([("offset".to_owned(), offset)]);
    }
    NodeList {
        list,
        of_model,
        of_lights: Vec::new(),
        of_cameras: Vec::new(),
    }
}

/// Sets the transform of a node; parts that do nothing are left out.
fn set_trs(node: &mut Node, trs: &Trs) {
    let Trs {
        translation,
        rotation,
        scale,
    } = trs;
    let moves = *translation != DVec3::ZERO;
    node.translation = moves.then(|| translation.as_vec3().to_array());
    let turns = rotation.w.abs() < 1.0 - 1e-15;
    node.rotation = turns.then(|| rotation.as_quat().to_array());
    let scales = (*scale - DVec3::ONE).abs().max_element() > 1e-12;
    node.scale = scales.then(|| scale.as_vec3().to_array());
}

/// Adds a node below the root.
fn below_root(list: &mut Vec<Node>, mut node: Node, position: DVec3, rotation: DQuat) -> Index {
    let trs = Trs {
        translation: position,
        rotation,
        scale: DVec3::ONE,
    };
    set_trs(&mut node, &trs);
    let index = list.len();
    list[0].children.push(index);
    list.push(node);
    index
}

/// Adds the cameras.
fn add_cameras(model: &Model, motion: &Motion, root: &mut Root, nodes: &mut NodeList) {
    let around = SceneSphere::in_motion(model, motion);
    for (number, camera) in model.cameras.iter().enumerate() {
        let node = Node {
            name: camera.name.clone(),
            camera: Some(root.cameras.len()),
            ..Node::default()
        };
        let planes = around.depths(number, camera, motion);
        root.cameras.push(lights::camera(camera, planes));
        let (position, turn) = (camera.pose.position, camera.pose.orientation);
        let index = below_root(&mut nodes.list, node, position, turn);
        nodes.of_cameras.push(index);
    }
}

/// Adds the lights, and returns their entries.
fn add_lights(model: &Model, nodes: &mut NodeList, losses: &mut Losses) -> Vec<Value> {
    let around = SceneSphere::of(model.bounds());
    let mut entries = Vec::new();
    for light in &model.lights {
        let number = json!({ "light": entries.len() });
        entries.push(lights::light(light, around, losses));
        let node = Node {
            name: light.name.clone(),
            extensions: Map::from_iter([("KHR_lights_punctual".to_owned(), number)]),
            ..Node::default()
        };
        let index = below_root(&mut nodes.list, node, light.position, light.rotation());
        nodes.of_lights.push(index);
    }
    entries
}
