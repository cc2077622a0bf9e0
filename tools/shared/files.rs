//! Reads meshes and rays that another program has written.

use std::path::Path;

use crate::bvh::Ray;
use glam::Vec3;

use super::mesh::Rays;

/// Reads a mesh: counts of corners and triangles, corners as three f32, triangles as three u32,
/// little-endian.
pub(crate) fn read(file: &Path) -> std::io::Result<Vec<[Vec3; 3]>> {
    let bytes = std::fs::read(file)?;
    let words: Vec<[u8; 4]> = bytes.as_chunks().0.to_vec();
    let count = u32::from_le_bytes(words[0]) as usize;
    let (corners, triangles) = words[2..].split_at(3 * count);
    let number = |k: usize| f32::from_le_bytes(corners[k]);
    let corner = |word: [u8; 4]| {
        let k = 3 * u32::from_le_bytes(word) as usize;
        Vec3::new(number(k), number(k + 1), number(k + 2))
    };
    let all = triangles.as_chunks::<3>().0;
    Ok(all.iter().map(|t| t.map(corner)).collect())
}

/// Reads rays from the files with a common prefix: origin, direction and greatest distance, seven
/// f32 each.
pub(crate) fn read_rays(prefix: &str) -> std::io::Result<Vec<Rays>> {
    let kinds = [("primary", false), ("shadow", true), ("bounce", false)];
    let set = |(name, any): (&'static str, bool)| {
        let bytes = std::fs::read(format!("{prefix}.{name}.rays"))?;
        let words: Vec<f32> = bytes
            .as_chunks()
            .0
            .iter()
            .map(|w| f32::from_le_bytes(*w))
            .collect();
        let ray = |w: &[f32; 7]| {
            let mut ray = Ray::new(Vec3::new(w[0], w[1], w[2]), Vec3::new(w[3], w[4], w[5]));
            ray.t_max = w[6];
            ray
        };
        let rays = words.as_chunks().0.iter().map(ray).collect();
        Ok(Rays { name, any, rays })
    };
    kinds.into_iter().map(set).collect()
}
