//! The fields of a class that a file declares, which are found by name in constant time.

use std::collections::HashMap;
use std::ops::Deref;

use crate::grammar::FieldType;

/// The number of fields up to which they are compared one by one.
const FEW: usize = 16;

/// The name and type of each field of a class, in the order of declaration.
#[derive(Clone, Debug, Default)]
pub struct DeclaredFields {
    list: Vec<(Box<str>, FieldType)>,
    /// The place of each field in the list, if there are more than [`FEW`].
    places: HashMap<Box<str>, usize>,
}

impl DeclaredFields {
    /// Adds a field, unless there is one with this name.
    pub fn add(&mut self, name: Box<str>, kind: FieldType) {
        if self.place(&name).is_some() {
            return;
        }
        self.list.push((name, kind));
        let new = match self.list.len() {
            ..=FEW => return,
            count if self.places.is_empty() => 0..count,
            count => count - 1..count,
        };
        let named = |place: usize| (self.list[place].0.clone(), place);
        self.places.extend(new.map(named));
    }

    /// Returns the place of a field.
    pub fn place(&self, name: &str) -> Option<usize> {
        match self.list.len() {
            ..=FEW => self.list.iter().position(|(known, _)| **known == *name),
            _ => self.places.get(name).copied(),
        }
    }
}

impl FromIterator<(Box<str>, FieldType)> for DeclaredFields {
    fn from_iter<I: IntoIterator<Item = (Box<str>, FieldType)>>(fields: I) -> Self {
        let mut all = Self::default();
        fields
            .into_iter()
            .for_each(|(name, kind)| all.add(name, kind));
        all
    }
}

impl Deref for DeclaredFields {
    type Target = [(Box<str>, FieldType)];

    fn deref(&self) -> &Self::Target {
        &self.list
    }
}

impl PartialEq for DeclaredFields {
    fn eq(&self, other: &Self) -> bool {
        self.list == other.list
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_field_is_found_among_few_and_among_many() {
        let mut fields = DeclaredFields::default();
        for number in 0..40 {
            fields.add(format!("f{number}").into(), FieldType::SFFloat);
            fields.add("f0".into(), FieldType::SFBool);
            for known in 0..=number {
                assert_eq!(fields.place(&format!("f{known}")), Some(known));
            }
            assert_eq!(fields.place("g"), None);
        }
        assert_eq!((fields.len(), fields[0].1), (40, FieldType::SFFloat));
    }
}
