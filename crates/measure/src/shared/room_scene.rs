//! A room made by formulas: a tiled table with spheres, a cord and crumbs, and a shelf of books.
//!
//! The areas of its triangles span nine decades, from the crumbs to the walls. Lengths are in
//! meters, and +y is up.

use std::fmt::Write as _;
use std::path::PathBuf;

use glam::{DMat3, DQuat, DVec3};
use ivcam_optics::sampling::{mix, unit};

use super::pictures::saved;

const EYE: DVec3 = DVec3::new(0.55, 0.95, 1.35);
const LOOKED_AT: DVec3 = DVec3::new(0.0, 0.45, 0.0);
/// The height of the tiles' upper faces.
const TABLE: f64 = 0.4225;

/// Writes the scene file and returns its path.
pub(crate) fn write() -> Option<PathBuf> {
    let back = (EYE - LOOKED_AT).normalize();
    let right = DVec3::Y.cross(back).normalize();
    let turn = DQuat::from_mat3(&DMat3::from_cols(right, back.cross(right), back));
    let (axis, angle) = turn.to_axis_angle();
    let mut text = format!(
        "#Inventor V2.1 ascii\nPerspectiveCamera {{ position {} {} {} orientation {} {} {} {angle} }}\n\
         ShapeHints {{ vertexOrdering COUNTERCLOCKWISE creaseAngle 0 }}\n\
         Environment {{ ambientIntensity 0 attenuation 1 0 0 }}\n\
         PointLight {{ location -.9 2.3 .9 }}\n",
        EYE.x, EYE.y, EYE.z, axis.x, axis.y, axis.z
    );
    parts().iter().for_each(|part| part.write(&mut text));
    saved("room.iv", &text)
}

/// Uniform random numbers.
struct Random(u64);

impl Random {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 += 1;
        low + (high - low) * unit(mix(self.0))
    }
}

/// Triangles of one color.
struct Part {
    color: [f64; 3],
    points: Vec<DVec3>,
    triangles: Vec<[usize; 3]>,
}

impl Part {
    fn new(color: [f64; 3]) -> Self {
        Self {
            color,
            points: Vec::new(),
            triangles: Vec::new(),
        }
    }

    /// Adds the two triangles of a quadrilateral. A triangle that has no area, such as one at the
    /// pole of a sphere, is left out.
    fn quad(&mut self, [a, b, c, d]: [usize; 4]) {
        for triangle in [[a, b, c], [a, c, d]] {
            let [p, q, r] = triangle.map(|k| self.points[k]);
            if (q - p).cross(r - p).length() > 1e-12 {
                self.triangles.push(triangle);
            }
        }
    }

    /// Adds a tube through closed rings of `around` points each, and returns the number of its
    /// first point.
    fn tube(&mut self, around: usize, points: impl Iterator<Item = DVec3>) -> usize {
        let first = self.points.len();
        self.points.extend(points);
        for a in first..self.points.len() - around {
            let last = (a - first) % around == around - 1;
            let b = if last { a + 1 - around } else { a + 1 };
            self.quad([a, b, b + around, a + around]);
        }
        first
    }

    /// Adds a box.
    fn cuboid(&mut self, low: [f64; 3], high: [f64; 3]) {
        let corners = [
            (low[0], low[2]),
            (high[0], low[2]),
            (high[0], high[2]),
            (low[0], high[2]),
        ];
        let ring = |y: f64| corners.map(|(x, z)| DVec3::new(x, y, z));
        let first = self.tube(4, [ring(low[1]), ring(high[1])].into_iter().flatten());
        for at in [first, first + 4] {
            self.quad([at, at + 1, at + 2, at + 3]);
        }
    }

    /// Adds a sphere of `rows` by `columns` quadrilaterals.
    fn sphere(&mut self, center: [f64; 3], radius: f64, rows: usize, columns: usize) {
        let point = |k: usize| {
            let down = std::f64::consts::PI * (k / columns) as f64 / rows as f64;
            let along = std::f64::consts::TAU * (k % columns) as f64 / columns as f64;
            let ((s, y), (z, x)) = (libm::sincos(down), libm::sincos(along));
            DVec3::from(center) + radius * DVec3::new(s * x, y, s * z)
        };
        self.tube(columns, (0..(rows + 1) * columns).map(point));
    }

    /// Adds a tile with a rounded upper edge, at the middle of its lower face.
    fn tile(&mut self, x: f64, z: f64, width: f64, height: f64) {
        const ROUNDING: f64 = 0.0012;
        let ring = |half: f64, y: f64| {
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                .map(|(i, k)| DVec3::new(x + i * half, y, z + k * half))
        };
        let rounded = |step: u32| {
            let (s, c) = libm::sincos(f64::from(step) * std::f64::consts::FRAC_PI_6);
            let half = 0.5 * width - ROUNDING * (1.0 - c);
            ring(half, 0.4 + height - ROUNDING * (1.0 - s))
        };
        let below = ring(0.5 * width, 0.4);
        let rings = std::iter::once(below).chain((0..4).map(rounded));
        let first = self.tube(4, rings.flatten());
        self.quad([16, 17, 18, 19].map(|k| first + k));
    }

    /// Adds the part's nodes to a scene.
    fn write(&self, text: &mut String) {
        let [r, g, b] = self.color;
        let _ = writeln!(
            text,
            "Separator {{ Material {{ ambientColor 0 0 0 diffuseColor {r} {g} {b} }}\n\
             Coordinate3 {{ point ["
        );
        for p in self.points.iter().map(|p| p.as_vec3()) {
            let _ = writeln!(text, "{} {} {},", p.x, p.y, p.z);
        }
        text.push_str("] }\nIndexedFaceSet { coordIndex [\n");
        for [a, b, c] in &self.triangles {
            let _ = writeln!(text, "{a},{b},{c},-1,");
        }
        text.push_str("] } }\n");
    }
}

fn parts() -> Vec<Part> {
    let mut random = Random(0);
    let mut walls = Part::new([0.7, 0.68, 0.62]);
    walls.cuboid([-3.0, 0.0, -2.5], [3.0, 2.8, 2.5]);
    let mut all = vec![walls, wood()];
    all.extend(books(&mut random));
    all.extend(tiles(&mut random));
    all.push(spheres(&mut random));
    all.extend(small_things(&mut random));
    all
}

/// Returns the table without its tiles, and the shelf without its books.
fn wood() -> Part {
    let mut wood = Part::new([0.42, 0.26, 0.14]);
    wood.cuboid([-0.62, 0.38, -0.42], [0.62, 0.4, 0.42]);
    for (x, z) in [(-0.58, -0.38), (0.58, -0.38), (0.58, 0.38), (-0.58, 0.38)] {
        wood.cuboid([x - 0.025, 0.0, z - 0.025], [x + 0.025, 0.38, z + 0.025]);
    }
    for board in 0..6 {
        let y = 0.05 + 0.35 * f64::from(board);
        wood.cuboid([1.5, y, -2.48], [2.9, y + 0.02, -2.1]);
    }
    for x in [1.48, 2.9] {
        wood.cuboid([x, 0.0, -2.48], [x + 0.02, 1.9, -2.1]);
    }
    wood
}

/// Returns the books of two colors.
fn books(random: &mut Random) -> [Part; 2] {
    let mut books = [Part::new([0.45, 0.1, 0.08]), Part::new([0.1, 0.18, 0.4])];
    for board in 0..5 {
        let y = 0.07 + 0.35 * f64::from(board);
        let mut x = 1.51;
        while x < 2.85 {
            let [width, height, depth] =
                [(0.008, 0.05), (0.18, 0.31), (0.15, 0.3)].map(|(a, b)| random.between(a, b));
            let book = &mut books[usize::from(random.between(0.0, 1.0) < 0.5)];
            let high = [x + width - 0.001, y + height, -2.46 + depth];
            book.cuboid([x, y, -2.46], high);
            x += width;
        }
    }
    books[0].cuboid([0.22, TABLE, -0.18], [0.44, 0.465, 0.12]);
    books
}

/// Returns the tiles of two colors, 36 by 24.
fn tiles(random: &mut Random) -> [Part; 2] {
    const SIZE: f64 = 1.2 / 36.0;
    let mut tiles = [Part::new([0.2, 0.3, 0.34]), Part::new([0.75, 0.73, 0.68])];
    for (i, k) in (0..36).flat_map(|i| (0..24).map(move |k| (i, k))) {
        let [x, z] = [(i, 0.6), (k, 0.4)].map(|(n, half)| SIZE * (n as f64 + 0.5) - half);
        let height = 0.022 + random.between(-2e-4, 2e-4);
        tiles[(i + k) % 2].tile(x, z, 0.94 * SIZE, height);
    }
    tiles
}

fn spheres(random: &mut Random) -> Part {
    let mut spheres = Part::new([0.6, 0.55, 0.25]);
    spheres.sphere([-0.25, TABLE + 0.09, -0.05], 0.09, 120, 160);
    spheres.sphere([0.02, TABLE + 0.05, -0.2], 0.05, 60, 80);
    spheres.sphere([-1.8, 0.45, -1.6], 0.45, 50, 80);
    for _ in 0..40 {
        let radius = random.between(0.004, 0.012);
        let [x, z] = [(-0.55, 0.55), (0.12, 0.38)].map(|(a, b)| random.between(a, b));
        spheres.sphere([x, TABLE + radius, z], radius, 10, 16);
    }
    spheres
}

/// Returns a telephone with its coiled cord, and crumbs.
fn small_things(random: &mut Random) -> [Part; 2] {
    let mut phone = Part::new([0.06, 0.06, 0.06]);
    phone.cuboid([-0.05, TABLE, 0.05], [0.12, 0.47, 0.2]);
    phone.cuboid([-0.09, 0.5, 0.105], [0.16, 0.53, 0.145]);
    let cord = |k: usize| {
        let ((s, c), across) = (
            libm::sincos((k / 6) as f64 * 0.09),
            (k % 6) as f64 * std::f64::consts::FRAC_PI_3,
        );
        let radius = 0.006 + 0.0016 * libm::cos(across);
        let x = 0.17 + 5e-5 * (k / 6) as f64 + 0.0016 * libm::sin(across);
        DVec3::new(x, TABLE + 0.0095 + radius * s, 0.14 + radius * c)
    };
    phone.tube(6, (0..6 * 1950).map(cord));
    let mut crumbs = Part::new([0.5, 0.35, 0.2]);
    for _ in 0..300 {
        let size = random.between(1.5e-4, 6e-4);
        let [x, z] = [(-0.5, 0.5), (-0.3, 0.3)].map(|(a, b)| random.between(a, b));
        crumbs.cuboid([x, TABLE, z], [x + size, TABLE + size, z + size]);
    }
    [phone, crumbs]
}
