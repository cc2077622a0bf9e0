//! Textures: texels and filtering.

use std::sync::{Arc, OnceLock};

use glam::{Vec2, Vec3, Vec4};
use ivcam_inventor::grammar::value::Image;
use ivcam_inventor::traversal::state::AlphaMode;
use ivcam_optics::picture::{Raster, Samples};

use super::decode::{light, lights, mean_level};
use crate::scene::options::{ColorCoding, TextureFilter};

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
    texels: Texels,
    /// Smaller versions (mipmaps), each half as wide and high as the one before, made at the first
    /// use.
    smaller: OnceLock<Vec<Texture>>,
    /// The further layers of a `Texture3`.
    pub(super) deeper: Vec<Texture>,
    /// The number of components: 1 gray, 2 gray and alpha, 3 color, 4 color and alpha.
    pub components: usize,
    /// What the colors of its texels mean. Texels are filtered by their light.
    colors: ColorCoding,
}

/// The largest texture whose texels are unpacked, in texels. A texture of the memory that its file
/// needs takes up to 10% more of a picture's time, which only a large one is worth.
const MAX_UNPACKED: usize = 1 << 22;

/// Texels, row by row from the bottom.
#[derive(Debug)]
enum Texels {
    /// Red, green, blue and alpha of each.
    Unpacked(Vec<[u8; 4]>),
    /// The components of a file.
    Packed(Vec<u8>),
    /// The components of an image in the scene.
    OfScene(Arc<[u8]>),
}

impl Default for Texels {
    fn default() -> Self {
        Self::Unpacked(Vec::new())
    }
}

impl Texture {
    /// Makes a white texture with the given alpha values, row by row from the bottom.
    pub(crate) fn from_coverage(width: usize, height: usize, coverage: &[u8]) -> Self {
        Self::new(
            width,
            height,
            2,
            coverage.iter().flat_map(|&c| [255, c]).collect(),
        )
    }

    /// Returns the texture with another meaning of its colors.
    pub(super) fn with_colors(self, colors: ColorCoding) -> Self {
        let deeper = self.deeper.into_iter();
        Self {
            colors,
            deeper: deeper.map(|layer| layer.with_colors(colors)).collect(),
            ..self
        }
    }

    /// Makes a texture of its components, row by row from the bottom.
    fn new(width: usize, height: usize, components: usize, texels: Vec<u8>) -> Self {
        let texels = if width * height > MAX_UNPACKED {
            Texels::Packed(texels)
        } else {
            Texels::Unpacked(texels.chunks_exact(components.max(1)).map(rgba).collect())
        };
        Self {
            width,
            height,
            texels,
            components,
            ..Self::default()
        }
    }

    /// Makes a texture of the picture in a file. The memory of 8-bit samples is used as it is.
    pub(super) fn from_raster(raster: Raster) -> Self {
        let (width, height) = (raster.width as usize, raster.height as usize);
        let level = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
        let mut texels: Vec<u8> = match raster.samples {
            Samples::U8(samples) => samples,
            Samples::U16(samples) => {
                let level = |v: u16| level(f32::from(v) / 65_535.0);
                samples.into_iter().map(level).collect()
            }
            Samples::F32(samples) => samples.into_iter().map(level).collect(),
        };
        // Files have their rows from the top.
        let row = width * raster.channels;
        for y in 0..height / 2 {
            let (low, high) = texels.split_at_mut((height - 1 - y) * row);
            low[y * row..][..row].swap_with_slice(&mut high[..row]);
        }
        Self::new(width, height, raster.channels, texels)
    }

    /// Makes a texture of an image in the scene, whose memory a large one shares. Returns
    /// `None` if the image has too few bytes.
    pub(super) fn from_image(image: &Image) -> Option<Self> {
        let components = usize::from(image.components);
        let (width, height) = (image.width as usize, image.height as usize);
        let count = width.checked_mul(height)?;
        if image.bytes.len() < count.checked_mul(components)? || !(1..=4).contains(&components) {
            return None;
        }
        if count <= MAX_UNPACKED {
            let bytes = image.bytes[..count * components].to_vec();
            return Some(Self::new(width, height, components, bytes));
        }
        Some(Self {
            width,
            height,
            texels: Texels::OfScene(image.bytes.clone()),
            components,
            ..Self::default()
        })
    }

    /// The memory in bytes that the texture takes with its smaller versions. An image in the scene
    /// is that of the document.
    pub(in crate::scene) fn bytes(&self) -> u64 {
        let (components, _) = self.stored();
        let texels = (self.width * self.height * components) as u64;
        let own = match self.texels {
            Texels::OfScene(_) => 0,
            _ => texels,
        };
        let deeper: u64 = self.deeper.iter().map(Self::bytes).sum();
        own + texels / 3 + deeper
    }

    /// Returns the texture with another meaning of its opacity: without it, or with texels that are
    /// there or not.
    pub(in crate::scene) fn with_alpha(&self, mode: AlphaMode) -> Self {
        let (stored, texels) = self.stored();
        let components = match mode {
            AlphaMode::Opaque => self.components - 1,
            AlphaMode::Blend | AlphaMode::Mask(_) => self.components,
        };
        let texels = texels
            .chunks_exact(stored)
            .map(rgba)
            .flat_map(|[r, g, b, a]| {
                let a = match mode {
                    AlphaMode::Mask(cutoff) if f32::from(a) < 255.0 * cutoff => 0,
                    AlphaMode::Mask(_) | AlphaMode::Opaque => 255,
                    AlphaMode::Blend => a,
                };
                let all = match components {
                    1 | 2 => [r, a, 0, 0],
                    _ => [r, g, b, a],
                };
                all.into_iter().take(components)
            });
        Self::new(self.width, self.height, components, texels.collect()).with_colors(self.colors)
    }

    /// Returns the factors of roughness and of metal in glTF's texture of both: the root of the
    /// mean square of green, because the square is GGX's α, and the mean of blue.
    pub(in crate::scene) fn metallic_roughness(&self) -> [f32; 2] {
        let (mut squares, mut metals, mut count) = (0u64, 0u64, 0u64);
        for [_, green, blue, _] in self.rows().flatten() {
            squares += u64::from(green) * u64::from(green);
            metals += u64::from(blue);
            count += 1;
        }
        let mean = |sum: u64| sum as f64 / count.max(1) as f64;
        [
            (mean(squares).sqrt() / 255.0) as f32,
            (mean(metals) / 255.0) as f32,
        ]
    }

    /// Whether the texture has an alpha component.
    pub(crate) fn has_alpha(&self) -> bool {
        matches!(self.components, 2 | 4)
    }

    /// Whether the texture has color components, and not only gray ones.
    pub(crate) fn has_color(&self) -> bool {
        self.components >= 3
    }

    /// Returns the color at (s, t) in light, interpolated between texel centers.
    pub(crate) fn sample(&self, at: Vec2, filter: TextureFilter, repeat: Repeat) -> Vec4 {
        if self.is_empty() || !at.is_finite() {
            return Vec4::ONE;
        }
        let side = match filter {
            TextureFilter::Nearest => nearest,
            _ => between,
        };
        let (x0, x1, fx) = side(at.x, self.width, repeat.s);
        let (y0, y1, fy) = side(at.y, self.height, repeat.t);
        let (low, high) = (y0 * self.width, y1 * self.width);
        let places = [low + x0, low + x1, high + x0, high + x1];
        let [a, b, c, d] = match self.colors {
            ColorCoding::Levels | ColorCoding::Linear => self.four(places, color),
            ColorCoding::Display => {
                let lights = lights();
                self.four(places, |texel| light(lights, texel))
            }
        };
        let low = self.mix(a, b, fx);
        let high = self.mix(c, d, fx);
        self.mix(low, high, fy) / 255.0
    }

    /// Returns the colors of four texels by their indices.
    #[inline(always)]
    fn four(&self, places: [usize; 4], color: impl Fn([u8; 4]) -> Vec4) -> [Vec4; 4] {
        match &self.texels {
            Texels::Unpacked(texels) => {
                // `array::map` would be a call.
                let [a, b, c, d] = places;
                [
                    color(texels[a]),
                    color(texels[b]),
                    color(texels[c]),
                    color(texels[d]),
                ]
            }
            Texels::Packed(texels) => places.map(|i| color(packed(texels, self.components, i))),
            Texels::OfScene(texels) => places.map(|i| color(packed(texels, self.components, i))),
        }
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
        filter: TextureFilter,
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
            TextureFilter::Nearest => nearest,
            _ => between,
        };
        let (near, far, share) = side(at.z, self.depth(), repeat.r);
        self.mix(flat(near), flat(far), share)
    }

    /// Interpolates between two colors. A color counts by its alpha, so that a transparent texel
    /// gives no color to its neighbors.
    #[inline(always)]
    fn mix(&self, a: Vec4, b: Vec4, share: f32) -> Vec4 {
        if !self.has_alpha() || a.w == b.w {
            return a.lerp(b, share);
        }
        let alpha = a.w + share * (b.w - a.w);
        let weighted = a.truncate() * (a.w * (1.0 - share)) + b.truncate() * (b.w * share);
        (weighted / alpha.max(f32::MIN_POSITIVE)).extend(alpha)
    }

    /// Returns the color at (s, t) where a pixel covers `texels` texels across. It is interpolated
    /// between the versions whose texels are just smaller and just larger than the pixel, as by
    /// OpenGL's trilinear filter.
    pub(crate) fn sample_wide(
        &self,
        at: Vec2,
        texels: f32,
        filter: TextureFilter,
        repeat: Repeat,
    ) -> Vec4 {
        if filter != TextureFilter::Smooth || !(texels > 1.0) {
            return self.sample(at, filter, repeat);
        }
        let smaller = self.smaller();
        if smaller.is_empty() {
            return self.sample(at, filter, repeat);
        }
        let level = libm::log2f(texels).min(smaller.len() as f32);
        // Truncation is faster than `floor`, which is a call on processors without SSE 4.1.
        let below = level as u32 as f32;
        let version = |i: usize| match i {
            0 => self,
            _ => &smaller[i - 1],
        };
        let fine = version(below as usize).sample(at, filter, repeat);
        let next = (below as usize + 1).min(smaller.len());
        let coarse = version(next).sample(at, filter, repeat);
        self.mix(fine, coarse, level - below)
    }

    /// Whether there are no texels.
    fn is_empty(&self) -> bool {
        self.stored().1.is_empty()
    }

    /// The number of components of each texel as it is stored, and those of all texels.
    #[inline]
    fn stored(&self) -> (usize, &[u8]) {
        match &self.texels {
            Texels::Unpacked(texels) => (4, texels.as_flattened()),
            Texels::Packed(bytes) => (self.components, bytes),
            Texels::OfScene(bytes) => (self.components, bytes),
        }
    }

    /// The texels of each row as red, green, blue and alpha, from the bottom.
    pub(in crate::scene) fn rows(
        &self,
    ) -> impl DoubleEndedIterator<Item = impl Iterator<Item = [u8; 4]>> {
        let (components, texels) = self.stored();
        let rows = texels.chunks_exact((self.width * components).max(1));
        rows.take(self.height)
            .map(move |row| row.chunks_exact(components).map(rgba))
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
                if last.width <= 1 && last.height <= 1 || last.is_empty() {
                    return smaller;
                }
                let next = last.halved_layer();
                smaller.push(next);
            }
        })
    }

    /// The version with half the width and height, rounded up.
    pub(super) fn halved(&self) -> Self {
        Self {
            deeper: self.deeper.iter().map(Self::halved_layer).collect(),
            ..self.halved_layer()
        }
    }

    /// The version of the first layer with half the width and height, rounded up.
    fn halved_layer(&self) -> Self {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let (n, all) = self.stored();
        let mut texels = Vec::with_capacity(width * height * n);
        let row = |y: usize| {
            let y = y.min(self.height - 1);
            &all[y * self.width * n..(y + 1) * self.width * n]
        };
        for y in 0..height {
            let pairs = row(2 * y).chunks(2 * n).zip(row(2 * y + 1).chunks(2 * n));
            for (low, high) in pairs {
                // The last texel of an odd row is counted twice.
                let second = low.len() - n;
                let four = [&low[..n], &high[..n], &low[second..], &high[second..]];
                let alpha = self.has_alpha().then_some(n - 1);
                let mean = |i| {
                    let (levels, weights) = weighted(four, i, alpha.filter(|a| *a != i));
                    match self.colors {
                        ColorCoding::Display if alpha != Some(i) => mean_level(levels, weights),
                        _ => mean(levels, weights),
                    }
                };
                texels.extend((0..n).map(mean));
            }
        }
        Self {
            components: self.components,
            colors: self.colors,
            ..Self::new(width, height, n, texels)
        }
    }
}

/// Returns a component of four texels, and the weight of each: its component `weight`, or 1 if
/// there is none.
fn weighted(texels: [&[u8]; 4], component: usize, weight: Option<usize>) -> ([u8; 4], [u32; 4]) {
    let weight = |texel: &[u8]| weight.map_or(1, |weight| u32::from(texel[weight]));
    (texels.map(|texel| texel[component]), texels.map(weight))
}

/// Returns the rounded mean of four levels, each with its weight.
fn mean(levels: [u8; 4], weights: [u32; 4]) -> u8 {
    let all: u32 = weights.iter().sum();
    let parts = levels.into_iter().zip(weights);
    let sum: u32 = parts.map(|(level, w)| u32::from(level) * w).sum();
    ((sum + all / 2) / all.max(1)) as u8
}

/// Returns the color of a texel, from 0 to 255.
#[inline(always)]
fn color([r, g, b, a]: [u8; 4]) -> Vec4 {
    Vec4::new(r.into(), g.into(), b.into(), a.into())
}

/// Returns a texel of packed components by its index.
fn packed(texels: &[u8], components: usize, index: usize) -> [u8; 4] {
    rgba(&texels[index * components..][..components])
}

/// Returns a texel as red, green, blue and alpha.
#[inline(always)]
fn rgba(texel: &[u8]) -> [u8; 4] {
    match *texel {
        [gray] => [gray, gray, gray, 255],
        [gray, alpha] => [gray, gray, gray, alpha],
        [r, g, b] => [r, g, b, 255],
        [r, g, b, alpha, ..] => [r, g, b, alpha],
        [] => [255; 4],
    }
}

/// Returns the texel that contains a coordinate, in the form of [`between`].
fn nearest(at: f32, size: usize, repeat: bool) -> (usize, usize, f32) {
    let at = within_one(at, repeat);
    let x = ((at * size as f32) as usize).min(size - 1);
    (x, x, 0.0)
}

/// Returns the two texels around a coordinate, and its position between them from 0 to 1.
#[inline]
fn between(at: f32, size: usize, repeat: bool) -> (usize, usize, f32) {
    let x = within_one(at, repeat) * size as f32 - 0.5;
    // Truncated for the same reason as a level.
    let low = if x < 0.0 { -1.0 } else { x as u32 as f32 };
    let last = size - 1;
    let (first, next) = if x < 0.0 {
        (if repeat { last } else { 0 }, 0)
    } else {
        let first = (low as usize).min(last);
        let beyond = if repeat { 0 } else { last };
        (first, if first < last { first + 1 } else { beyond })
    };
    (first, next, x - low)
}

/// Returns a coordinate as a number from 0 to 1, by repeating or clamping the texture.
#[inline(always)]
fn within_one(at: f32, repeat: bool) -> f32 {
    if !repeat {
        return at.clamp(0.0, 1.0);
    }
    if at.abs() < 1e9 {
        let whole = at as i32 as f32;
        at - if whole > at { whole - 1.0 } else { whole }
    } else {
        at - at.floor()
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
        Texture::new(2, 1, 3, vec![0, 0, 0, 255, 255, 255])
    }

    #[test]
    fn a_texture_is_exact_at_texel_centers_and_linear_between() {
        let t = two_by_one();
        let at = |s: f32| {
            t.sample(Vec2::new(s, 0.5), TextureFilter::Linear, Repeat::NONE)
                .x
        };
        assert_eq!((at(0.25), at(0.5), at(0.75)), (0.0, 0.5, 1.0));
    }

    #[test]
    fn levels_of_a_display_are_filtered_by_their_light() {
        let checker = |colors| {
            let texels = (0..64).map(|i| 255 * ((i / 8 + i) % 2) as u8);
            Texture::new(8, 8, 1, texels.collect()).with_colors(colors)
        };
        for colors in [ColorCoding::Linear, ColorCoding::Display] {
            let texture = checker(colors);
            let at = |s: f32, texels: f32| {
                let at = Vec2::new(s, 0.0625);
                let seen = texture.sample_wide(at, texels, TextureFilter::Smooth, ALL);
                (seen.x, seen.w)
            };
            // A dark texel's center, and the edge between a dark and a bright one.
            assert_eq!((at(0.0625, 1.0), at(0.125, 1.0)), ((0.0, 1.0), (0.5, 1.0)));
            // From afar all of them are one, to half a level.
            assert!((at(0.3, 99.0).0 - 0.5).abs() < 0.004, "{:?}", at(0.3, 99.0));
        }
        let half = Texture::new(1, 1, 2, vec![128, 128]).with_colors(ColorCoding::Display);
        let seen = half.sample(Vec2::ZERO, TextureFilter::Linear, ALL);
        assert!((seen.x - 0.215_861).abs() < 1e-6 && seen.w == 128.0 / 255.0);
    }

    #[test]
    fn edges_repeat_or_are_clamped() {
        let t = two_by_one();
        assert_eq!(
            t.sample(Vec2::new(1.0, 0.5), TextureFilter::Linear, ALL).x,
            0.5
        );
        assert_eq!(
            t.sample(Vec2::new(1.0, 0.5), TextureFilter::Linear, Repeat::NONE)
                .x,
            1.0
        );
        assert_eq!(
            t.sample(Vec2::new(-3.0, 0.5), TextureFilter::Linear, Repeat::NONE)
                .x,
            0.0
        );
    }

    #[test]
    fn the_lowest_quality_is_not_interpolated() {
        let t = two_by_one();
        let at = |s: f32| {
            let at = Vec3::new(s, 0.5, 0.0);
            t.sample_deep(at, 9.0, TextureFilter::of(0.1), ALL).x
        };
        let seen = [0.0, 0.49, 0.51, 0.99, 1.0, -0.2].map(at);
        assert_eq!(seen, [0.0, 0.0, 1.0, 1.0, 0.0, 1.0]);
    }

    #[test]
    fn a_3d_texture_is_interpolated_between_layers() {
        let layer = |level: u8| Texture::new(1, 1, 1, vec![level]);
        let t = Texture {
            deeper: [51, 102, 255].map(layer).into(),
            ..layer(0)
        };
        let at = |r: f32, repeat: bool| {
            let at = Vec3::new(0.5, 0.5, r);
            t.sample_deep(
                at,
                0.0,
                TextureFilter::Linear,
                if repeat { ALL } else { Repeat::NONE },
            )
            .x
        };
        assert_eq!(at(0.375, true), 0.2);
        assert!((at(0.5, true) - 0.3).abs() < 1e-6);
        assert_eq!((at(1.0, true), at(1.0, false)), (0.5, 1.0));
    }

    #[test]
    fn textures_of_1_to_4_components_are_the_same_colors_in_fewer_bytes() {
        let colors = [[7, 7, 7, 255], [200, 200, 200, 255], [90, 90, 90, 255]];
        let of = |kept: &[usize]| {
            let texel = |c: &[u8; 4]| kept.iter().map(|&k| c[k]).collect::<Vec<u8>>();
            Texture::new(3, 1, kept.len(), colors.iter().flat_map(texel).collect())
        };
        let of = |kept: &[usize]| {
            let mut texture = of(kept);
            let bytes = colors.iter().flat_map(|c| kept.iter().map(|&k| c[k]));
            texture.texels = Texels::Packed(bytes.collect());
            texture
        };
        let all = [of(&[0]), of(&[0, 3]), of(&[0, 1, 2]), of(&[0, 1, 2, 3])];
        let unpacked = Texture::new(3, 1, 1, vec![7, 200, 90]);
        assert!(matches!(unpacked.texels, Texels::Unpacked(_)));
        for (x, texels) in [(0.1, 1.0), (0.4, 1.0), (0.7, 2.0), (0.9, 9.0)] {
            let at = Vec2::new(x, 0.5);
            let seen = all
                .each_ref()
                .map(|t| t.sample_wide(at, texels, TextureFilter::Smooth, ALL));
            let expected = unpacked.sample_wide(at, texels, TextureFilter::Smooth, ALL);
            assert_eq!(seen, [expected; 4]);
        }
        for texture in &all {
            assert!(texture.rows().flatten().eq(colors));
        }
        assert_eq!(all.each_ref().map(Texture::bytes), [4, 8, 12, 16]);
    }

    #[test]
    fn rows_of_a_file_are_turned_and_other_depths_become_8_bits() {
        let raster = |samples| Raster {
            width: 1,
            height: 3,
            channels: 1,
            samples,
        };
        let of = |samples| Texture::from_raster(raster(samples));
        let levels = |t: Texture| t.rows().flatten().map(|c| c[0]).collect::<Vec<u8>>();
        assert_eq!(levels(of(Samples::U8(vec![1, 2, 3]))), [3, 2, 1]);
        let sixteen = Samples::U16(vec![0, 257, 65_535]);
        assert_eq!(levels(of(sixteen)), [255, 1, 0]);
        assert_eq!(
            levels(of(Samples::F32(vec![-1.0, 0.5, 7.0]))),
            [255, 128, 0]
        );
    }
}
