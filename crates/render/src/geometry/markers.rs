//! The bitmaps of markers, which are 5, 7 or 9 pixels wide and high.
//!
//! Inventor specifies the names and the sizes of the markers. The pixels are ivcam's own: they lie
//! along lines that were designed after the names.

use glam::Vec2;

/// The lines of the markers in a square from −1 to 1, in Inventor's order (reference page of
/// SoMarkerSet): ten line markers, then ten outlines. In Inventor's order the outlines follow
/// again, filled.
const MARKERS: [&[&[(f32, f32)]]; 20] = {
    const CIRCLE: &[(f32, f32)] = &[
        (1.0, -0.3),
        (1.0, 0.3),
        (0.3, 1.0),
        (-0.3, 1.0),
        (-1.0, 0.3),
        (-1.0, -0.3),
        (-0.3, -1.0),
        (0.3, -1.0),
        (1.0, -0.3),
    ];
    const SQUARE: &[(f32, f32)] = &[
        (-1.0, -1.0),
        (1.0, -1.0),
        (1.0, 1.0),
        (-1.0, 1.0),
        (-1.0, -1.0),
    ];
    const DIAMOND: &[(f32, f32)] = &[
        (0.0, -1.0),
        (1.0, 0.0),
        (0.0, 1.0),
        (-1.0, 0.0),
        (0.0, -1.0),
    ];
    const TRIANGLE: &[(f32, f32)] = &[(-1.0, -1.0), (1.0, -1.0), (0.0, 1.0), (-1.0, -1.0)];
    const RHOMBUS: &[(f32, f32)] = &[
        (-1.0, -0.5),
        (0.5, -0.5),
        (1.0, 0.5),
        (-0.5, 0.5),
        (-1.0, -0.5),
    ];
    const DOWN: &[(f32, f32)] = &[(-1.0, 1.0), (0.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    const SLASH: &[(f32, f32)] = &[(-1.0, -1.0), (1.0, 1.0)];
    const BACKSLASH: &[(f32, f32)] = &[(-1.0, 1.0), (1.0, -1.0)];
    const MINUS: &[(f32, f32)] = &[(-1.0, 0.0), (1.0, 0.0)];
    const BAR: &[(f32, f32)] = &[(0.0, -1.0), (0.0, 1.0)];
    [
        &[SLASH, BACKSLASH],
        &[MINUS, BAR],
        &[MINUS],
        &[SLASH],
        &[BACKSLASH],
        &[BAR],
        &[SLASH, BACKSLASH, MINUS, BAR],
        &[
            &[(-1.0, 1.0), (0.0, 0.0), (1.0, 1.0)],
            &[(0.0, 0.0), (0.0, -1.0)],
        ],
        &[&[(0.5, 1.0), (-0.5, 0.0), (0.5, 0.0), (-0.5, -1.0)]],
        &[
            // The derrick of an oil well.
            &[(-1.0, -1.0), (0.0, 1.0), (1.0, -1.0)],
            &[(-0.5, -0.4), (0.5, -0.4)],
        ],
        &[CIRCLE],
        &[SQUARE],
        &[DIAMOND],
        &[TRIANGLE],
        &[RHOMBUS],
        &[
            &[(-1.0, 1.0), (0.0, 0.0), (1.0, 1.0), (-1.0, 1.0)],
            &[(-1.0, -1.0), (1.0, -1.0), (0.0, 0.0), (-1.0, -1.0)],
        ],
        &[
            &[
                (-0.5, -0.5),
                (0.5, -0.5),
                (0.5, 0.5),
                (-0.5, 0.5),
                (-0.5, -0.5),
            ],
            &[(0.5, 0.5), (1.0, 1.0)],
            &[(-0.5, 0.5), (-1.0, 1.0)],
            &[(-0.5, -0.5), (-1.0, -1.0)],
            &[(0.5, -0.5), (1.0, -1.0)],
        ],
        &[
            &[(-1.0, 0.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)],
            &[(0.0, 0.0), (0.0, -1.0)],
        ],
        &[DOWN],
        &[
            &[
                (-0.5, -1.0),
                (0.5, -1.0),
                (1.0, 0.0),
                (-1.0, 0.0),
                (-0.5, -1.0),
            ],
            &[(0.0, 0.0), (0.0, 1.0)],
        ],
    ]
};

/// The pixels of a marker.
pub(crate) struct MarkerBitmap {
    /// The width and height in pixels: 5, 7 or 9.
    pub side: usize,
    /// Whether each pixel is set, row by row from the bottom up.
    pub pixels: Vec<bool>,
}

/// Returns the marker with an index. There are 90: 30 in each of three sizes.
pub(crate) fn marker_bitmap(index: usize) -> MarkerBitmap {
    let side = 5 + 2 * (index / 30).min(2);
    let kind = index % 30;
    let filled = kind >= 20;
    let kind = if kind < 20 { kind } else { kind - 10 };
    MarkerBitmap {
        side,
        pixels: bitmap(kind, filled, side),
    }
}

/// Draws the lines of a marker, and fills its outlines if `filled` is set.
fn bitmap(kind: usize, filled: bool, side: usize) -> Vec<bool> {
    let half = 0.5 * (side - 1) as f32;
    // Halves are rounded toward the center, so that markers are symmetric.
    let whole = |p: Vec2| (0.9999 * p).round();
    let place = |&(x, y): &(f32, f32)| whole(Vec2::new(x, y) * half);
    let mut pixels = vec![false; side * side];
    let mut set = |p: Vec2| {
        let p = whole(p) + half;
        let (x, y) = (p.x as usize, p.y as usize);
        if x < side && y < side {
            pixels[y * side + x] = true;
        }
    };
    for line in MARKERS[kind] {
        let points: Vec<Vec2> = line.iter().map(place).collect();
        for pair in points.windows(2) {
            let along = pair[1] - pair[0];
            let steps = along.abs().max_element().ceil().max(1.0);
            (0..=steps as usize).for_each(|i| set(pair[0] + along * (i as f32 / steps)));
        }
        if filled && line.len() > 3 {
            let all =
                (0..side * side).map(|i| Vec2::new((i % side) as f32, (i / side) as f32) - half);
            all.filter(|p| is_inside(*p, &points)).for_each(&mut set);
        }
    }
    pixels
}

/// Whether a point is in a polygon, by the parity of the number of edges to its right.
fn is_inside(p: Vec2, polygon: &[Vec2]) -> bool {
    let crossed = |pair: &&[Vec2]| {
        let (a, b) = (pair[0], pair[1]);
        (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x)
    };
    polygon.windows(2).filter(crossed).count() % 2 == 1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(kind: usize, filled: bool, side: usize) -> Vec<String> {
        let pixels = bitmap(kind, filled, side);
        let row = |row: &[bool]| row.iter().map(|&p| if p { '#' } else { '.' }).collect();
        pixels.chunks_exact(side).rev().map(row).collect()
    }

    #[test]
    fn markers_look_like_their_names() {
        let cross = ["#...#", ".#.#.", "..#..", ".#.#.", "#...#"];
        let plus = ["..#..", "..#..", "#####", "..#..", "..#.."];
        let circle = [".###.", "#...#", "#...#", "#...#", ".###."];
        let disc = [".###.", "#####", "#####", "#####", ".###."];
        let triangle = ["..#..", "..#..", ".###.", ".###.", "#####"];
        assert_eq!(drawn(0, false, 5), cross);
        assert_eq!(drawn(1, false, 5), plus);
        assert_eq!(drawn(10, false, 5), circle);
        assert_eq!(drawn(10, true, 5), disc);
        assert_eq!(drawn(13, true, 5), triangle);
    }

    #[test]
    fn every_marker_is_drawn_in_every_size() {
        for kind in 0..20 {
            for side in [5, 7, 9] {
                let sign = drawn(kind, kind >= 10, side);
                let inked = sign.concat().matches('#').count();
                assert!((side..=side * side).contains(&inked), "{kind} {side}");
            }
        }
    }
}
