//! The bytes of a file's buffers, and the numbers of its accessors.

use std::borrow::Cow;

use ivcam_base::diag::{Result, Span, excerpt};
use ivcam_base::work;

use super::schema::{Accessor, Root};
use crate::iv::data_uri;
use crate::iv::limits::cut_at;
use crate::iv::read::assemble::Assembler;

/// The buffers of a file. One that cannot be read is empty.
pub(super) struct Buffers<'b> {
    list: Vec<Cow<'b, [u8]>>,
}

/// What is wrong with an accessor.
pub(super) type Wrong = String;

/// The largest number of components of an accessor without bytes, whose elements are 0. Other
/// accessors have no more than the bytes of the file.
const MOST_ZEROS: usize = 1 << 24;

/// The extensions that compress parts of a file.
const COMPRESSION: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

impl<'b> Buffers<'b> {
    /// Reads all buffers. `chunk` is the binary part of a GLB file.
    ///
    /// # Errors
    /// Returns an error if a limit is exceeded.
    pub(super) fn read(
        asm: &mut Assembler<'_>,
        root: &Root,
        chunk: Option<&'b [u8]>,
    ) -> Result<Self> {
        let mut list = Vec::with_capacity(root.buffers.len());
        for (number, buffer) in root.buffers.iter().enumerate() {
            let bytes = match &buffer.uri {
                None if number == 0 && chunk.is_some() => Ok(Cow::Borrowed(chunk.unwrap_or(&[]))),
                None => match COMPRESSION
                    .iter()
                    .any(|name| buffer.extensions.contains_key(*name))
                {
                    true => Ok(Cow::Borrowed(&[][..])),
                    false => Err(format!("buffer {number} has neither a URI nor a chunk")),
                },
                Some(uri) => load(asm, uri)?.map(Cow::Owned),
            };
            let bytes = bytes.unwrap_or_else(|message| {
                let sink = &mut asm.document.sink;
                sink.damage(Span::at(0), message)
                    .help("what needs it is left out");
                Cow::Borrowed(&[])
            });
            if !bytes.is_empty() && bytes.len() < buffer.byte_length {
                let (has, wants) = (bytes.len(), buffer.byte_length);
                let message = format!("buffer {number} has {has} bytes instead of {wants}");
                asm.document.sink.damage(Span::at(0), message);
            }
            list.push(bytes);
        }
        Ok(Self { list })
    }

    /// Returns the bytes of a view of a buffer, and the stride that it states.
    pub(super) fn view(
        &self,
        root: &Root,
        index: usize,
    ) -> std::result::Result<(&[u8], Option<usize>), Wrong> {
        let missing = || format!("the buffer view {index} does not exist");
        let view = root.buffer_views.get(index).ok_or_else(missing)?;
        if let Some(name) = COMPRESSION
            .iter()
            .find(|name| view.extensions.contains_key(**name))
        {
            return Err(format!("data that are compressed by {name} are not read"));
        }
        let buffer = self.list.get(view.buffer).ok_or_else(missing)?;
        let end = view.byte_offset.checked_add(view.byte_length);
        let bytes = end.and_then(|end| buffer.get(view.byte_offset..end));
        let bytes = bytes.ok_or_else(|| format!("the buffer view {index} is beyond its buffer"))?;
        Ok((bytes, view.byte_stride))
    }

    /// Returns the numbers of an accessor with so many components in each element. Normalized
    /// integers become fractions.
    pub(super) fn floats(
        &self,
        root: &Root,
        index: usize,
        widths: &[usize],
    ) -> std::result::Result<(Vec<f32>, usize), Wrong> {
        let accessor = accessor(root, index)?;
        let scale = match accessor.normalized {
            true => component(accessor.component_type)?.1,
            false => 1.0,
        };
        let width = width(accessor)?;
        if !widths.contains(&width) {
            return Err(format!(
                "the accessor {index} has elements of {width} numbers"
            ));
        }
        let mut list = self.elements(root, accessor, width)?;
        for number in &mut list {
            *number = (*number * scale).max(if accessor.normalized { -1.0 } else { f64::MIN });
        }
        Ok((list.into_iter().map(|n| n as f32).collect(), width))
    }

    /// Returns the integers of an accessor with one component.
    pub(super) fn integers(
        &self,
        root: &Root,
        index: usize,
        width: usize,
    ) -> std::result::Result<Vec<u32>, Wrong> {
        let accessor = accessor(root, index)?;
        if self::width(accessor)? != width || accessor.component_type == 5126 {
            return Err(format!(
                "the accessor {index} does not have {width} integers"
            ));
        }
        let list = self.elements(root, accessor, width)?;
        Ok(list.into_iter().map(|n| n as u32).collect())
    }

    /// Returns the numbers of an accessor as the file has them.
    fn elements(
        &self,
        root: &Root,
        accessor: &Accessor,
        width: usize,
    ) -> std::result::Result<Vec<f64>, Wrong> {
        let total = accessor
            .count
            .checked_mul(width)
            .filter(|total| *total <= 1 << 30);
        let total = total.ok_or("an accessor has too many elements")?;
        let cut = |_| Wrong::from("the account of the scene is used up");
        work::spend(total as u64 * 4 + 10).map_err(cut)?;
        work::spend_bytes(total as u64 * 8).map_err(cut)?;
        let kind = component(accessor.component_type)?.0;
        let mut list = match accessor.buffer_view {
            Some(view) => {
                let (bytes, stride) = self.view(root, view)?;
                numbers(
                    bytes,
                    accessor.byte_offset,
                    stride,
                    kind,
                    [accessor.count, width],
                )?
            }
            None if total > MOST_ZEROS => return Err("an accessor has too many zeros".into()),
            None => vec![0.0; total],
        };
        if let Some(sparse) = &accessor.sparse {
            let (bytes, _) = self.view(root, sparse.indices.buffer_view)?;
            let kind_of_index = component(sparse.indices.component_type)?.0;
            let at = sparse.indices.byte_offset;
            let places = numbers(bytes, at, None, kind_of_index, [sparse.count, 1])?;
            let (bytes, _) = self.view(root, sparse.values.buffer_view)?;
            let at = sparse.values.byte_offset;
            let values = numbers(bytes, at, None, kind, [sparse.count, width])?;
            for (place, value) in places.iter().zip(values.chunks_exact(width)) {
                let start = *place as usize * width;
                if let Some(element) = list.get_mut(start..start + width) {
                    element.copy_from_slice(value);
                }
            }
        }
        Ok(list)
    }
}

/// Loads the file of a URI.
fn load(asm: &mut Assembler<'_>, uri: &str) -> Result<std::result::Result<Vec<u8>, Wrong>> {
    let document = &mut *asm.document;
    let loaded = match data_uri::is_data(uri) {
        true => data_uri::decoded(uri),
        false => {
            let from = document.sources[usize::from(asm.source)].name.clone();
            let path = String::from_utf8_lossy(&data_uri::percent(uri.as_bytes())).into_owned();
            match &document.loader {
                Some(loader) => loader.load(&from, &path),
                None => return Ok(Err("the document has no loader".into())),
            }
        }
    };
    let loaded = loaded
        .map(|(_, bytes)| bytes)
        .map_err(|error| error.message.clone());
    let steps = loaded.as_ref().map_or(0, |bytes| bytes.len() as u64 / 64);
    work::spend(steps).map_err(|cut| cut_at(&document.sink, Span::at(0), cut))?;
    Ok(loaded)
}

fn accessor(root: &Root, index: usize) -> std::result::Result<&Accessor, Wrong> {
    let missing = || format!("the accessor {index} does not exist");
    root.accessors.get(index).ok_or_else(missing)
}

/// The type of a component.
#[derive(Clone, Copy)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

/// Returns a type by its number in OpenGL, and the factor of a normalized value.
fn component(code: u32) -> std::result::Result<(Component, f64), Wrong> {
    Ok(match code {
        5120 => (Component::I8, 1.0 / 127.0),
        5121 => (Component::U8, 1.0 / 255.0),
        5122 => (Component::I16, 1.0 / 32767.0),
        5123 => (Component::U16, 1.0 / 65535.0),
        5125 => (Component::U32, 1.0 / 4_294_967_295.0),
        5126 => (Component::F32, 1.0),
        _ => return Err(format!("{code} is no type of components")),
    })
}

/// Returns the number of components of an element.
fn width(accessor: &Accessor) -> std::result::Result<usize, Wrong> {
    Ok(match &*accessor.kind {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" => 4,
        "MAT4" => 16,
        kind => {
            let kind = excerpt(kind);
            return Err(format!("accessors of the type `{kind}` are not read"));
        }
    })
}

/// Returns the numbers of elements in some bytes.
fn numbers(
    bytes: &[u8],
    offset: usize,
    stride: Option<usize>,
    kind: Component,
    [count, width]: [usize; 2],
) -> std::result::Result<Vec<f64>, Wrong> {
    let size = match kind {
        Component::I8 | Component::U8 => 1,
        Component::I16 | Component::U16 => 2,
        Component::U32 | Component::F32 => 4,
    };
    let element = size * width;
    let stride = stride.filter(|stride| *stride > 0).unwrap_or(element);
    let last = count
        .checked_sub(1)
        .map(|n| n.saturating_mul(stride).saturating_add(element));
    let end = offset.saturating_add(last.unwrap_or(0));
    if end > bytes.len() {
        return Err("an accessor is beyond its buffer view".into());
    }
    let mut out = Vec::with_capacity(count * width);
    for place in 0..count {
        let at = offset + place * stride;
        for raw in bytes[at..at + element].chunks_exact(size) {
            let mut four = [0u8; 4];
            four[..size].copy_from_slice(raw);
            let bits = u32::from_le_bytes(four);
            out.push(match kind {
                Component::I8 => f64::from(bits as u8 as i8),
                Component::I16 => f64::from(bits as u16 as i16),
                Component::U8 | Component::U16 | Component::U32 => f64::from(bits),
                Component::F32 => f64::from(f32::from_bits(bits)),
            });
        }
    }
    Ok(out)
}
