//! The plain difference of two compared pictures, as a picture file.

use std::path::Path;

use indexmap::IndexMap;
use ivcam_base::diag::{Diagnostic, Result};
use ivcam_optics::film::Response;
use ivcam_optics::picture::{Depth, Picture, PictureFormat};

use ivcam_compare::Comparison;

/// The level of 16 bits that stands for no difference, and those from it to a difference of 1.
const MIDDLE: f32 = 32_768.0;
const STEPS: f32 = 32_767.0;

/// Checks that a difference can be written in the format of a file name.
///
/// # Errors
/// Fails if the ending is neither .exr nor .png.
pub(crate) fn format_of(name: &Path) -> Result<PictureFormat> {
    match PictureFormat::of(name) {
        Ok(format @ (PictureFormat::Exr | PictureFormat::Png)) => Ok(format),
        _ => {
            let name = name.display();
            let text = format!("a difference has signs, and `{name}` cannot hold them");
            let help = "end its name in .exr for numbers, or in .png for levels around gray";
            Err(Diagnostic::unsupported(text).with_help(help))
        }
    }
}

/// Writes the new picture minus the old one, whose tones are matched, on the new one's pixels.
///
/// An EXR has the differences; pixels that do not count are NaN. A PNG has 16 bits: a difference d
/// from -1 to 1 is the level 32768 + 32767·d, so that gray is none; pixels that do not count are
/// black, which no difference is.
///
/// # Errors
/// Fails if the format cannot hold a difference, or if the file cannot be written.
pub(crate) fn write(comparison: &Comparison, command: &str, path: &Path) -> Result<()> {
    let is_exr = format_of(path)? == PictureFormat::Exr;
    let difference = |i: usize| {
        let (new, old) = (comparison.new.color(i), comparison.old.color(i));
        let counts = comparison.mask.counts[i];
        [0, 1, 2].map(|c| match (counts, is_exr) {
            (true, true) => new[c] - old[c],
            (true, false) => (MIDDLE + STEPS * (new[c] - old[c]).clamp(-1.0, 1.0)) / 65_535.0,
            (false, true) => f32::NAN,
            (false, false) => 0.0,
        })
    };
    let picture = Picture {
        width: comparison.width as u32,
        height: comparison.height as u32,
        pixels: (0..comparison.width * comparison.height)
            .map(difference)
            .collect(),
        response: Response::Linear,
        provenance: provenance(command),
    };
    picture.save(path, Depth::Sixteen)
}

/// Returns what a picture says about itself that is made of others: program and command.
pub(crate) fn provenance(command: &str) -> IndexMap<String, String> {
    let version = concat!("ivcam ", env!("CARGO_PKG_VERSION"));
    [("Software", version), ("Command", command)]
        .map(|(key, value)| (key.to_owned(), value.to_owned()))
        .into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use ivcam_compare::{Mask, Matching, Options, Plane, Plate, compare};
    use ivcam_optics::picture::{Raster, Samples};

    /// Returns a new picture, a brighter and darker old one, and a mask without the last pixel.
    fn comparison() -> Comparison {
        let gray = |values: [f32; 4]| {
            let plane = Plane {
                width: 4,
                height: 1,
                values: values.to_vec(),
            };
            Plate::from_planes([plane.clone(), plane.clone(), plane])
        };
        let mut mask = Mask::all(4, 1);
        mask.counts[3] = false;
        let options = Options {
            matching: Matching::None,
            mask: Some(mask),
            ..Options::default()
        };
        let new = gray([0.5, 1.0, 0.0, 0.2]);
        compare(&new, &gray([0.5, 0.0, 1.0, 0.9]), &options).unwrap()
    }

    #[test]
    fn a_difference_has_its_sign_and_pixels_that_do_not_count_are_black_or_nan() {
        let folder = std::env::temp_dir().join(format!("ivcam-difference-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let read = |name: &str| {
            let path = folder.join(name);
            write(&comparison(), "a command", &path).unwrap();
            Raster::open(&path).unwrap()
        };
        let (png, exr) = (read("a.png"), read("a.exr"));
        std::fs::remove_dir_all(&folder).unwrap();
        let Samples::U16(levels) = &png.samples else {
            panic!("16 bits");
        };
        assert_eq!(
            levels[..],
            [[32_768; 3], [65_535; 3], [1; 3], [0; 3]].concat()
        );
        assert_eq!([0, 1, 2].map(|i| exr.color(i)[1]), [0.0, 1.0, -1.0]);
        assert!(exr.color(3).iter().all(|v| v.is_nan()));
        assert!(write(&comparison(), "", Path::new("a.jpg")).is_err());
    }
}
