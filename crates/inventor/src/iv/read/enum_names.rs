//! The names of the values of an enumeration or a bit mask.

use ivcam_base::diag::{excerpt, nearest};

/// The names of an enumeration's values, in the current and in older versions of the format.
#[derive(Clone, Copy, Debug)]
pub(super) struct EnumNames {
    /// The current names with their values.
    pub names: &'static [(&'static str, i64)],
    /// Returns the value of a name that only older versions have.
    pub old: fn(&str) -> Option<i64>,
}

impl PartialEq for EnumNames {
    fn eq(&self, other: &Self) -> bool {
        self.names == other.names
    }
}

impl EnumNames {
    /// No names, for fields of other types.
    pub(super) const NONE: Self = Self {
        names: &[],
        old: |_| None,
    };

    /// Returns the value of a name. An exact match comes first, then one that differs in case, then
    /// a name of an older version.
    pub(super) fn value(self, name: &str) -> Option<i64> {
        let exact = self.names.iter().find(|(n, _)| *n == name);
        let loose = || {
            self.names
                .iter()
                .find(|(n, _)| n.eq_ignore_ascii_case(name))
        };
        exact
            .or_else(loose)
            .map(|(_, v)| *v)
            .or_else(|| (self.old)(name))
    }

    /// Returns the message for an unknown name.
    pub(super) fn unknown(self, name: &str) -> String {
        let all: Vec<&str> = self.names.iter().map(|(n, _)| *n).collect();
        let near = nearest(name, all.iter().copied());
        let name = excerpt(name);
        match near {
            Some(near) => format!("`{name}` is not one of its values; did you mean `{near}`?"),
            None => format!(
                "`{name}` is not one of its values, which are {}",
                all.join(", ")
            ),
        }
    }
}
