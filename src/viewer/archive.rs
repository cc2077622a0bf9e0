//! An archival picture shown with the live one: alternating, side by side, or blended.

use std::path::{Path, PathBuf};

use crate::diag::Result;
use crate::picture::Raster;

/// The way that two pictures are shown in one place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum ArchiveMode {
    /// Only the live picture is shown.
    #[default]
    Off,
    /// The pictures alternate.
    Blink,
    /// The old picture is on one side of a line, the live one on the other.
    Wipe,
    /// The old picture is blended with the live one.
    Onion,
}

impl ArchiveMode {
    /// The modes with their names in the window.
    pub(crate) const ALL: [(Self, &'static str); 4] = [
        (Self::Off, "Off"),
        (Self::Blink, "Blink"),
        (Self::Wipe, "Wipe"),
        (Self::Onion, "Onion skin"),
    ];
}

/// The time in seconds that each picture is shown when they alternate.
pub(crate) const BLINK: f64 = 0.6;

/// The archival picture and how it is shown.
#[derive(Clone, Debug)]
pub(crate) struct Archive {
    /// The file of the picture.
    pub path: PathBuf,
    pub picture: Option<Raster>,
    pub mode: ArchiveMode,
    /// The position of the wipe's line, from 0 to 1.
    pub line: f32,
    /// The opacity of the old picture when it is blended.
    pub opacity: f32,
    /// The number of pictures loaded so far.
    pub version: u64,
}

impl Default for Archive {
    fn default() -> Self {
        Self {
            path: PathBuf::new(),
            picture: None,
            mode: ArchiveMode::Off,
            line: 0.5,
            opacity: 0.5,
            version: 0,
        }
    }
}

impl Archive {
    /// Loads a picture, and shows it by a wipe if it was off.
    ///
    /// # Errors
    /// Fails if the file is not a picture.
    pub(crate) fn load(&mut self, path: &Path) -> Result<()> {
        self.picture = Some(Raster::open(path)?);
        self.path = path.to_owned();
        self.version += 1;
        if self.mode == ArchiveMode::Off {
            self.mode = ArchiveMode::Wipe;
        }
        Ok(())
    }

    /// Returns the size and the levels, 8 bits of red, green and blue.
    pub(crate) fn levels(&self) -> Option<([usize; 2], Vec<u8>)> {
        let picture = self.picture.as_ref()?;
        let level = |v: f32| (255.0 * v.clamp(0.0, 1.0)).round() as u8;
        let levels = (0..picture.pixels())
            .flat_map(|i| picture.color(i).map(level))
            .collect();
        Some(([picture.width as usize, picture.height as usize], levels))
    }

    /// Returns whether the old picture is the one shown at a time in seconds, when they alternate.
    pub(crate) fn blinks_on(&self, now: f64) -> bool {
        self.mode == ArchiveMode::Blink && (now / BLINK) as i64 % 2 == 1
    }
}
