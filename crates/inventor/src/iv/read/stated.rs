//! The places of a node's stated fields, which are found in constant time if there are many.

use std::collections::HashMap;

use crate::iv::document::FieldEntry;

/// The number of fields up to which they are compared one by one.
const FEW: usize = 16;

/// The place of each stated field of a node by its index, if there are more than [`FEW`].
#[derive(Default)]
pub(super) struct StatedPlaces {
    places: HashMap<u16, usize>,
    /// The number of fields whose places are known.
    known: usize,
}

impl StatedPlaces {
    /// Returns the place of the field with an index among the stated fields of the node.
    pub(super) fn place(&mut self, fields: &[FieldEntry], index: u16) -> Option<usize> {
        if fields.len() <= FEW {
            return fields.iter().position(|field| field.index == index);
        }
        if self.known > fields.len() {
            *self = Self::default(); // A field was removed.
        }
        for (place, field) in fields.iter().enumerate().skip(self.known) {
            self.places.entry(field.index).or_insert(place);
        }
        self.known = fields.len();
        self.places.get(&index).copied()
    }
}
