//! Wavefront OBJ: the meshes of a scene in world space, with a library of materials beside it.
//!
//! Colors of vertices follow their positions, as many programs write and read them.

use std::collections::HashMap;
use std::fmt::Write;

use glam::{Affine2, DVec3, Vec3};
use ivcam_base::work::until_stopped;
use ivcam_render::scene::model::{Material, Mesh, Model, Part, Primitives, SceneNode};

use super::appearance::{Appearance, texture_point};
use super::names::{Names, on_one_line, picture_name};
use super::ply::normal_matrix;
use super::target::Target;

/// The numbers of the next vertex, texture coordinate and normal, which count from 1.
#[derive(Clone, Copy)]
struct Next {
    vertex: usize,
    coordinate: usize,
    normal: usize,
}

/// Writes a model. `stem` is the name of the file without its ending. Returns the file and the
/// files beside it.
pub(super) fn write(model: &Model, stem: &str) -> (Vec<u8>, Vec<(String, Vec<u8>)>) {
    let mut out = String::from("# by ivcam\n");
    let DVec3 { x, y, z } = model.offset;
    if model.offset != DVec3::ZERO {
        let _ = writeln!(out, "# offset {x} {y} {z}");
    }
    let stem = &*on_one_line(stem);
    let _ = writeln!(out, "mtllib {stem}.mtl");
    let mut library = MaterialLibrary {
        model,
        stem,
        text: String::from("# by ivcam\n"),
        names: HashMap::new(),
        pictures: Vec::new(),
    };
    let mut names = Names::default();
    let mut next = Next {
        vertex: 1,
        coordinate: 1,
        normal: 1,
    };
    for node in &model.nodes {
        for part in &node.parts {
            let name = names.identifier(node.name());
            let (material, keeps_colors) = library.name(*part);
            let _ = writeln!(out, "o {name}\nusemtl {material}");
            write_part(&mut out, model, (node, *part), keeps_colors, &mut next);
        }
    }
    let mut beside = vec![(format!("{stem}.mtl"), library.text.into_bytes())];
    beside.extend(library.pictures);
    (out.into_bytes(), beside)
}

/// Writes the vertices and the primitives of a mesh.
fn write_part(
    out: &mut String,
    model: &Model,
    (node, part): (&SceneNode, Part),
    keeps_colors: bool,
    next: &mut Next,
) {
    let (mesh, material) = (&model.meshes[part.mesh], &model.materials[part.material]);
    let world = &node.world;
    for (i, p) in until_stopped(mesh.positions.iter()).enumerate() {
        let Vec3 { x, y, z } = world.transform_point3(p.as_dvec3()).as_vec3();
        let _ = match mesh.colors.get(i).filter(|_| keeps_colors) {
            Some([r, g, b, _]) => writeln!(out, "v {x} {y} {z} {r} {g} {b}"),
            None => writeln!(out, "v {x} {y} {z}"),
        };
    }
    let texture = material.texture.as_ref();
    let matrix = texture.map_or(Affine2::IDENTITY, |t| t.matrix);
    for coordinates in until_stopped(mesh.coordinates.iter()) {
        let at = texture_point(matrix, *coordinates);
        let _ = writeln!(out, "vt {} {}", at.x, at.y);
    }
    let turn = normal_matrix(world);
    for normal in until_stopped(mesh.normals.iter()) {
        let Vec3 { x, y, z } = (turn * normal.as_dvec3()).normalize_or(DVec3::Z).as_vec3();
        let _ = writeln!(out, "vn {x} {y} {z}");
    }
    write_primitives(out, mesh, world.matrix3.determinant() < 0.0, *next);
    next.vertex += mesh.positions.len();
    next.coordinate += mesh.coordinates.len();
    next.normal += mesh.normals.len();
}

/// Writes the primitives of a mesh, whose vertices begin at some numbers.
fn write_primitives(out: &mut String, mesh: &Mesh, is_mirrored: bool, next: Next) {
    let corner = |v: u32| {
        let v = v as usize;
        let position = next.vertex + v;
        let coordinate = match mesh.coordinates.is_empty() {
            true => String::new(),
            false => (next.coordinate + v).to_string(),
        };
        match mesh.normals.is_empty() {
            true => format!("{position}/{coordinate}"),
            false => format!("{position}/{coordinate}/{}", next.normal + v),
        }
    };
    match &mesh.primitives {
        Primitives::Triangles(list) => {
            for &[a, b, c] in until_stopped(list.iter()) {
                let [b, c] = if is_mirrored { [c, b] } else { [b, c] };
                let _ = writeln!(out, "f {} {} {}", corner(a), corner(b), corner(c));
            }
        }
        Primitives::Lines(list) => {
            for [a, b] in until_stopped(list.iter()).map(|l| l.map(|v| next.vertex + v as usize)) {
                let _ = writeln!(out, "l {a} {b}");
            }
        }
        Primitives::Points => {
            for v in until_stopped(0..mesh.positions.len()) {
                let _ = writeln!(out, "p {}", next.vertex + v);
            }
        }
    }
}

/// The material of a model, and what the colors of a mesh make of it.
type MaterialKey = (usize, Option<[u32; 4]>);

/// The library of materials.
struct MaterialLibrary<'m> {
    model: &'m Model,
    stem: &'m str,
    text: String,
    /// The names of materials, with whether they keep the colors of meshes.
    names: HashMap<MaterialKey, (String, bool)>,
    pictures: Vec<(String, Vec<u8>)>,
}

impl MaterialLibrary<'_> {
    /// Returns the name of the material of a part, which is written at its first use, and whether
    /// the colors of the mesh are used.
    fn name(&mut self, part: Part) -> (String, bool) {
        let model = self.model;
        let (mesh, material) = (&model.meshes[part.mesh], &model.materials[part.material]);
        let image = material.texture.as_ref().map(|t| &model.images[t.image]);
        let key = (
            part.material,
            Appearance::key(material, image, mesh, Target::Obj),
        );
        if let Some(known) = self.names.get(&key) {
            return known.clone();
        }
        let is_colorful = !mesh.colors.is_empty();
        let mut look = Appearance::of(material, image, is_colorful).on_mesh(mesh, Target::Obj);
        let keeps_colors = look.keeps_colors && is_colorful;
        if keeps_colors {
            // Programs multiply the colors of vertices by that of the material, or replace it.
            look.color = Vec3::ONE;
        }
        let name = format!("material{}", self.names.len() + 1);
        self.write(&name, material, &look);
        self.names.insert(key, (name.clone(), keeps_colors));
        (name, keeps_colors)
    }

    /// Writes a material.
    fn write(&mut self, name: &str, material: &Material, look: &Appearance<'_>) {
        let picture = look.image.as_ref().map(|image| {
            let bytes = image.png();
            let known = self.pictures.iter().find(|(_, known)| *known == bytes);
            known.map(|(name, _)| name.clone()).unwrap_or_else(|| {
                let name = picture_name(self.stem, Target::Obj, self.pictures.len());
                self.pictures.push((name.clone(), bytes));
                name
            })
        });
        let out = &mut self.text;
        let _ = writeln!(out, "newmtl {name}");
        let mut color = |key: &str, c: Vec3| {
            let _ = writeln!(out, "{key} {} {} {}", c.x, c.y, c.z);
        };
        color("Kd", look.color);
        if look.unlit {
            let _ = writeln!(out, "illum 0");
        } else {
            color("Ka", material.ambient);
            color("Ks", material.specular);
            color("Ke", material.emissive);
            let exponent = 128.0 * material.shininess.clamp(0.0, 1.0);
            let _ = writeln!(out, "Ns {exponent}\nillum 2");
        }
        let _ = writeln!(out, "d {}", look.opacity);
        if let (Some(picture), Some(texture)) = (picture, &material.texture) {
            let clamp = if texture.repeat == [false; 2] {
                "-clamp on "
            } else {
                ""
            };
            let _ = writeln!(out, "map_Kd {clamp}{picture}");
            let is_transparent = look.image.as_ref().is_some_and(|i| i.is_transparent());
            if is_transparent {
                let _ = writeln!(out, "map_d {clamp}-imfchan m {picture}");
            }
        }
    }
}
