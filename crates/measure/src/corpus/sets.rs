//! Compares sets of triangles in world space: corners within 1e-4 of the diagonal, then colors and
//! normals.

use std::collections::HashMap;
use std::io::Read;
use std::path::Path;

use glam::{DVec3, Vec3};
use ivcam_inventor::snapshot::Snapshot;
use ivcam_render::scene::{CompileOptions, OracleTriangle, RenderScene};

use super::Equal;

pub(super) fn compare_sets(
    (snapshot, options): (&Snapshot<'_>, &CompileOptions),
    file: &Path,
    diagonal: f64,
    equal: &mut Equal,
    notes: &mut Vec<String>,
) {
    let Some(theirs) = triangles(file) else {
        return;
    };
    let options = CompileOptions {
        origin: theirs.first().map_or(DVec3::ZERO, |t| t.position[0]),
        ignore_draw_style: true,
        ..options.clone()
    };
    let scene = match RenderScene::compile(snapshot, &options) {
        Ok(scene) => scene,
        Err(error) => {
            notes.push(error.message.clone());
            return;
        }
    };
    let ours: Vec<OracleTriangle> = scene.triangles().collect();
    let tolerance = 1e-4 * diagonal;
    let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    let cell = |p: DVec3| (p / (4.0 * tolerance)).floor().as_i64vec3();
    for (i, t) in theirs.iter().enumerate() {
        let key = cell(center(t)).to_array();
        cells.entry(key).or_default().push(i as u32);
    }
    let (mut missing, mut colors, mut normals) = (0, 0, 0);
    let mut first = None;
    for t in &ours {
        let at = cell(center(t));
        let mut best: Option<(f64, [i64; 3], usize)> = None;
        for dx in -1..=1 {
            for dy in -1..=1 {
                for dz in -1..=1 {
                    let key = [at.x + dx, at.y + dy, at.z + dz];
                    for (k, &i) in cells.get(&key).map_or(&[][..], |v| v).iter().enumerate() {
                        let other = &theirs[i as usize];
                        if let Some((turn, apart)) = same_corners(t, other, tolerance) {
                            // The nearest of several equal triangles is taken; triangles smaller
                            // than the tolerance would otherwise take each other's counterparts.
                            let score = 2.0 * f64::from(!same_colors(t, other, turn))
                                + f64::from(!same_normals(t, other, turn))
                                + 0.5 * apart / tolerance;
                            if best.is_none_or(|b| score < b.0) {
                                best = Some((score, key, k));
                            }
                        }
                    }
                }
            }
        }
        match best {
            Some((score, key, k)) => {
                colors += usize::from(score >= 2.0);
                normals += usize::from(score % 2.0 >= 1.0);
                if let Some(list) = cells.get_mut(&key) {
                    list.swap_remove(k);
                }
            }
            None => {
                missing += 1;
                first.get_or_insert(*t);
            }
        }
    }
    let left: usize = cells.values().map(Vec::len).sum();
    if missing == 0 && left == 0 {
        equal.sets += 1;
        equal.colors += usize::from(colors == 0);
    } else {
        notes.push(format!(
            "set: {missing} missing in the reference, {left} missing here"
        ));
        if let Some(t) = first {
            notes.push(format!("first {:?}", t.position.map(DVec3::as_vec3)));
        }
    }
    if colors > 0 {
        notes.push(format!("{colors} colors"));
    }
    if normals > 0 {
        notes.push(format!("{normals} normals of {}", ours.len()));
    }
}

fn center(t: &OracleTriangle) -> DVec3 {
    (t.position[0] + t.position[1] + t.position[2]) / 3.0
}

/// Returns the order of corners that brings the triangles nearest to each other, and the distance
/// of their corners then, if it is within the tolerance.
fn same_corners(a: &OracleTriangle, b: &OracleTriangle, tolerance: f64) -> Option<(usize, f64)> {
    let apart = |turn: usize| {
        let corner = |i: usize| a.position[i] - b.position[ORDERS[turn][i]];
        let each = [0, 1, 2].map(|i| corner(i).abs().max_element());
        each.into_iter().fold(0.0, f64::max)
    };
    let turns = (0..6).map(|turn| (turn, apart(turn)));
    turns
        .filter(|(_, apart)| *apart <= tolerance)
        .min_by(|a, b| a.1.total_cmp(&b.1))
}

const ORDERS: [[usize; 3]; 6] = [
    [0, 1, 2],
    [1, 2, 0],
    [2, 0, 1],
    [0, 2, 1],
    [2, 1, 0],
    [1, 0, 2],
];

fn same_colors(a: &OracleTriangle, b: &OracleTriangle, turn: usize) -> bool {
    (a.transparency - b.transparency).abs() < 0.005
        && (0..3).all(|i| {
            let d = a.diffuse[i] - b.diffuse[ORDERS[turn][i]];
            d.abs().max_element() < 0.005
        })
}

fn same_normals(a: &OracleTriangle, b: &OracleTriangle, turn: usize) -> bool {
    (0..3).all(|i| {
        let d = a.normal[i] - b.normal[ORDERS[turn][i]];
        d.abs().max_element() < 2e-3
    })
}

/// Reads a file of triangles: `TRI1`, a count, then 29 four-byte numbers per triangle,
/// little-endian.
fn triangles(file: &Path) -> Option<Vec<OracleTriangle>> {
    let packed = std::fs::File::open(file).ok()?;
    let mut bytes = Vec::new();
    flate2::read::GzDecoder::new(packed)
        .read_to_end(&mut bytes)
        .ok()?;
    let records = bytes.get(8..)?;
    let word = |r: &[u8], i: usize| [r[4 * i], r[4 * i + 1], r[4 * i + 2], r[4 * i + 3]];
    let triangle = |r: &[u8]| {
        let f = |i: usize| f32::from_le_bytes(word(r, i));
        let v = |i: usize| Vec3::new(f(i), f(i + 1), f(i + 2));
        OracleTriangle {
            position: [v(0).as_dvec3(), v(3).as_dvec3(), v(6).as_dvec3()],
            normal: [v(9), v(12), v(15)],
            diffuse: [v(18), v(21), v(24)],
            transparency: f(27),
        }
    };
    Some(records.chunks_exact(116).map(triangle).collect())
}
