//! The default values of fields, converted from the catalogue's constants.

use std::sync::OnceLock;

use super::catalogue::CLASSES;
use super::class_id::ClassId;
use super::field::Field;
use super::value::{Get, Value};

/// Returns the default of a class's field. The defaults of a class are created on first use.
pub(crate) fn default_value(class: ClassId, index: u16) -> &'static Value {
    static DEFAULTS: OnceLock<Vec<OnceLock<Vec<Value>>>> = OnceLock::new();
    let classes = DEFAULTS.get_or_init(|| CLASSES.iter().map(|_| OnceLock::new()).collect());
    let fields = classes[usize::from(class.0)]
        .get_or_init(|| class.get().fields.iter().map(Value::default_of).collect());
    &fields[usize::from(index)]
}

impl<T: Get + ?Sized> Field<T> {
    /// Returns the default that the catalogue states for the handle's class.
    pub fn default<'a>(self) -> T::Out<'a> {
        T::from_value(default_value(self.class, self.index))
            .expect("the catalogue's default has the catalogue's type")
    }
}
