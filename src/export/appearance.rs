//! How a material and its texture look in formats whose texture multiplies one color.

use std::borrow::Cow;

use glam::{Affine2, Vec2, Vec3, Vec4};
use ivcam_render::scene::model::{Image, Material, Mesh, TextureModel};

use super::target::Target;

/// A material whose texture, if any, multiplies its color.
#[derive(Clone, Debug)]
pub(super) struct Appearance<'m> {
    /// The color, as a screen shows it. Colors of the mesh replace it if `keeps_colors`.
    pub color: Vec3,
    /// The opacity. Colors of the mesh replace it if `keeps_colors`.
    pub opacity: f32,
    /// Whether the color is shown without lighting.
    pub unlit: bool,
    /// Whether the colors of the mesh are used.
    pub keeps_colors: bool,
    /// The picture of the texture, which may differ from the scene's.
    pub image: Option<Cow<'m, Image>>,
}

/// Whether an appearance only approximates the texture's model: the texture is then lit, or the
/// colors of the mesh are multiplied.
pub(super) fn is_approximate(model: TextureModel, image: &Image) -> bool {
    match model {
        TextureModel::Blend => true,
        TextureModel::Decal => image.has_alpha(),
        _ => false,
    }
}

/// Whether a texture takes the place of the colors of vertices: a surface of USD has one source of
/// color, and a texture in color replaces all other colors in VRML97 (4.14.4).
pub(super) fn replaces_vertex_colors(target: Target, image: &Image) -> bool {
    match target {
        Target::Usda => true,
        Target::Vrml97 => image.has_color(),
        _ => false,
    }
}

/// The mean of the colors and opacities of a mesh, which has some.
pub(super) fn mean_color(mesh: &Mesh) -> [f32; 4] {
    let sum: Vec4 = mesh.colors.iter().map(|c| Vec4::from_array(*c)).sum();
    (sum / mesh.colors.len() as f32).to_array()
}

/// Applies the matrix of a texture to texture coordinates. A result that is not finite becomes 0.
pub(super) fn texture_point(matrix: Affine2, coordinates: Vec2) -> Vec2 {
    let finite = |v: f32| if v.is_finite() { v } else { 0.0 };
    matrix.transform_point2(coordinates).map(finite)
}

impl<'m> Appearance<'m> {
    /// Returns the appearance of a material with its own color and its texture's picture.
    pub(super) fn plain(material: &Material, image: Option<&'m Image>) -> Self {
        Self {
            color: material.diffuse,
            opacity: 1.0 - material.transparency,
            unlit: material.unlit,
            keeps_colors: true,
            image: image.map(Cow::Borrowed),
        }
    }

    /// Returns the appearance of a material. `image` is the picture of its texture, and
    /// `is_colorful` says whether its mesh has colors.
    pub(super) fn of(material: &Material, image: Option<&'m Image>, is_colorful: bool) -> Self {
        let plain = Self::plain(material, image);
        let (Some(texture), Some(image)) = (&material.texture, image) else {
            return plain;
        };
        let has_alpha = image.has_alpha();
        match texture.model {
            TextureModel::Modulate | TextureModel::Material => plain,
            TextureModel::Blend if is_colorful => plain,
            TextureModel::Decal if has_alpha && is_colorful => plain,
            TextureModel::Decal if has_alpha => {
                plain.baked(image, |color, texel, alpha| color.lerp(texel, alpha))
            }
            TextureModel::Blend => plain.baked(image, |color, texel, _| {
                color * (1.0 - texel) + texture.blend_color * texel
            }),
            TextureModel::Diffuse | TextureModel::Replace | TextureModel::Decal => {
                let replaces_color = texture.replaces_color(image);
                let replaces_opacity = texture.replaces_opacity(image);
                Self {
                    color: if replaces_color {
                        Vec3::ONE
                    } else {
                        plain.color
                    },
                    opacity: if replaces_opacity { 1.0 } else { plain.opacity },
                    unlit: plain.unlit || texture.model != TextureModel::Diffuse,
                    keeps_colors: !replaces_color,
                    ..plain
                }
            }
        }
    }

    /// Returns the appearance on a mesh. If the mesh has colors, their mean is the opacity, and
    /// also the color if a texture replaces them.
    pub(super) fn on_mesh(self, mesh: &Mesh, target: Target) -> Self {
        if !self.keeps_colors || mesh.colors.is_empty() {
            return self;
        }
        let [r, g, b, opacity] = mean_color(mesh);
        let image = self.image.as_deref();
        if !image.is_some_and(|image| replaces_vertex_colors(target, image)) {
            return Self { opacity, ..self };
        }
        Self {
            color: Vec3::new(r, g, b),
            opacity,
            keeps_colors: false,
            ..self
        }
    }

    /// The bits of the color and the opacity of a material on a mesh with colors. Without colors
    /// the appearance depends on the material alone.
    pub(super) fn key(
        material: &Material,
        image: Option<&Image>,
        mesh: &Mesh,
        target: Target,
    ) -> Option<[u32; 4]> {
        let has_colors = !mesh.colors.is_empty();
        has_colors.then(|| {
            let look = Appearance::of(material, image, true).on_mesh(mesh, target);
            look.color.extend(look.opacity).to_array().map(f32::to_bits)
        })
    }

    /// Computes the colors of a picture from the material's color, the texel and its alpha.
    fn baked(self, image: &Image, mix: impl Fn(Vec3, Vec3, f32) -> Vec3) -> Self {
        let level = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
        let pixels = image.pixels.iter().map(|pixel| {
            let [r, g, b, a] = pixel.map(|v| f32::from(v) / 255.0);
            let [r, g, b] = mix(self.color, Vec3::new(r, g, b), a).to_array().map(level);
            [r, g, b, 255]
        });
        let image = Image {
            components: 3,
            pixels: pixels.collect(),
            ..image.clone()
        };
        Self {
            color: Vec3::ONE,
            image: Some(Cow::Owned(image)),
            ..self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ivcam_render::scene::model::Texture;

    fn material(model: TextureModel) -> Material {
        Material {
            ambient: Vec3::ZERO,
            ambient_light: Vec3::ZERO,
            diffuse: Vec3::new(1.0, 0.0, 0.0),
            specular: Vec3::ZERO,
            emissive: Vec3::ZERO,
            shininess: 0.2,
            transparency: 0.25,
            unlit: false,
            double_sided: true,
            physical: None,
            texture: Some(Texture {
                image: 0,
                model,
                blend_color: Vec3::new(0.0, 0.0, 1.0),
                repeat: [true; 2],
                smooth: true,
                matrix: Affine2::IDENTITY,
            }),
        }
    }

    fn seen(model: TextureModel, components: usize, pixel: [u8; 4]) -> ([f32; 4], [u8; 4], bool) {
        let image = Image {
            width: 1,
            height: 1,
            components,
            pixels: vec![pixel],
        };
        let material = material(model);
        let look = Appearance::of(&material, Some(&image), false);
        let picture = look.image.map_or([0; 4], |i| i.pixels[0]);
        (
            look.color.extend(look.opacity).to_array(),
            picture,
            look.unlit,
        )
    }

    #[test]
    fn each_texture_model_gives_the_color_of_the_standard() {
        let (red, white) = ([1.0, 0.0, 0.0, 0.75], [1.0, 1.0, 1.0, 0.75]);
        let (green, gray) = ([0, 255, 0, 255], [51, 51, 51, 255]);
        assert_eq!(seen(TextureModel::Modulate, 3, green), (red, green, false));
        // VRML97, table 4.5: colors replace the diffuse color, gray multiplies it.
        assert_eq!(seen(TextureModel::Diffuse, 3, green), (white, green, false));
        assert_eq!(seen(TextureModel::Diffuse, 1, gray), (red, gray, false));
        // OpenGL 1.1, table 3.11.
        assert_eq!(seen(TextureModel::Decal, 3, green), (white, green, true));
        let half = seen(TextureModel::Decal, 4, [0, 255, 0, 51]);
        assert_eq!(half, (white, [204, 51, 0, 255], false));
        let blend = seen(TextureModel::Blend, 1, gray);
        assert_eq!(blend, (white, [204, 0, 51, 255], false));
    }
}
