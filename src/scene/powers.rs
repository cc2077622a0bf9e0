//! Textures with sides that are powers of two, which the OpenGL of the old libraries asked for.
//!
//! The rule and the filter are Coin's (measured, single texels through its resampling): the next
//! power of two, halved again where it is 256 or more and more than an eighth too long; both sides
//! through a bell three texels wide, though only one of them need change.

use super::texture::Texture;

/// The length that a side gets.
fn fitting(size: usize) -> usize {
    let power = size.next_power_of_two();
    if power >= 256 && power - size > power / 8 {
        power / 2
    } else {
        power
    }
}

/// The texture with sides that are powers of two; as it is where they are.
pub fn in_powers_of_two(texture: Texture) -> Texture {
    if texture.is_deep() {
        return deep(texture);
    }
    let (width, height) = (fitting(texture.width), fitting(texture.height));
    let fits = (width, height) == (texture.width, texture.height);
    if fits || texture.width * texture.height == 0 {
        return texture;
    }
    let (across, up) = (shares(texture.width, width), shares(texture.height, height));
    let mut wide = Vec::with_capacity(width * texture.height);
    for row in texture.texels().chunks_exact(texture.width) {
        wide.extend(across.iter().map(|s| mixed(s, |i| row[i])));
    }
    let mut texels = Vec::with_capacity(width * height);
    for rows in &up {
        texels.extend((0..width).map(|x| mixed(rows, |i| wide[i * width + x])));
    }
    texture.resized(width, height, vec![texels])
}

/// Pictures behind one another repeat texels to fill their sides, their number too (measured).
fn deep(texture: Texture) -> Texture {
    let old = [texture.width, texture.height, texture.depth()];
    let new = old.map(usize::next_power_of_two);
    if new == old || old.contains(&0) {
        return texture;
    }
    let from = |i: usize, axis: usize| i * old[axis] / new[axis];
    let layers: Vec<&Texture> = texture.layers().collect();
    if layers.iter().any(|l| l.texels().len() != old[0] * old[1]) {
        return texture;
    }
    let layer = |z: usize| {
        let texels = layers[from(z, 2)].texels();
        let row = |y: usize| (0..new[0]).map(move |x| texels[from(y, 1) * old[0] + from(x, 0)]);
        (0..new[1]).flat_map(row).collect()
    };
    let layers = (0..new[2]).map(layer).collect();
    texture.resized(new[0], new[1], layers)
}

/// For every new texel the old ones that it is mixed from; what lies outside is mirrored.
fn shares(old: usize, new: usize) -> Vec<Vec<(usize, f32)>> {
    let scale = new as f32 / old as f32;
    let (spread, weight) = if scale < 1.0 {
        (1.0 / scale, scale)
    } else {
        (1.0, 1.0)
    };
    let n = old as i64;
    let inside = |j: i64| {
        let j = if j < 0 { -j } else { j };
        let j = if j >= n { 2 * n - 1 - j } else { j };
        j.clamp(0, n - 1) as usize
    };
    let of = |i: usize| {
        let center = i as f32 / scale;
        let from = (center - 1.5 * spread).ceil() as i64;
        let to = (center + 1.5 * spread).floor() as i64;
        let share = |j: i64| (inside(j), weight * bell((center - j as f32) / spread));
        (from..=to).map(share).collect()
    };
    (0..new).map(of).collect()
}

/// The box filter put through itself twice.
fn bell(x: f32) -> f32 {
    match x.abs() {
        x if x < 0.5 => 0.75 - x * x,
        x if x < 1.5 => 0.5 * (x - 1.5) * (x - 1.5),
        _ => 0.0,
    }
}

fn mixed(shares: &[(usize, f32)], texel: impl Fn(usize) -> [u8; 4]) -> [u8; 4] {
    let mut sum = [0.0; 4];
    for &(i, share) in shares {
        for (sum, level) in sum.iter_mut().zip(texel(i)) {
            *sum += share * f32::from(level);
        }
    }
    sum.map(|v: f32| v.clamp(0.0, 255.0) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_become_the_power_of_two_that_coin_takes() {
        let sizes = [1, 3, 4, 200, 230, 256, 300, 500].map(fitting);
        assert_eq!(sizes, [1, 4, 4, 128, 256, 256, 256, 512]);
    }

    /// Measured: Coin draws 0x20, 0x20, 0x40, 0x60, 0x80, 0x80, 0xa0, 0xc0 of six levels.
    #[test]
    fn pictures_behind_one_another_repeat_texels_as_in_coin() {
        let levels = [0x20, 0x40, 0x60, 0x80, 0xa0, 0xc0].map(|l| [l, l, l, 255]);
        let layers = vec![levels.to_vec(); 3];
        let deep = in_powers_of_two(Texture::default().resized(6, 1, layers));
        assert_eq!((deep.width, deep.height, deep.depth()), (8, 1, 4));
        let seen = [0x20, 0x20, 0x40, 0x60, 0x80, 0x80, 0xa0, 0xc0];
        for layer in deep.layers() {
            assert_eq!(
                layer.texels().iter().map(|t| t[0]).collect::<Vec<_>>(),
                seen
            );
        }
    }

    /// Measured: the four texels that Coin makes of each of three.
    #[test]
    fn three_texels_become_four_as_in_coin() {
        let all = shares(3, 4);
        let seen = [[191, 71, 0, 0], [63, 175, 127, 7], [0, 7, 127, 247]];
        for (lit, seen) in seen.iter().enumerate() {
            let texel = |i: usize| if i == lit { [255; 4] } else { [0; 4] };
            let ours: Vec<u8> = all.iter().map(|s| mixed(s, texel)[0]).collect();
            assert_eq!(&ours, seen);
        }
    }
}
