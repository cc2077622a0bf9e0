//! Images of named channels, such as depth or a map of positions, as OpenEXR files.

use indexmap::IndexMap;

/// An image of any number of named channels, with rows from the top.
#[derive(Clone, Debug)]
pub struct ChannelImage {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// The values of each channel, row by row, by its name. A dot in a name ends the name of a
    /// layer, as in `N.X`.
    pub channels: IndexMap<String, Vec<f32>>,
    /// Keys and values that are written as attributes.
    pub provenance: IndexMap<String, String>,
}

impl ChannelImage {
    /// Adds channels with the values that a function gives for each pixel.
    pub fn add<const N: usize>(&mut self, names: [&str; N], values: impl Fn(usize) -> [f64; N]) {
        let pixels = self.width as usize * self.height as usize;
        let mut channels: [Vec<f32>; N] = std::array::from_fn(|_| Vec::with_capacity(pixels));
        for pixel in 0..pixels {
            for (channel, value) in channels.iter_mut().zip(values(pixel)) {
                channel.push(value as f32);
            }
        }
        let named = names.map(str::to_owned).into_iter().zip(channels);
        self.channels.extend(named);
    }
}

#[cfg(test)]
mod tests {
    use ::exr::prelude as exr;

    use super::*;

    fn image(values: Vec<f32>) -> ChannelImage {
        ChannelImage {
            width: 2,
            height: 1,
            channels: IndexMap::from([("Z".to_owned(), values), ("N.X".into(), vec![0.0, 1.0])]),
            provenance: IndexMap::from([("Unit".to_owned(), "µm · 長さ".to_owned())]),
        }
    }

    #[test]
    fn channels_keep_their_names_and_values() {
        let path = std::env::temp_dir().join(format!("ivcam-channels-{}.exr", std::process::id()));
        image(vec![3.5, 1e10]).save(&path).expect("written");
        let read = exr::read_first_flat_layer_from_file(&path).expect("read");
        std::fs::remove_file(&path).expect("removed");
        let list = read.layer_data.channel_data.list;
        let channel = |i: usize| -> (String, Vec<f32>) {
            (
                list[i].name.to_string(),
                list[i].sample_data.values_as_f32().collect(),
            )
        };
        let unit = read.layer_data.attributes.other.iter().next();
        let Some((_, exr::AttributeValue::Text(unit))) = unit else {
            panic!("no attribute")
        };
        assert_eq!(unit.as_slice(), "µm · 長さ".as_bytes());
        assert_eq!(channel(0), ("N.X".to_owned(), vec![0.0, 1.0]));
        assert_eq!(channel(1), ("Z".to_owned(), vec![3.5, 1e10]));
    }

    #[test]
    fn a_channel_of_another_size_is_an_error() {
        let path = std::env::temp_dir().join(format!("ivcam-short-{}.exr", std::process::id()));
        assert!(image(vec![1.0]).save(&path).is_err());
        assert!(!path.exists());
    }
}
