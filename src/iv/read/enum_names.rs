//! The names of the values that an enumeration or a bit mask has.

/// The names of an enumeration's values, and how names of older versions are read.
#[derive(Clone, Copy, Debug)]
pub(super) struct EnumNames {
    pub names: &'static [(&'static str, i64)],
    pub old: fn(&str) -> Option<i64>,
}

impl PartialEq for EnumNames {
    fn eq(&self, other: &Self) -> bool {
        self.names == other.names
    }
}

impl EnumNames {
    /// For the values of fields that have no names.
    pub(super) const NONE: Self = Self {
        names: &[],
        old: |_| None,
    };

    /// The value of a name: as it is spelled, else in other case, else of an older version.
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

    /// The message for a name that is none of them.
    pub(super) fn unknown(self, name: &str) -> String {
        let all: Vec<&str> = self.names.iter().map(|(n, _)| *n).collect();
        match crate::diag::nearest(name, all.iter().copied()) {
            Some(near) => format!("`{name}` is not one of its values; did you mean `{near}`?"),
            None => format!(
                "`{name}` is not one of its values, which are {}",
                all.join(", ")
            ),
        }
    }
}
