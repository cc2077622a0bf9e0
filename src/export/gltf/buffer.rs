//! The binary part of a file: lists of numbers, each with its view and its accessor.

use super::schema::{ARRAY_BUFFER, Accessor, BufferView, ELEMENT_ARRAY_BUFFER, Index};

/// The type of a component (5.1.3).
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;

/// Indices are 16 bits wide up to this number of vertices. The largest 16-bit number is reserved
/// (3.7.2.1).
const MOST_SHORT: usize = 65_535;

/// The bytes of a file's buffer, with their views and accessors.
#[derive(Debug, Default)]
pub(super) struct BinaryBuffer {
    pub bytes: Vec<u8>,
    pub views: Vec<BufferView>,
    pub accessors: Vec<Accessor>,
}

impl BinaryBuffer {
    /// Adds bytes, and returns their view. Every view begins at a multiple of 4.
    pub(super) fn view(&mut self, bytes: &[u8], target: Option<u32>) -> Index {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.push(BufferView {
            buffer: 0,
            byte_offset: self.bytes.len(),
            byte_length: bytes.len(),
            target,
        });
        self.bytes.extend_from_slice(bytes);
        self.views.len() - 1
    }

    fn accessor(&mut self, accessor: Accessor) -> Index {
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Adds a list of vectors for vertices.
    pub(super) fn vectors<const N: usize>(&mut self, list: &[[f32; N]]) -> Index {
        self.floats(list, Some(ARRAY_BUFFER), false)
    }

    /// Adds a list of positions, with their smallest and largest values.
    pub(super) fn positions(&mut self, list: &[[f32; 3]]) -> Index {
        self.floats(list, Some(ARRAY_BUFFER), true)
    }

    /// Adds a list of vectors, for animations or with `target` for vertices.
    pub(super) fn floats<const N: usize>(
        &mut self,
        list: &[[f32; N]],
        target: Option<u32>,
        bounded: bool,
    ) -> Index {
        let bytes: Vec<u8> = list
            .iter()
            .flatten()
            .flat_map(|v| v.to_le_bytes())
            .collect();
        let buffer_view = self.view(&bytes, target);
        let fold = |pick: fn(f32, f32) -> f32| -> Vec<f32> {
            let column = |i: usize| list.iter().map(move |v| v[i]).reduce(pick);
            (0..N).filter_map(column).collect()
        };
        let shape = match N {
            1 => "SCALAR",
            2 => "VEC2",
            3 => "VEC3",
            _ => "VEC4",
        };
        self.accessor(Accessor {
            buffer_view,
            component_type: FLOAT,
            normalized: false,
            count: list.len(),
            shape,
            min: if bounded { fold(f32::min) } else { Vec::new() },
            max: if bounded { fold(f32::max) } else { Vec::new() },
        })
    }

    /// Adds a list of colors with opacity, in linear light, as 16-bit fractions.
    pub(super) fn colors(&mut self, list: impl ExactSizeIterator<Item = [f32; 4]>) -> Index {
        let count = list.len();
        let level = |v: f32| (v.clamp(0.0, 1.0) * 65_535.0 + 0.5) as u16;
        let bytes: Vec<u8> = list
            .flat_map(|color| color.map(level))
            .flat_map(u16::to_le_bytes)
            .collect();
        let buffer_view = self.view(&bytes, Some(ARRAY_BUFFER));
        self.accessor(Accessor {
            buffer_view,
            component_type: UNSIGNED_SHORT,
            normalized: true,
            count,
            shape: "VEC4",
            min: Vec::new(),
            max: Vec::new(),
        })
    }

    /// Adds a list of indices of `vertices` vertices.
    pub(super) fn indices(&mut self, list: &[u32], vertices: usize) -> Index {
        let is_short = vertices <= MOST_SHORT;
        let bytes: Vec<u8> = if is_short {
            let short = list.iter().map(|&i| i as u16);
            short.flat_map(u16::to_le_bytes).collect()
        } else {
            list.iter().flat_map(|i| i.to_le_bytes()).collect()
        };
        let buffer_view = self.view(&bytes, Some(ELEMENT_ARRAY_BUFFER));
        self.accessor(Accessor {
            buffer_view,
            component_type: if is_short {
                UNSIGNED_SHORT
            } else {
                UNSIGNED_INT
            },
            normalized: false,
            count: list.len(),
            shape: "SCALAR",
            min: Vec::new(),
            max: Vec::new(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_begin_at_multiples_of_four_and_positions_have_their_bounds() {
        let mut buffer = BinaryBuffer::default();
        buffer.indices(&[0, 1, 2], 3);
        let positions = [[1.0, -2.0, 3.0], [-4.0, 5.0, 0.5]];
        let index = buffer.positions(&positions);
        assert_eq!(buffer.views[1].byte_offset, 8);
        assert_eq!(buffer.accessors[index].min, [-4.0, -2.0, 0.5]);
        assert_eq!(buffer.accessors[index].max, [1.0, 5.0, 3.0]);
        assert_eq!(buffer.bytes[8..12], 1f32.to_le_bytes());
    }

    #[test]
    fn indices_are_wide_if_a_vertex_has_the_reserved_number() {
        let mut buffer = BinaryBuffer::default();
        for (vertices, kind) in [(65_535, UNSIGNED_SHORT), (65_536, UNSIGNED_INT)] {
            let index = buffer.indices(&[vertices as u32 - 1], vertices);
            assert_eq!(buffer.accessors[index].component_type, kind);
        }
    }
}
