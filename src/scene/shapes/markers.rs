//! Markers: signs of 5, 7 or 9 pixels a side, on whole pixels.
//!
//! Inventor states the signs' names and sizes; the pixels are ours, set along lines that are drawn
//! after the names.

use glam::{DMat4, DVec2, Vec2, Vec3};

use super::quad;
use super::screen_aligned::facing;
use crate::geometry::Corner;
use crate::scene::Builder;

/// Lines of markers, on a square from −1 to 1, by Inventor's numbering (SoMarkerSet's reference page):
/// ten signs, then ten outlines. The same ten filled follow. Drawn after their names.
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

/// The pixels of a sign, row by row from the bottom up.
fn bitmap(kind: usize, filled: bool, side: usize) -> Vec<bool> {
    let half = 0.5 * (side - 1) as f32;
    // Halves go toward the middle, so that signs are even.
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

/// By the edges to the right of a point.
fn is_inside(p: Vec2, polygon: &[Vec2]) -> bool {
    let crossed = |pair: &&[Vec2]| {
        let (a, b) = (pair[0], pair[1]);
        (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x)
    };
    polygon.windows(2).filter(crossed).count() % 2 == 1
}

/// A marker at a corner: 5, 7 or 9 pixels a side (90 shapes, 30 a size), its middle the pixel of the
/// point; none for a negative index.
pub fn marker(corner: Corner, index: i32, world_from_object: DMat4, out: &mut Builder<'_>) {
    let Ok(index) = usize::try_from(index) else {
        return;
    };
    let side = 5 + 2 * (index / 30).min(2);
    let kind = index % 30;
    let (kind, filled) = (if kind < 20 { kind } else { kind - 10 }, kind >= 20);
    let at = world_from_object.transform_point3(corner.position.as_dvec3());
    let Some(screen) = out.screen() else {
        return out.dot(corner, side as f32);
    };
    let Some(point) = screen.project(at) else {
        return;
    };
    let middle = DVec2::new(0.0, 0.5 * f64::from(out.pixel_rows() % 2));
    let low = (point + middle).floor() - middle - point - (side / 2) as f64;
    let pixels = bitmap(kind, filled, side);
    facing(at, out, |out| {
        for (y, row) in pixels.chunks_exact(side).enumerate() {
            let mut from = 0;
            for run in row.chunk_by(|a, b| a == b) {
                if run[0] {
                    let low = low.as_vec2() + Vec2::new(from as f32, y as f32);
                    strip(corner, low, run.len() as f32, out);
                }
                from += run.len();
            }
        }
    });
}

/// Pixels of a row.
fn strip(corner: Corner, low: Vec2, length: f32, out: &mut Builder<'_>) {
    let at = |x: f32, y: f32| Corner {
        position: Vec3::new(low.x + x, low.y + y, 0.0),
        normal: Vec3::Z,
        ..corner
    };
    let corners = [at(0.0, 0.0), at(length, 0.0), at(length, 1.0), at(0.0, 1.0)];
    quad(corners, out);
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
    fn the_signs_are_what_their_names_say() {
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
    fn every_sign_is_drawn_in_every_size() {
        for kind in 0..20 {
            for side in [5, 7, 9] {
                let sign = drawn(kind, kind >= 10, side);
                let inked = sign.concat().matches('#').count();
                assert!((side..=side * side).contains(&inked), "{kind} {side}");
            }
        }
    }
}
