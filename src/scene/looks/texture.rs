//! Textures: decoding and filtering.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use glam::{Vec2, Vec3, Vec4};

use crate::diag::Result;
use crate::files::{MAX_PICTURE, read_file};
use crate::grammar::value::{Image, Text};
use crate::grammar::{Field, image_texture, texture2, texture3, vrml97_background};
use crate::iv::NodeRef;
use crate::picture::Raster;

/// How a texture is filtered, which depends on the `textureQuality` of `Complexity`. The limits are
/// Coin's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Filter {
    /// The nearest texel, for a quality below 0.2.
    Nearest,
    /// Bilinear interpolation, for a quality below 0.5.
    Linear,
    /// Trilinear interpolation between smaller versions (mipmaps), if a pixel covers several
    /// texels.
    Smooth,
}

impl Filter {
    /// The filter for a texture quality.
    pub(crate) fn of(quality: f32) -> Self {
        match quality {
            q if q < 0.2 => Self::Nearest,
            q if q < 0.5 => Self::Linear,
            _ => Self::Smooth,
        }
    }
}

/// The coordinates along which a texture repeats. Along the others it is clamped to its edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Repeat {
    /// Whether it repeats along its width.
    pub s: bool,
    /// Whether it repeats along its height.
    pub t: bool,
    /// Whether a 3D texture repeats along its depth.
    pub r: bool,
}

impl Repeat {
    /// The texture is clamped along all coordinates.
    pub(crate) const NONE: Self = Self {
        s: false,
        t: false,
        r: false,
    };
}

/// A texture. Its rows are stored from the bottom, as in Inventor.
#[derive(Debug, Default)]
pub(crate) struct Texture {
    /// The width in texels.
    pub width: usize,
    /// The height in texels.
    pub height: usize,
    /// The texels as red, green, blue and alpha. An image in the scene is unpacked at the first
    /// use.
    texels: OnceLock<Vec<[u8; 4]>>,
    image: Option<Image>,
    /// Smaller versions (mipmaps), each half as wide and high as the one before, made at the first
    /// use.
    smaller: OnceLock<Vec<Texture>>,
    /// The further layers of a `Texture3`.
    deeper: Vec<Texture>,
    /// The number of components: 1 gray, 2 gray and alpha, 3 color, 4 color and alpha.
    pub components: usize,
}

impl Texture {
    /// Makes a white texture with the given alpha values, row by row from the bottom.
    pub(crate) fn from_coverage(width: usize, height: usize, coverage: &[u8]) -> Self {
        Self {
            width,
            height,
            texels: OnceLock::from(
                coverage
                    .iter()
                    .map(|&c| [255, 255, 255, c])
                    .collect::<Vec<_>>(),
            ),
            components: 2,
            ..Self::default()
        }
    }

    /// Whether the texture has an alpha component.
    pub(crate) fn has_alpha(&self) -> bool {
        matches!(self.components, 2 | 4)
    }

    /// Whether the texture has color components, and not only gray ones.
    pub(crate) fn has_color(&self) -> bool {
        self.components >= 3
    }

    /// Returns the color at (s, t), interpolated between texel centers.
    pub(crate) fn sample(&self, at: Vec2, filter: Filter, repeat: Repeat) -> Vec4 {
        let texels = self.texels();
        if texels.is_empty() || !at.is_finite() {
            return Vec4::ONE;
        }
        let side = match filter {
            Filter::Nearest => nearest,
            _ => between,
        };
        let (x0, x1, fx) = side(at.x, self.width, repeat.s);
        let (y0, y1, fy) = side(at.y, self.height, repeat.t);
        let texel = |x: usize, y: usize| {
            Vec4::from_array(texels[y * self.width + x].map(|c| f32::from(c) / 255.0))
        };
        let low = texel(x0, y0).lerp(texel(x1, y0), fx);
        let high = texel(x0, y1).lerp(texel(x1, y1), fx);
        low.lerp(high, fy)
    }

    /// Whether this is a 3D texture with several layers.
    pub(crate) fn is_deep(&self) -> bool {
        !self.deeper.is_empty()
    }

    /// Returns the color at (s, t, r), interpolated between two layers, where a pixel covers
    /// `texels` texels across.
    pub(crate) fn sample_deep(
        &self,
        at: Vec3,
        texels: f32,
        filter: Filter,
        repeat: Repeat,
    ) -> Vec4 {
        let slice = |i: usize| match i {
            0 => self,
            _ => &self.deeper[i - 1],
        };
        let flat = |i| slice(i).sample_wide(at.truncate(), texels, filter, repeat);
        if !self.is_deep() || !at.is_finite() {
            return flat(0);
        }
        let side = match filter {
            Filter::Nearest => nearest,
            _ => between,
        };
        let (near, far, share) = side(at.z, self.depth(), repeat.r);
        flat(near).lerp(flat(far), share)
    }

    /// Returns the color at (s, t) where a pixel covers `texels` texels across. It is interpolated
    /// between the versions whose texels are just smaller and just larger than the pixel, as by
    /// OpenGL's trilinear filter.
    pub(crate) fn sample_wide(
        &self,
        at: Vec2,
        texels: f32,
        filter: Filter,
        repeat: Repeat,
    ) -> Vec4 {
        if filter != Filter::Smooth || !(texels > 1.0) {
            return self.sample(at, filter, repeat);
        }
        let smaller = self.smaller();
        if smaller.is_empty() {
            return self.sample(at, filter, repeat);
        }
        let level = libm::log2f(texels).min(smaller.len() as f32);
        let below = level.floor();
        let version = |i: usize| match i {
            0 => self,
            _ => &smaller[i - 1],
        };
        let fine = version(below as usize).sample(at, filter, repeat);
        let next = (below as usize + 1).min(smaller.len());
        fine.lerp(version(next).sample(at, filter, repeat), level - below)
    }

    /// The texels, row by row from the bottom.
    pub(in crate::scene) fn texels(&self) -> &[[u8; 4]] {
        let unpacked = || self.image.as_ref().map_or_else(Vec::new, unpack);
        self.texels.get_or_init(unpacked)
    }

    /// The number of layers.
    pub(in crate::scene) fn depth(&self) -> usize {
        self.deeper.len() + 1
    }

    /// The smaller versions, down to one texel.
    fn smaller(&self) -> &[Self] {
        self.smaller.get_or_init(|| {
            let mut smaller: Vec<Self> = Vec::new();
            loop {
                let last = smaller.last().unwrap_or(self);
                if last.width <= 1 && last.height <= 1 || last.texels().is_empty() {
                    return smaller;
                }
                let next = last.halved();
                smaller.push(next);
            }
        })
    }

    /// The version with half the width and height, rounded up.
    fn halved(&self) -> Self {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let mut texels = Vec::with_capacity(width * height);
        let all = self.texels();
        let row = |y: usize| {
            let y = y.min(self.height - 1);
            &all[y * self.width..(y + 1) * self.width]
        };
        for y in 0..height {
            let pairs = row(2 * y).chunks(2).zip(row(2 * y + 1).chunks(2));
            texels.extend(pairs.map(|(low, high)| {
                // The last texel of an odd row is counted twice.
                let (c, d) = (low[low.len() - 1], high[high.len() - 1]);
                let sum = |i: usize| [low[0], high[0], c, d].map(|t| u32::from(t[i]));
                std::array::from_fn(|i| ((sum(i).iter().sum::<u32>() + 2) / 4) as u8)
            }));
        }
        Self {
            width,
            height,
            texels: texels.into(),
            components: self.components,
            ..Self::default()
        }
    }
}

/// Returns the texel that contains a coordinate, in the form of [`between`].
fn nearest(at: f32, size: usize, repeat: bool) -> (usize, usize, f32) {
    let at = if repeat {
        at - at.floor()
    } else {
        at.clamp(0.0, 1.0)
    };
    let x = ((at * size as f32) as usize).min(size - 1);
    (x, x, 0.0)
}

/// Returns the two texels around a coordinate, and its position between them from 0 to 1.
fn between(at: f32, size: usize, repeat: bool) -> (usize, usize, f32) {
    let n = size as i64;
    let at = if repeat {
        at - at.floor()
    } else {
        at.clamp(0.0, 1.0)
    };
    let x = at * size as f32 - 0.5;
    let low = x.floor();
    let wrap = |i: i64| {
        if repeat {
            i.rem_euclid(n) as usize
        } else {
            i.clamp(0, n - 1) as usize
        }
    };
    (wrap(low as i64), wrap(low as i64 + 1), x - low)
}

/// A field with file names.
#[derive(Clone, Copy)]
pub(crate) enum FileField {
    /// A field with one name.
    One(Field<Text>),
    /// A field with a list of names.
    Several(Field<[String]>),
}

impl FileField {
    /// Returns the names in the field of a node, and no names if the node has no such field.
    pub(crate) fn names<'a>(self, node: NodeRef<'a>) -> impl Iterator<Item = &'a str> {
        let (one, several): (_, &[String]) = match self {
            Self::One(field) => (node.find(field), &[]),
            Self::Several(field) => (None, node.find(field).unwrap_or(&[])),
        };
        let all = one.into_iter().chain(several.iter().map(String::as_str));
        all.filter(|name| !name.is_empty())
    }
}

/// The fields of a VRML 97 `Background` that name pictures.
pub(crate) const PANORAMA: [FileField; 6] = [
    FileField::Several(vrml97_background::BACK_URL),
    FileField::Several(vrml97_background::BOTTOM_URL),
    FileField::Several(vrml97_background::FRONT_URL),
    FileField::Several(vrml97_background::LEFT_URL),
    FileField::Several(vrml97_background::RIGHT_URL),
    FileField::Several(vrml97_background::TOP_URL),
];

/// The fields of texture nodes that name pictures.
pub(crate) const PICTURES: [FileField; 3] = [
    FileField::One(texture2::FILENAME),
    FileField::Several(image_texture::URL),
    FileField::Several(texture3::FILENAMES),
];

/// Decodes the texture of a node: its file, or the image in the node. Returns `None` if it has
/// neither.
///
/// # Errors
/// Returns a diagnostic if the file cannot be found or read. It names the file and the places where
/// it was searched.
pub(crate) fn decode(node: NodeRef<'_>, folders: &[PathBuf]) -> Result<Option<Texture>> {
    decode_named(node, &PICTURES, folders)
}

/// Returns the number of components of a node's texture, from 1 to 4, or `None` if it has none or
/// cannot be decoded.
pub(crate) fn components(node: NodeRef<'_>, folders: &[PathBuf]) -> Option<usize> {
    decode(node, folders)
        .ok()?
        .map(|texture| texture.components)
}

/// Decodes the texture of a node, like [`decode`], whose file is named by one of some fields.
///
/// # Errors
/// Returns the errors of [`decode`].
pub(crate) fn decode_named(
    node: NodeRef<'_>,
    fields: &[FileField],
    folders: &[PathBuf],
) -> Result<Option<Texture>> {
    if node.known_class().is_some_and(|c| c.is_a("Texture3")) {
        return decode_deep(node, folders);
    }
    let names = fields.iter().flat_map(|field| field.names(node));
    let mut diagnostic = None;
    for name in names {
        match open(node, name, folders) {
            Ok(texture) => return Ok(Some(texture)),
            Err(error) => diagnostic = diagnostic.or(Some(error)),
        }
    }
    if let Some(image) = node.find(texture2::IMAGE)
        && image.width > 0
        && image.height > 0
    {
        return Ok(from_image(image));
    }
    match diagnostic {
        Some(error) => Err(match node.source() {
            Some(source) => error.at(source, node.span()),
            None => error,
        }),
        None => Ok(None),
    }
}

/// Decodes the layers of a `Texture3`: its files, or the image in the node.
fn decode_deep(node: NodeRef<'_>, folders: &[PathBuf]) -> Result<Option<Texture>> {
    let mut slices = Vec::new();
    for name in FileField::Several(texture3::FILENAMES).names(node) {
        slices.push(open(node, name, folders)?);
    }
    if let Some(image) = node.find(texture3::IMAGES).filter(|_| slices.is_empty()) {
        let depth = usize::try_from(image.depth).unwrap_or(0).max(1);
        let each = (image.bytes.len() / depth).max(1);
        slices.extend(
            image
                .bytes
                .chunks_exact(each)
                .take(depth)
                .filter_map(|bytes| {
                    from_image(&Image {
                        bytes: bytes.into(),
                        ..image.clone()
                    })
                }),
        );
    }
    if slices.is_empty() {
        return Ok(None);
    }
    let mut first = slices.remove(0);
    first.deeper = slices;
    Ok(Some(first))
}

/// Decodes a file next to the scene or in one of some folders.
fn open(node: NodeRef<'_>, name: &str, folders: &[PathBuf]) -> Result<Texture> {
    let beside = node.document.load_beside(node.id, name);
    let (name, bytes) = match beside {
        Ok(found) => found,
        Err(error) => in_folders(name, folders).ok_or(error)?,
    };
    Ok(from_raster(&Raster::decode(&bytes, &name)?))
}

/// Reads the file with a name's last component from the first folder that has it.
fn in_folders(name: &str, folders: &[PathBuf]) -> Option<(String, Vec<u8>)> {
    let file = Path::new(name).file_name()?;
    folders.iter().find_map(|folder| {
        let path = folder.join(file);
        Some((
            path.display().to_string(),
            read_file(&path, MAX_PICTURE).ok()?,
        ))
    })
}

fn from_raster(raster: &Raster) -> Texture {
    let (width, height) = (raster.width as usize, raster.height as usize);
    let level = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
    let mut texels = Vec::with_capacity(width * height);
    for y in (0..height).rev() {
        for x in 0..width {
            let i = y * width + x;
            let [r, g, b] = raster.color(i).map(level);
            texels.push([r, g, b, level(raster.alpha(i))]);
        }
    }
    Texture {
        width,
        height,
        texels: texels.into(),
        components: raster.channels,
        ..Texture::default()
    }
}

fn from_image(image: &Image) -> Option<Texture> {
    let components = usize::from(image.components);
    let (width, height) = (image.width as usize, image.height as usize);
    let count = width.checked_mul(height)?;
    if image.bytes.len() < count.checked_mul(components)? || components == 0 {
        return None;
    }
    Some(Texture {
        width,
        height,
        image: Some(image.clone()),
        components,
        ..Texture::default()
    })
}

/// Returns the texels of an image in the scene. The caller has checked its number of bytes.
fn unpack(image: &Image) -> Vec<[u8; 4]> {
    let components = usize::from(image.components).max(1);
    let count = image.width as usize * image.height as usize;
    let all = image.bytes.chunks_exact(components).take(count);
    match components {
        1 => all.map(|c| [c[0], c[0], c[0], 255]).collect(),
        2 => all.map(|c| [c[0], c[0], c[0], c[1]]).collect(),
        3 => all.map(|c| [c[0], c[1], c[2], 255]).collect(),
        _ => all.map(|c| [c[0], c[1], c[2], c[3]]).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: Repeat = Repeat {
        s: true,
        t: true,
        r: true,
    };

    fn two_by_one() -> Texture {
        Texture {
            width: 2,
            height: 1,
            texels: vec![[0, 0, 0, 255], [255, 255, 255, 255]].into(),
            components: 3,
            ..Texture::default()
        }
    }

    #[test]
    fn a_texture_is_exact_at_texel_centers_and_linear_between() {
        let t = two_by_one();
        let at = |s: f32| t.sample(Vec2::new(s, 0.5), Filter::Linear, Repeat::NONE).x;
        assert_eq!((at(0.25), at(0.5), at(0.75)), (0.0, 0.5, 1.0));
    }

    #[test]
    fn edges_repeat_or_are_clamped() {
        let t = two_by_one();
        assert_eq!(t.sample(Vec2::new(1.0, 0.5), Filter::Linear, ALL).x, 0.5);
        assert_eq!(
            t.sample(Vec2::new(1.0, 0.5), Filter::Linear, Repeat::NONE)
                .x,
            1.0
        );
        assert_eq!(
            t.sample(Vec2::new(-3.0, 0.5), Filter::Linear, Repeat::NONE)
                .x,
            0.0
        );
    }

    #[test]
    fn the_lowest_quality_is_not_interpolated() {
        let t = two_by_one();
        let at = |s: f32| {
            let at = Vec3::new(s, 0.5, 0.0);
            t.sample_deep(at, 9.0, Filter::of(0.1), ALL).x
        };
        let seen = [0.0, 0.49, 0.51, 0.99, 1.0, -0.2].map(at);
        assert_eq!(seen, [0.0, 0.0, 1.0, 1.0, 0.0, 1.0]);
    }

    #[test]
    fn a_3d_texture_is_interpolated_between_layers() {
        let layer = |level: u8| Texture {
            width: 1,
            height: 1,
            texels: vec![[level, level, level, 255]].into(),
            ..Texture::default()
        };
        let t = Texture {
            deeper: [51, 102, 255].map(layer).into(),
            ..layer(0)
        };
        let at = |r: f32, repeat: bool| {
            let at = Vec3::new(0.5, 0.5, r);
            t.sample_deep(
                at,
                0.0,
                Filter::Linear,
                if repeat { ALL } else { Repeat::NONE },
            )
            .x
        };
        assert_eq!(at(0.375, true), 0.2);
        assert!((at(0.5, true) - 0.3).abs() < 1e-6);
        assert_eq!((at(1.0, true), at(1.0, false)), (0.5, 1.0));
    }
}
