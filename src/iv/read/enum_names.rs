//! The names of the values that an enumeration or a bit mask has.

/// Named values of an enumeration or a bit mask, and how names that are gone are read.
#[derive(Clone, Copy)]
pub struct Names<'n> {
    pub names: &'n [(&'static str, i64)],
    pub old: fn(&str) -> Option<i64>,
}

impl Names<'_> {
    pub fn value(self, name: &str) -> Option<i64> {
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

    pub fn unknown(self, name: &str) -> String {
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
