//! An archival picture shown with the live one: alternating, side by side, or blended.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use ivcam_base::diag::Result;
use ivcam_optics::film::Resolution;
use ivcam_optics::picture::Raster;

use crate::compare::{Alignment, Plane, Plate, align, resample};

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

/// The longest side, in pixels, of the pictures that are aligned. It bounds the time to about a
/// second; larger pictures are reduced.
const ALIGNED_SIDE: u32 = 1000;

/// A picture for the screen: 8 bits of red, green, blue and opacity, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Levels {
    pub size: [usize; 2],
    pub rgba: Vec<u8>,
}

/// An archival picture mapped to the live one's pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct AlignedArchive {
    /// It is transparent where the archival picture does not reach.
    pub(crate) levels: Levels,
    /// The position of the archival picture on the live one.
    pub(crate) alignment: Alignment,
}

/// An archival picture to be aligned with the live one.
pub(crate) struct AlignmentJob {
    /// See [`Archive::version`].
    pub version: u64,
    live: Plate,
    old: Arc<Raster>,
}

impl AlignmentJob {
    /// Finds the alignment and resamples the archival picture. Uses rayon's current pool.
    ///
    /// # Errors
    /// Fails if the pictures do not show the same scene.
    pub(crate) fn run(&self) -> Result<AlignedArchive> {
        let longer = self.live.width.max(self.live.height) as f64;
        let ratio = (longer / f64::from(ALIGNED_SIDE)).max(1.0);
        let side = |n: usize| ((n as f64 / ratio).round() as usize).max(1);
        let (width, height) = (side(self.live.width), side(self.live.height));
        let live = self.live.map(|p| p.resized(width, height));
        let old = Plate::from_raster(&self.old);
        let found = align(&live, &old)?;
        let (onto, shared) = resample(&found.old, found.warp, width, height);
        let rgba = (0..width * height).flat_map(|i| {
            let [r, g, b] = onto.color(i).map(level);
            [r, g, b, if shared.counts[i] { 255 } else { 0 }]
        });
        let levels = Levels {
            size: [width, height],
            rgba: rgba.collect(),
        };
        Ok(AlignedArchive {
            levels,
            alignment: found.alignment,
        })
    }
}

fn level(v: f32) -> u8 {
    (255.0 * v.clamp(0.0, 1.0)).round() as u8
}

/// The archival picture and how it is shown.
#[derive(Clone, Debug)]
pub(crate) struct Archive {
    /// The file of the picture.
    pub path: PathBuf,
    pub picture: Option<Arc<Raster>>,
    /// The picture on the live one's pixels, once it has been aligned.
    pub aligned: Option<AlignedArchive>,
    /// Whether it is to be aligned as soon as the live picture has little noise.
    pub wants_alignment: bool,
    /// The state of the alignment, for the panel.
    pub note: String,
    pub mode: ArchiveMode,
    /// The position of the wipe's line, from 0 to 1.
    pub line: f32,
    /// The opacity of the old picture when it is blended.
    pub opacity: f32,
    /// The number of changes of the picture on screen so far.
    pub version: u64,
}

impl Default for Archive {
    fn default() -> Self {
        Self {
            path: PathBuf::new(),
            picture: None,
            aligned: None,
            wants_alignment: false,
            note: String::new(),
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
        self.picture = Some(Arc::new(Raster::open(path)?));
        self.path = path.to_owned();
        self.realign();
        if self.mode == ArchiveMode::Off {
            self.mode = ArchiveMode::Wipe;
        }
        Ok(())
    }

    /// Aligns the picture again, as soon as the live picture has little noise.
    pub(crate) fn realign(&mut self) {
        self.version += 1;
        (self.aligned, self.wants_alignment) = (None, true);
        self.note = "not aligned yet".into();
    }

    /// Returns the picture to be aligned with the live one's levels, if it still has to be.
    pub(crate) fn alignment_job(
        &mut self,
        size: Resolution,
        levels: impl FnOnce() -> Vec<u8>,
    ) -> Option<AlignmentJob> {
        if !std::mem::take(&mut self.wants_alignment) {
            return None;
        }
        let old = self.picture.clone()?;
        let levels = levels();
        let (width, height) = (size.width as usize, size.height as usize);
        let plane = |channel: usize| {
            let at = |x: usize, y: usize| f32::from(levels[3 * (y * width + x) + channel]) / 255.0;
            Plane::from_fn(width, height, at)
        };
        let live = Plate::from_planes([plane(0), plane(1), plane(2)]);
        self.note = "aligning".into();
        let version = self.version;
        Some(AlignmentJob { version, live, old })
    }

    /// Takes the result of an alignment, unless the picture has changed since.
    pub(crate) fn align_done(&mut self, version: u64, aligned: Result<AlignedArchive>) {
        if version != self.version {
            return;
        }
        self.version += 1;
        match aligned {
            Ok(aligned) => {
                let Alignment {
                    scale,
                    rotation,
                    agreement,
                    mirrored,
                    ..
                } = aligned.alignment;
                let mirrored = if mirrored { "mirrored, " } else { "" };
                self.note = format!(
                    "aligned: {mirrored}scale {scale:.3}, turned {rotation:.2}°, agreement {agreement:.2}"
                );
                self.aligned = Some(aligned);
            }
            Err(error) => self.note = format!("not aligned: {}", error.message),
        }
    }

    /// Returns the picture for the screen: aligned, or else as it is in its file.
    pub(crate) fn levels(&self) -> Option<Levels> {
        if let Some(aligned) = &self.aligned {
            return Some(aligned.levels.clone());
        }
        let picture = self.picture.as_ref()?;
        let rgba = (0..picture.pixels()).flat_map(|i| {
            let [r, g, b] = picture.color(i).map(level);
            [r, g, b, 255]
        });
        Some(Levels {
            size: [picture.width as usize, picture.height as usize],
            rgba: rgba.collect(),
        })
    }

    /// Returns the width over the height of the picture on screen.
    pub(crate) fn aspect(&self) -> Option<f32> {
        let [width, height] = match (&self.aligned, &self.picture) {
            (Some(aligned), _) => aligned.levels.size,
            (None, Some(picture)) => [picture.width as usize, picture.height as usize],
            (None, None) => return None,
        };
        Some(width as f32 / height as f32)
    }

    /// Returns whether the old picture is the one shown at a time in seconds, when they alternate.
    pub(crate) fn blinks_on(&self, now: f64) -> bool {
        self.mode == ArchiveMode::Blink && (now / BLINK) as i64 % 2 == 1
    }
}
