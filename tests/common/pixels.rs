//! The values of pictures, without what their metadata says of their making.

use std::path::Path;

/// Returns the values of all channels of an EXR file, by name.
pub fn pixels(path: &Path) -> Vec<(String, Vec<f32>)> {
    let read = exr::prelude::read_first_flat_layer_from_file(path).expect("a picture");
    let channels = read.layer_data.channel_data.list.iter();
    let channel = |c: &exr::prelude::AnyChannel<exr::prelude::FlatSamples>| {
        (c.name.to_string(), c.sample_data.values_as_f32().collect())
    };
    channels.map(channel).collect()
}
