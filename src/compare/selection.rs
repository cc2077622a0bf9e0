//! The pixels of the new picture that a comparison is limited to.

use ivcam_base::diag::{Diagnostic, Result};
use ivcam_optics::picture::Raster;

use ivcam_compare::Mask;

/// What `--mask` and `--crop` select.
#[derive(Clone, Debug, Default)]
pub(crate) struct Selection {
    /// The pixels of a mask, which has the size of the new picture.
    pub mask: Option<Mask>,
    /// Left, top, width and height of a rectangle, in pixels.
    pub crop: Option<[usize; 4]>,
}

impl Selection {
    /// Returns the mask of a picture: its white pixels, if they are not transparent.
    pub(crate) fn white_pixels(raster: &Raster) -> Mask {
        let white = |i: usize| raster.color(i).iter().sum::<f32>() > 1.5 && raster.alpha(i) > 0.5;
        Mask {
            width: raster.width as usize,
            height: raster.height as usize,
            counts: (0..raster.pixels()).map(white).collect(),
        }
    }

    /// Returns the selected pixels of the new picture of this size; `None` is all. A mask of
    /// another size is returned as it is, for [`Mask::check`] to report.
    ///
    /// # Errors
    /// Returns an error if the rectangle is not inside the picture.
    pub(crate) fn of(&self, (width, height): (usize, usize), name: &str) -> Result<Option<Mask>> {
        let Some([left, top, w, h]) = self.crop else {
            return Ok(self.mask.clone());
        };
        let fits = |from: usize, size: usize, all: usize| {
            size > 0 && from.checked_add(size).is_some_and(|end| end <= all)
        };
        if !fits(left, w, width) || !fits(top, h, height) {
            return Err(Diagnostic::error(format!(
                "`--crop {left},{top},{w},{h}` is not inside the new picture"
            ))
            .with_help(format!("{name} is {width}x{height}")));
        }
        let inside = |i: usize| {
            (left..left + w).contains(&(i % width)) && (top..top + h).contains(&(i / width))
        };
        let crop = Mask {
            width,
            height,
            counts: (0..width * height).map(inside).collect(),
        };
        Ok(Some(match &self.mask {
            Some(mask) if (mask.width, mask.height) == (width, height) => crop.and(mask),
            Some(mask) => mask.clone(),
            None => crop,
        }))
    }
}
