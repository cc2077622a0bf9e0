//! Reads MTL, the libraries of materials of OBJ files.
//!
//! A material becomes a `Material` with the ambient color as a fraction of the diffuse one, and
//! `map_Kd` a texture that multiplies it. What a library states beyond that is reported.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{Vec2, Vec3};
use ivcam_base::diag::{Diagnostic, Result, Source, Span, excerpt};
use ivcam_base::work;

use super::builder::{Builder, color};
use super::text_lines::{TextLine, text_lines};
use crate::grammar::value::{NodeId, Value};
use crate::grammar::{
    appearance, class, image_texture, texture_transform, unlit_material,
    vrml97_material as material97,
};
use crate::iv::display::linear_of_display;
use crate::iv::limits::cut_at;

/// A material of a library.
struct MtlMaterial {
    name: String,
    ambient: Option<Vec3>,
    diffuse: Option<Vec3>,
    specular: Vec3,
    emissive: Vec3,
    exponent: f32,
    transparency: f32,
    /// Whether it has one color without lighting: `illum 0`.
    is_unlit: bool,
    has_highlight: bool,
    texture: Option<MtlTexture>,
    span: Span,
    source: u16,
    /// The nodes for faces, and for lines and points, once they are added.
    nodes: [Option<NodeId>; 2],
}

/// The texture of a material.
struct MtlTexture {
    file: String,
    scale: Vec2,
    offset: Vec2,
    is_clamped: bool,
}

/// The materials of the libraries of a file.
#[derive(Default)]
pub(super) struct MaterialLibraries {
    materials: Vec<MtlMaterial>,
    by_name: HashMap<String, usize>,
    plain: Option<NodeId>,
}

impl MaterialLibraries {
    /// Returns the number of a material.
    pub(super) fn named(&self, name: &str) -> Option<usize> {
        self.by_name.get(name).copied()
    }

    /// Returns the appearance of faces without a material.
    ///
    /// # Errors
    /// Returns an error if a limit is exceeded.
    pub(super) fn plain(&mut self, builder: &mut Builder<'_, '_>) -> Result<NodeId> {
        match self.plain {
            Some(node) => Ok(node),
            None => Ok(*self.plain.insert(builder.plain_appearance()?)),
        }
    }

    /// Reads the libraries that a line names. A name may have spaces.
    ///
    /// # Errors
    /// Returns an error if a limit is exceeded.
    pub(super) fn read(&mut self, builder: &mut Builder<'_, '_>, line: TextLine<'_>) -> Result<()> {
        let whole = line.after_first();
        if self.file(builder, &whole)?.is_ok() {
            return Ok(());
        }
        for name in line.words().skip(1) {
            if let Err(error) = self.file(builder, name)? {
                let warning = builder.warn(line.span(), error.message.clone());
                warning.help("faces are drawn without its materials");
            }
        }
        Ok(())
    }

    /// Reads a library. The inner error is that it cannot be opened.
    fn file(
        &mut self,
        builder: &mut Builder<'_, '_>,
        name: &str,
    ) -> Result<std::result::Result<(), Box<Diagnostic>>> {
        let document = &mut *builder.asm.document;
        let from = document.sources[usize::from(builder.asm.source)]
            .name
            .clone();
        let loaded = match &document.loader {
            Some(loader) => loader.load(&from, name),
            None => Err(Diagnostic::error("the document has no loader")),
        };
        let (name, bytes) = match loaded {
            Ok(loaded) => loaded,
            Err(error) => return Ok(Err(error)),
        };
        let steps = bytes.len() as u64 / 4 + 1;
        work::spend(steps).map_err(|cut| cut_at(&document.sink, Span::default(), cut))?;
        let source = Arc::new(Source::new(name, bytes));
        document.sources.push(source.clone());
        let place = u16::try_from(document.sources.len() - 1).unwrap_or(u16::MAX);
        let before = document.sink.set_source(Some(source.clone()));
        for line in text_lines(&source.bytes) {
            self.line(builder, line, place);
        }
        builder.asm.document.sink.set_source(before);
        Ok(Ok(()))
    }

    fn line(&mut self, builder: &mut Builder<'_, '_>, line: TextLine<'_>, source: u16) {
        let word = line.words().next().unwrap_or_default();
        if word == "newmtl" {
            let name = line.after_first();
            self.by_name.insert(name.clone(), self.materials.len());
            self.materials
                .push(MtlMaterial::new(name, line.span(), source));
            return;
        }
        if word.starts_with('#') {
            return;
        }
        let Some(material) = self.materials.last_mut() else {
            builder.damage(
                line.span(),
                format!("`{}` is before the first material", excerpt(word)),
            );
            return;
        };
        if let Err(message) = material.line(word, line) {
            builder.warn(line.span(), message);
        }
    }

    /// Returns whether a material is shown without lighting.
    pub(super) fn is_unlit(&self, number: usize) -> bool {
        self.materials[number].is_unlit
    }

    /// Returns the appearance of a material, for faces or for lines and points.
    ///
    /// # Errors
    /// Returns an error if a limit is exceeded.
    pub(super) fn appearance(
        &mut self,
        builder: &mut Builder<'_, '_>,
        number: usize,
        is_face: bool,
    ) -> Result<NodeId> {
        let material = &mut self.materials[number];
        if let Some(node) = material.nodes[usize::from(is_face)] {
            return Ok(node);
        }
        // A relative path of a texture starts at the folder of the library.
        let own = std::mem::replace(&mut builder.asm.source, material.source);
        let node = material.add(builder, is_face);
        builder.asm.source = own;
        material.nodes[usize::from(is_face)] = Some(node?);
        node_of(material, is_face)
    }
}

/// Returns the node of a material that was added.
fn node_of(material: &MtlMaterial, is_face: bool) -> Result<NodeId> {
    material.nodes[usize::from(is_face)].ok_or_else(|| Diagnostic::error("a material has no node"))
}

impl MtlMaterial {
    fn new(name: String, span: Span, source: u16) -> Self {
        Self {
            name,
            ambient: None,
            diffuse: None,
            specular: Vec3::ZERO,
            emissive: Vec3::ZERO,
            exponent: 0.0,
            transparency: 0.0,
            is_unlit: false,
            has_highlight: true,
            texture: None,
            span,
            source,
            nodes: [None; 2],
        }
    }

    /// Reads a statement. Returns a message about one that is not read.
    fn line(&mut self, word: &str, line: TextLine<'_>) -> std::result::Result<(), String> {
        let number = || line.numbers::<f32>().next().filter(|n| n.is_finite());
        let missing = || format!("`{word}` needs a number");
        match word {
            "Ka" => self.ambient = Some(mtl_color(line)?),
            "Kd" => self.diffuse = Some(mtl_color(line)?),
            "Ks" => self.specular = mtl_color(line)?,
            "Ke" => self.emissive = mtl_color(line)?,
            "Ns" => self.exponent = number().ok_or_else(missing)?,
            "d" => {
                let opacity = line
                    .words()
                    .filter_map(|word| word.parse::<f32>().ok())
                    .next();
                self.transparency = 1.0 - opacity.ok_or_else(missing)?.clamp(0.0, 1.0);
            }
            "Tr" => self.transparency = number().ok_or_else(missing)?.clamp(0.0, 1.0),
            "illum" => {
                // 0 is the color alone, 1 Lambert's law, and further models add highlights.
                self.is_unlit = number() == Some(0.0);
                self.has_highlight = number() != Some(1.0);
            }
            "map_Kd" => self.texture = MtlTexture::of(&line.after_first()),
            "map_d" if self.texture_is(line) => {}
            "Ni" | "Tf" | "sharpness" | "map_aat" | "Km" => {}
            _ => {
                let word = excerpt(word);
                return Err(format!("the statement `{word}` of a material is not read"));
            }
        }
        Ok(())
    }

    /// Whether a line names the file of the texture, whose transparency is drawn with its color.
    fn texture_is(&self, line: TextLine<'_>) -> bool {
        let file = self.texture.as_ref().map(|texture| &texture.file);
        file.is_some()
            && file
                == MtlTexture::of(&line.after_first())
                    .as_ref()
                    .map(|t| &t.file)
    }

    /// Returns the diffuse color. A texture without one has its own colors.
    fn diffuse(&self) -> Vec3 {
        let usual = if self.texture.is_some() { 1.0 } else { 0.8 };
        self.diffuse.unwrap_or(Vec3::splat(usual))
    }

    /// Adds the `Appearance`.
    fn add(&self, builder: &mut Builder<'_, '_>, is_face: bool) -> Result<NodeId> {
        let span = self.span;
        let appearance = builder.node(class::APPEARANCE, span)?;
        let material = match self.is_unlit && is_face {
            true => self.unlit(builder)?,
            false => self.lit(builder, is_face)?,
        };
        builder.set(
            appearance,
            appearance::MATERIAL,
            Value::Node(Some(material)),
        );
        if is_face {
            builder.name(appearance, &self.name);
        }
        let Some(texture) = self.texture.as_ref().filter(|_| is_face) else {
            return Ok(appearance);
        };
        let urls = Value::Strings(vec![texture.file.clone()]);
        let node = builder.with(class::IMAGE_TEXTURE, image_texture::URL, urls, span)?;
        if texture.is_clamped {
            builder.set(node, image_texture::REPEAT_S, Value::Bool(false));
            builder.set(node, image_texture::REPEAT_T, Value::Bool(false));
        }
        // It multiplies the color, while the texture of an `Appearance` would replace it.
        let field = match self.is_unlit {
            true => unlit_material::EMISSIVE_TEXTURE,
            false => material97::DIFFUSE_TEXTURE,
        };
        builder.set(material, field, Value::Node(Some(node)));
        if (texture.scale, texture.offset) != (Vec2::ONE, Vec2::ZERO) {
            // A `TextureTransform` moves before it scales.
            let offset = texture.offset / texture.scale;
            let node = builder.node(class::TEXTURE_TRANSFORM, span)?;
            builder.set(node, texture_transform::SCALE, Value::Vec2(texture.scale));
            builder.set(node, texture_transform::TRANSLATION, Value::Vec2(offset));
            builder.set(
                appearance,
                appearance::TEXTURE_TRANSFORM,
                Value::Node(Some(node)),
            );
        }
        Ok(appearance)
    }

    /// Adds a material without lighting. Its color is linear, as all of X3D's physical materials.
    fn unlit(&self, builder: &mut Builder<'_, '_>) -> Result<NodeId> {
        let linear = Value::Vec3(self.diffuse().map(linear_of_display));
        let node = builder.with(
            class::UNLIT_MATERIAL,
            unlit_material::EMISSIVE_COLOR,
            linear,
            self.span,
        )?;
        let transparency = Value::Float(self.transparency);
        builder.set(node, unlit_material::TRANSPARENCY, transparency);
        Ok(node)
    }

    fn lit(&self, builder: &mut Builder<'_, '_>, is_face: bool) -> Result<NodeId> {
        let mean = |color: Vec3| color.element_sum() / 3.0;
        let ambient = match self.ambient.map(mean) {
            Some(ambient) if mean(self.diffuse()) > 0.0 => ambient / mean(self.diffuse()),
            _ => 0.2,
        };
        // Lines and points show the emissive color only.
        let emissive = if is_face {
            self.emissive
        } else {
            self.diffuse()
        };
        let node = builder.node(class::VRML97_MATERIAL, self.span)?;
        let shininess = (self.exponent / 128.0).clamp(0.0, 1.0);
        builder.set(
            node,
            material97::AMBIENT_INTENSITY,
            Value::Float(ambient.clamp(0.0, 1.0)),
        );
        builder.set(node, material97::DIFFUSE_COLOR, Value::Vec3(self.diffuse()));
        if self.has_highlight {
            builder.set(node, material97::SPECULAR_COLOR, Value::Vec3(self.specular));
        }
        builder.set(node, material97::EMISSIVE_COLOR, Value::Vec3(emissive));
        builder.set(node, material97::SHININESS, Value::Float(shininess));
        builder.set(
            node,
            material97::TRANSPARENCY,
            Value::Float(self.transparency),
        );
        Ok(node)
    }
}

/// Reads three numbers, or one that counts for all.
fn mtl_color(line: TextLine<'_>) -> std::result::Result<Vec3, String> {
    let numbers: Vec<f32> = line.numbers().collect();
    match numbers[..] {
        [r, g, b, ..] => Ok(color([r, g, b])),
        [gray] => Ok(color([gray; 3])),
        _ => Err("colors as spectra or CIE values are not read".into()),
    }
}

impl MtlTexture {
    /// Reads the options and the name of a file, which may have spaces.
    fn of(text: &str) -> Option<Self> {
        let mut texture = Self {
            file: String::new(),
            scale: Vec2::ONE,
            offset: Vec2::ZERO,
            is_clamped: false,
        };
        let mut rest = text.trim_start();
        while rest.starts_with('-') {
            let (option, after) = first_word(rest);
            rest = after;
            let mut numbers = Vec::new();
            // Options have up to three numbers or one word.
            while numbers.len() < 3
                && let (word, after) = first_word(rest)
                && let Ok(number) = word.parse::<f32>()
            {
                numbers.push(number);
                rest = after;
            }
            if numbers.is_empty() {
                let (word, after) = first_word(rest);
                texture.is_clamped |= option == "-clamp" && word == "on";
                rest = after;
            }
            let pair = |usual: f32| {
                let at = |i: usize| numbers.get(i).copied().filter(|n| n.is_finite());
                Vec2::new(at(0).unwrap_or(usual), at(1).unwrap_or(usual))
            };
            match option {
                "-s" => texture.scale = pair(1.0),
                "-o" => texture.offset = pair(0.0),
                _ => {}
            }
        }
        texture.file = rest.trim().replace('\\', "/");
        let is_usable = !texture.file.is_empty() && texture.scale.min_element() != 0.0;
        is_usable.then_some(texture)
    }
}

/// Returns the first word of a text, and what follows it.
fn first_word(text: &str) -> (&str, &str) {
    let (word, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
    (word, rest.trim_start())
}
