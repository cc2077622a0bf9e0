//! The values of the binary formats.
use std::sync::Arc;

use glam::{Mat4, Vec2, Vec3, Vec4};

use super::assemble::Slot;
use super::binary::{Reader, Step};
use crate::diag::Span;
use crate::grammar::FieldType;
use crate::grammar::value::{Image, NodeId, Plane, Rotation, Value};

impl Reader<'_, '_, '_> {
    fn float(&mut self) -> Step<f32> {
        self.word().map(f32::from_bits)
    }

    fn floats<const N: usize>(&mut self) -> Step<[f32; N]> {
        let mut out = [0.0; N];
        for n in &mut out {
            *n = self.float()?;
        }
        Ok(out)
    }

    fn rotation(&mut self) -> Step<Rotation> {
        let [x, y, z, angle] = self.floats()?;
        Ok(Rotation {
            axis: Vec3::new(x, y, z),
            angle,
        })
    }

    fn plane(&mut self) -> Step<Plane> {
        let [x, y, z, distance] = self.floats()?;
        Ok(Plane {
            normal: Vec3::new(x, y, z),
            distance,
        })
    }

    fn named(&mut self, node: NodeId, slot: Slot) -> Step<i32> {
        let start = self.at;
        let name = self.string()?;
        let names = self.asm.names_of(node, slot);
        match names.value(&name).or_else(|| name.parse().ok()) {
            Some(v) => Ok(v as i32),
            None => {
                let message = names.unknown(&name);
                self.asm.document.sink.warn(Span::at(start), message);
                Ok(0)
            }
        }
    }

    fn bit_mask(&mut self, node: NodeId, slot: Slot) -> Step<i32> {
        let mut bits = 0;
        loop {
            if self.rest().starts_with(&[0; 4]) {
                self.at += 4;
                return Ok(bits);
            }
            bits |= self.named(node, slot)?;
        }
    }

    fn image(&mut self, solid: bool) -> Step<Image> {
        let (width, height) = (self.word()?, self.word()?);
        let depth = if solid { self.word()? } else { 1 };
        let components = self.word()?;
        if components > 4 {
            return self.wrong(format!("a pixel has 0 to 4 components, not {components}"));
        }
        let pixels = [width, height, depth]
            .iter()
            .try_fold(1u64, |n, &k| n.checked_mul(u64::from(k)));
        let count = pixels
            .and_then(|n| n.checked_mul(u64::from(components)))
            .unwrap_or(u64::MAX);
        let bytes: Arc<[u8]> = if self.asm.header.version >= (2, 1) {
            Arc::from(self.take(usize::try_from(count).unwrap_or(usize::MAX))?)
        } else if count == 0 {
            Arc::from([])
        } else {
            // A word a pixel, as in ASCII.
            let words = pixels.and_then(|n| n.checked_mul(4)).unwrap_or(u64::MAX);
            let words = self.take(usize::try_from(words).unwrap_or(usize::MAX))?;
            match components {
                1 => pixels_of::<1>(words),
                2 => pixels_of::<2>(words),
                3 => pixels_of::<3>(words),
                _ => pixels_of::<4>(words),
            }
        };
        Ok(Image {
            width,
            height,
            depth,
            components: components as u8,
            bytes,
        })
    }

    pub(super) fn many<T>(
        &mut self,
        size: usize,
        one: impl Fn(&mut Self) -> Step<T>,
    ) -> Step<Vec<T>> {
        let count = self.count(size)?;
        (0..count).map(|_| one(self)).collect()
    }

    /// Values of a fixed number of words, all at once.
    fn bulk<const N: usize, T>(&mut self, one: impl Fn([u32; N]) -> T) -> Step<Vec<T>> {
        let count = self.count(4 * N)?;
        let tuple = |bytes: &[u8]| {
            let word = |i: usize| u32::from_be_bytes(std::array::from_fn(|k| bytes[4 * i + k]));
            one(std::array::from_fn(word))
        };
        Ok(self
            .take(4 * N * count)?
            .chunks_exact(4 * N)
            .map(tuple)
            .collect())
    }

    pub(super) fn value(&mut self, node: NodeId, slot: Slot) -> Step<Value> {
        use FieldType as F;
        let kind = self.asm.written_as(node, slot);
        Ok(match kind {
            F::SFBool => Value::Bool(self.word()? != 0),
            F::SFInt32 | F::SFShort => Value::Int(self.word()? as i32),
            F::SFUInt32 | F::SFUShort => Value::UInt(self.word()?),
            F::SFFloat => Value::Float(self.float()?),
            F::SFDouble | F::SFTime => Value::Double(self.double()?),
            F::SFString | F::SFName => Value::String(self.string()?.into()),
            F::SFEnum => Value::Int(self.named(node, slot)?),
            F::SFBitMask => Value::Int(self.bit_mask(node, slot)?),
            F::SFVec2f => Value::Vec2(Vec2::from_array(self.floats()?)),
            F::SFVec3f | F::SFColor => Value::Vec3(Vec3::from_array(self.floats()?)),
            F::SFVec4f => Value::Vec4(Vec4::from_array(self.floats()?)),
            F::SFVec2s | F::SFVec2i32 | F::SFVec3i32 | F::SFVec4i32 => {
                let ints = (0..kind.width()).map(|_| self.word().map(|n| n as i32));
                Value::Ints(ints.collect::<Step<_>>()?)
            }
            F::SFVec3d => Value::Doubles(vec![self.double()?, self.double()?, self.double()?]),
            F::SFRotation => Value::Rotation(self.rotation()?),
            F::SFMatrix => Value::Matrix(Box::new(Mat4::from_cols_array(&self.floats()?))),
            F::SFPlane => Value::Plane(self.plane()?),
            F::SFImage => Value::Image(Box::new(self.image(false)?)),
            F::SFImage3 => Value::Image(Box::new(self.image(true)?)),
            F::SFNode | F::SFPath | F::SFEngine => Value::Node(None),
            F::MFNode => Value::Nodes(Vec::new()),
            F::SFTrigger => Value::Trigger,
            F::MFBool => Value::Bools(self.many(4, |r| r.word().map(|n| n != 0))?),
            F::MFInt32 | F::MFShort => Value::Ints(self.bulk(|[n]| n as i32)?),
            F::MFEnum => Value::Ints(self.many(4, |r| r.named(node, slot))?),
            F::MFUInt32 | F::MFUShort => Value::UInts(self.bulk(|[n]| n)?),
            F::MFFloat => Value::Floats(self.bulk(|[n]| f32::from_bits(n))?),
            F::MFDouble | F::MFTime => Value::Doubles(self.many(8, Self::double)?),
            F::MFString | F::MFName => Value::Strings(self.many(4, Self::string)?),
            F::MFVec2f => {
                Value::Vec2s(self.bulk(|w: [u32; 2]| Vec2::from_array(w.map(f32::from_bits)))?)
            }
            F::MFVec3f | F::MFColor => {
                Value::Vec3s(self.bulk(|w: [u32; 3]| Vec3::from_array(w.map(f32::from_bits)))?)
            }
            F::MFVec4f => {
                Value::Vec4s(self.bulk(|w: [u32; 4]| Vec4::from_array(w.map(f32::from_bits)))?)
            }
            F::MFVec2i32 | F::MFVec3i32 | F::MFVec4i32 => {
                let count = self.count(4 * kind.width())? * kind.width();
                Value::Ints(
                    (0..count)
                        .map(|_| self.word().map(|n| n as i32))
                        .collect::<Step<_>>()?,
                )
            }
            F::MFVec3d => {
                let count = self.count(24)? * 3;
                Value::Doubles((0..count).map(|_| self.double()).collect::<Step<_>>()?)
            }
            F::MFRotation => Value::Rotations(self.many(16, Self::rotation)?),
            F::MFMatrix => {
                Value::Matrices(self.many(64, |r| r.floats().map(|m| Mat4::from_cols_array(&m)))?)
            }
            F::MFPlane => Value::Planes(self.many(16, Self::plane)?),
        })
    }
}

/// The last bytes of words, so many of each.
fn pixels_of<const N: usize>(words: &[u8]) -> Arc<[u8]> {
    let words = words.chunks_exact(4);
    let pixels = words.map(|w| std::array::from_fn(|i| w[4 - N + i]));
    pixels.collect::<Vec<[u8; N]>>().into_flattened().into()
}
