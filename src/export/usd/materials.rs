//! Materials as `UsdPreviewSurface`, with the mapping that glTF has: metals by its metallic
//! workflow, and all others by the specular one.

use std::collections::HashMap;

use glam::Vec3;
use ivcam_render::scene::model::{Material, Model, Part};

use super::text::{UsdText, asset, tuple};
use crate::export::appearance::Appearance;
use crate::export::color::{base_color, linear3};
use crate::export::highlight::{reflectance, roughness};
use crate::export::names::picture_name;
use crate::export::target::Target;

/// How a shape uses a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct UsdTextureUse {
    material: usize,
    /// What the colors of the mesh make of the material.
    colors: Option<[u32; 4]>,
    is_transparent: bool,
}

/// The materials of a stage, and the pictures beside it.
pub(super) struct UsdMaterials<'m> {
    model: &'m Model,
    /// The beginning of the names of pictures, without control characters.
    stem: String,
    known: HashMap<UsdTextureUse, String>,
    /// The text of the materials.
    pub text: UsdText,
    /// The pictures with their names.
    pub pictures: Vec<(String, Vec<u8>)>,
}

impl<'m> UsdMaterials<'m> {
    pub(super) fn new(model: &'m Model, stem: &str) -> Self {
        Self {
            model,
            stem: stem.chars().filter(|c| !c.is_control()).collect(),
            known: HashMap::new(),
            text: UsdText::inside(2),
            pictures: Vec::new(),
        }
    }

    /// Returns the path of the material of a part, which is written at its first use.
    pub(super) fn path(&mut self, part: Part) -> String {
        let model = self.model;
        let (mesh, material) = (&model.meshes[part.mesh], &model.materials[part.material]);
        let image = material.texture.as_ref().map(|t| &model.images[t.image]);
        let used = UsdTextureUse {
            material: part.material,
            colors: Appearance::key(material, image, mesh, Target::Usda),
            is_transparent: mesh.colors.iter().any(|c| c[3] < 1.0),
        };
        if let Some(path) = self.known.get(&used) {
            return path.clone();
        }
        let path = format!("/Scene/Materials/Material_{}", self.known.len() + 1);
        self.known.insert(used, path.clone());
        let look = Appearance::of(material, image, used.colors.is_some());
        self.write(&path, &look.on_mesh(mesh, Target::Usda), used);
        path
    }

    /// Returns the name of the file of a picture.
    fn picture(&mut self, look: &Appearance<'_>) -> Option<String> {
        let bytes = look.image.as_ref()?.png();
        let known = self.pictures.iter().find(|(_, known)| *known == bytes);
        Some(known.map(|(name, _)| name.clone()).unwrap_or_else(|| {
            let name = picture_name(&self.stem, Target::Usda, self.pictures.len());
            self.pictures.push((name.clone(), bytes));
            name
        }))
    }

    /// Writes a material.
    fn write(&mut self, path: &str, look: &Appearance<'_>, used: UsdTextureUse) {
        let material = &self.model.materials[used.material];
        let texture = material.texture.as_ref();
        let picture = self.picture(look);
        let name = path.rsplit('/').next().unwrap_or_default();
        self.text.open(format_args!("def Material \"{name}\""));
        self.text.line(format_args!(
            "token outputs:surface.connect = <{path}/Surface.outputs:surface>"
        ));
        self.surface(path, material, look, used);
        if let (Some(picture), Some(texture)) = (picture, texture) {
            let wrap = |repeats: bool| if repeats { "repeat" } else { "clamp" };
            let [r, g, b] = base_color(look.color.to_array(), material.diffuse_share());
            let wraps = texture.repeat.map(wrap);
            self.texture(path, &picture, wraps, [r, g, b, look.opacity]);
        }
        if used.colors.is_some() && look.keeps_colors {
            self.reader("Color", "float3", "displayColor");
            if used.is_transparent {
                self.reader("Opacity", "float", "displayOpacity");
            }
        }
        self.text.close();
    }

    /// Writes the shader of the surface.
    fn surface(
        &mut self,
        path: &str,
        material: &Material,
        look: &Appearance<'_>,
        used: UsdTextureUse,
    ) {
        let reads_colors = used.colors.is_some() && look.keeps_colors;
        let input = if look.unlit {
            "emissiveColor"
        } else {
            "diffuseColor"
        };
        let out = &mut self.text;
        out.open("def Shader \"Surface\"");
        out.line("uniform token info:id = \"UsdPreviewSurface\"");
        if look.image.is_some() {
            out.line(format_args!(
                "color3f inputs:{input}.connect = <{path}/Texture.outputs:rgb>"
            ));
        } else if reads_colors {
            out.line(format_args!(
                "color3f inputs:{input}.connect = <{path}/Color.outputs:result>"
            ));
        } else {
            out.line(format_args!(
                "color3f inputs:{input} = {}",
                tuple(base_color(look.color.to_array(), material.diffuse_share()))
            ));
        }
        let picture = look.image.as_ref();
        if picture.is_some_and(|i| i.is_transparent()) {
            out.line(format_args!(
                "float inputs:opacity.connect = <{path}/Texture.outputs:a>"
            ));
            if picture.is_some_and(|i| i.is_cutout()) && look.opacity >= 1.0 {
                out.line("float inputs:opacityThreshold = 0.5");
            }
        } else if reads_colors && used.is_transparent {
            out.line(format_args!(
                "float inputs:opacity.connect = <{path}/Opacity.outputs:result>"
            ));
        } else if look.opacity < 1.0 {
            out.line(format_args!("float inputs:opacity = {}", look.opacity));
        }
        highlight(out, material, look.unlit);
        out.line("token outputs:surface");
        out.close();
    }

    /// Writes the shaders of a texture, which is multiplied by a color.
    fn texture(&mut self, path: &str, picture: &str, [s, t]: [&str; 2], color: [f32; 4]) {
        let out = &mut self.text;
        out.open("def Shader \"Texture\"");
        out.line("uniform token info:id = \"UsdUVTexture\"");
        let file = asset(&format!("./{picture}"));
        out.line(format_args!("asset inputs:file = {file}"));
        out.line(format_args!(
            "float2 inputs:st.connect = <{path}/Coordinates.outputs:result>"
        ));
        out.line(format_args!("token inputs:wrapS = \"{s}\""));
        out.line(format_args!("token inputs:wrapT = \"{t}\""));
        out.line("token inputs:sourceColorSpace = \"sRGB\"");
        out.line(format_args!("float4 inputs:scale = {}", tuple(color)));
        out.line("float3 outputs:rgb");
        out.line("float outputs:a");
        out.close();
        self.reader("Coordinates", "float2", "st");
    }

    /// Writes a shader that reads a list of the mesh.
    fn reader(&mut self, name: &str, kind: &str, list: &str) {
        let out = &mut self.text;
        out.open(format_args!("def Shader \"{name}\""));
        out.line(format_args!(
            "uniform token info:id = \"UsdPrimvarReader_{kind}\""
        ));
        out.line(format_args!("string inputs:varname = \"{list}\""));
        out.line(format_args!("{kind} outputs:result"));
        out.close();
    }
}

/// Writes the inputs of a surface's highlight and of the light that it emits. Metals have the
/// metallic workflow, in which the diffuse color is that of the metal.
fn highlight(out: &mut UsdText, material: &Material, is_unlit: bool) {
    let metal = material.physical.filter(|own| own.metallic > 0.0);
    let is_specular = i32::from(metal.is_none());
    out.line(format_args!(
        "int inputs:useSpecularWorkflow = {is_specular}"
    ));
    if is_unlit {
        out.line("color3f inputs:diffuseColor = (0, 0, 0)");
        out.line("color3f inputs:specularColor = (0, 0, 0)");
        out.line("float inputs:roughness = 1");
        return;
    }
    if material.emissive != Vec3::ZERO {
        let light = tuple(linear3(material.emissive));
        out.line(format_args!("color3f inputs:emissiveColor = {light}"));
    }
    match metal {
        Some(own) => {
            out.line(format_args!("float inputs:metallic = {}", own.metallic));
            // F₀ = ((1 − n) / (1 + n))² of the part that is no metal.
            let root = (own.dielectric.element_sum() / 3.0).clamp(0.0, 0.9).sqrt();
            out.line(format_args!(
                "float inputs:ior = {}",
                (1.0 + root) / (1.0 - root)
            ));
        }
        None => {
            let specular = tuple(reflectance(material));
            out.line(format_args!("color3f inputs:specularColor = {specular}"));
        }
    }
    out.line(format_args!(
        "float inputs:roughness = {}",
        roughness(material)
    ));
}
