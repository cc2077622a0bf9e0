//! A picture of then, held against the live one: by turns, side by side, or shining through.

use std::path::{Path, PathBuf};

use crate::diag::Result;
use crate::picture::Raster;

/// How two pictures are shown in one place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Way {
    #[default]
    Off,
    /// One after the other.
    Blink,
    /// One to the left of a line, the other to its right.
    Wipe,
    /// The old one shines through.
    Onion,
}

impl Way {
    pub(crate) const ALL: [(Self, &'static str); 4] = [
        (Self::Off, "Off"),
        (Self::Blink, "Blink"),
        (Self::Wipe, "Wipe"),
        (Self::Onion, "Onion skin"),
    ];
}

/// Seconds that each picture is seen when they blink.
pub(crate) const BLINK: f64 = 0.6;

/// The picture and how it is shown.
#[derive(Clone, Debug)]
pub(crate) struct Archive {
    pub path: PathBuf,
    pub picture: Option<Raster>,
    pub way: Way,
    /// Where the line of a wipe is, from 0 to 1.
    pub line: f32,
    /// How much of the old picture an onion skin shows.
    pub opacity: f32,
    /// Counts the pictures loaded.
    pub version: u64,
}

impl Default for Archive {
    fn default() -> Self {
        Self {
            path: PathBuf::new(),
            picture: None,
            way: Way::Off,
            line: 0.5,
            opacity: 0.5,
            version: 0,
        }
    }
}

impl Archive {
    /// Loads a picture and shows it by a wipe.
    ///
    /// # Errors
    /// A file that is no picture.
    pub(crate) fn load(&mut self, path: &Path) -> Result<()> {
        self.picture = Some(Raster::open(path)?);
        self.path = path.to_owned();
        self.version += 1;
        if self.way == Way::Off {
            self.way = Way::Wipe;
        }
        Ok(())
    }

    /// Its levels, 8 bits of red, green and blue.
    pub(crate) fn levels(&self) -> Option<([usize; 2], Vec<u8>)> {
        let picture = self.picture.as_ref()?;
        let level = |v: f32| (255.0 * v.clamp(0.0, 1.0)).round() as u8;
        let levels = (0..picture.pixels())
            .flat_map(|i| picture.color(i).map(level))
            .collect();
        Some(([picture.width as usize, picture.height as usize], levels))
    }

    /// Whether the old picture is the one seen now, as they blink.
    pub(crate) fn blinks_on(&self, now: f64) -> bool {
        self.way == Way::Blink && (now / BLINK) as i64 % 2 == 1
    }
}
