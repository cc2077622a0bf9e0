//! How much a file draws.

use indexmap::IndexMap;
use ivcam_base::diag::counted;

/// Classes of shapes that are drawn exactly and have no triangles.
const ROUND: [&str; 3] = ["Sphere", "Cone", "Cylinder"];

/// Returns the number of shapes that are drawn exactly and so have no triangles: spheres, cones and
/// cylinders. `shapes` are the numbers of shapes by class, as of a survey.
pub fn round_solids<'a>(shapes: impl IntoIterator<Item = (&'a str, u64)>) -> u64 {
    let round = shapes
        .into_iter()
        .filter(|(class, _)| ROUND.contains(class));
    round.map(|(_, count)| count).sum()
}

/// Returns the number of round solids, as `1 round solid`, or `None` if there are none.
pub(super) fn round_text(shapes: &IndexMap<&'static str, u64>) -> Option<String> {
    let round = round_solids(shapes.iter().map(|(class, count)| (*class, *count)));
    (round > 0).then(|| counted(round as usize, "round solid"))
}

/// Returns what is drawn: `12 triangles`, `1 round solid`, or both. Round solids have no triangles.
pub(super) fn drawn_text(triangles: u64, shapes: &IndexMap<&'static str, u64>) -> String {
    let flat = counted(triangles as usize, "triangle");
    match (round_text(shapes), triangles) {
        (Some(round), 0) => round,
        (Some(round), _) => format!("{round}, {flat}"),
        (None, _) => flat,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn round_solids_are_counted_beside_triangles() {
        let drawn = |triangles, shapes: &[(&'static str, u64)]| {
            drawn_text(triangles, &shapes.iter().copied().collect())
        };
        assert_eq!(drawn(0, &[]), "0 triangles");
        assert_eq!(drawn(0, &[("Sphere", 1)]), "1 round solid");
        let both = drawn(12, &[("Cone", 1), ("Cylinder", 2), ("Cube", 1)]);
        assert_eq!(both, "3 round solids, 12 triangles");
    }
}
