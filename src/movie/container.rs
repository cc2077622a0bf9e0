//! Writes the frames of a movie into one file: with ffmpeg, or as an animated PNG.

use std::ffi::OsString;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::files::{folder_of, temporary_prefix, write_whole};
use ivcam_optics::picture::{Raster, Samples};

/// The filter that makes limited-range Y'CbCr by ITU-R BT.709, which the tags of the movie state.
/// Without it the matrix is that of BT.601, which a player does not assume for most sizes.
const TO_BT709: &str = "scale=out_color_matrix=bt709:out_range=tv";

/// The file format of a movie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Container {
    /// An animated PNG.
    AnimatedPng,
    /// H.264 in a QuickTime file, written by ffmpeg.
    Mov,
    /// H.264 in an MP4 file, written by ffmpeg.
    Mp4,
}

impl Container {
    /// Returns the format of a file name's extension.
    ///
    /// # Errors
    /// Fails if the extension is unknown, or needs ffmpeg and there is none.
    pub(crate) fn of(path: &Path) -> Result<Self> {
        let container = Self::check_ending(path)?;
        if container == Self::AnimatedPng || has_ffmpeg() {
            return Ok(container);
        }
        let other = path.with_extension("png");
        Err(
            Diagnostic::unsupported(format!("there is no ffmpeg to write `{}`", path.display()))
                .with_help(format!(
                    "install ffmpeg, or give `-o {}` for an animated PNG: it has the same \
                     frames, and a movie can be made of them later",
                    other.display()
                )),
        )
    }

    /// Returns the format of a file name's extension, whether or not it can be written here.
    ///
    /// # Errors
    /// Fails if the extension is unknown.
    pub(crate) fn check_ending(path: &Path) -> Result<Self> {
        let end = path.extension().unwrap_or_default().to_ascii_lowercase();
        match end.to_str() {
            Some("png") => Ok(Self::AnimatedPng),
            Some("mov") => Ok(Self::Mov),
            Some("mp4") => Ok(Self::Mp4),
            _ => Err(Diagnostic::unsupported(format!(
                "cannot tell the movie's format from `{}`",
                path.display()
            ))
            .with_help("end its name in .mov, .mp4 or .png (animated)")),
        }
    }

    /// Writes the frames, given in order, as one movie. `rate` is in frames per second.
    ///
    /// # Errors
    /// Fails if a frame cannot be read or has another size, the disk is full, or ffmpeg fails.
    pub(crate) fn write(self, movie: &Path, frames: &[PathBuf], rate: f64) -> Result<()> {
        check_sizes(frames)?;
        match self {
            Self::AnimatedPng => animated_png(movie, frames, rate),
            Self::Mov => by_ffmpeg(movie, "mov", frames, rate),
            Self::Mp4 => by_ffmpeg(movie, "mp4", frames, rate),
        }
    }
}

/// Checks that frames have one size. ffmpeg would change that of the others. A file that is no PNG
/// is reported where it is read.
fn check_sizes(frames: &[PathBuf]) -> Result<()> {
    let size = |path: &PathBuf| {
        let reader = png::Decoder::new(BufReader::new(File::open(path).ok()?));
        let (width, height) = reader.read_info().ok()?.info().size();
        Some(format!("{width}x{height}"))
    };
    let mut sizes = frames.iter().filter_map(|path| Some((path, size(path)?)));
    let Some((first, of_first)) = sizes.next() else {
        return Ok(());
    };
    let Some((other, of_other)) = sizes.find(|(_, size)| *size != of_first) else {
        return Ok(());
    };
    let text = format!(
        "the frames differ in size: `{}` has {of_first} pixels, and `{}` {of_other}",
        first.display(),
        other.display()
    );
    let folder = folder_of(first);
    Err(Diagnostic::error(text).with_help(format!(
        "`ivcam frames {} --remove-broken` removes those of the wrong size, and the next run makes \
         them again",
        folder.display()
    )))
}

/// Runs ffmpeg, which reads the frames by their numbers in the folder of the first. There the name
/// of the folder is no part of the pattern of their names, which `%` begins. `file:` keeps a name
/// with a colon from being read as a protocol.
fn by_ffmpeg(movie: &Path, end: &str, frames: &[PathBuf], rate: f64) -> Result<()> {
    let folder = frames.first().map_or_else(PathBuf::new, |f| folder_of(f));
    let prefix = temporary_prefix(movie);
    let beside = movie.with_file_name(format!("{prefix}{}.tmp.{end}", std::process::id()));
    let mut target = OsString::from("file:");
    let absolute = std::path::absolute(&beside);
    target.push(absolute.map_err(|e| Diagnostic::io(movie.display(), &e))?);
    let output = std::process::Command::new("ffmpeg")
        .current_dir(&folder)
        .args(["-y", "-nostdin", "-loglevel", "error", "-framerate"])
        .arg(rate.to_string())
        .args(["-i", "%05d.png"])
        // H.264 in 4:2:0 needs even sides.
        .args(["-vf", &format!("pad=ceil(iw/2)*2:ceil(ih/2)*2,{TO_BT709}")])
        .args(["-c:v", "libx264", "-crf", "14", "-pix_fmt", "yuv420p"])
        .args(["-colorspace", "bt709", "-color_primaries", "bt709"])
        .args(["-color_trc", "bt709", "-color_range", "tv"])
        .arg(&target)
        .output()
        .map_err(|e| Diagnostic::io("ffmpeg", &e))?;
    if output.status.success() {
        return std::fs::rename(&beside, movie).map_err(|e| Diagnostic::io(movie.display(), &e));
    }
    let _ = std::fs::remove_file(&beside);
    let errors = String::from_utf8_lossy(&output.stderr);
    let last = errors.lines().last().unwrap_or("no reason given");
    Err(
        Diagnostic::error(format!("ffmpeg can't write `{}`: {last}", movie.display()))
            .with_help(format!("the frames are in `{}`", folder.display())),
    )
}

/// Writes frames of one size as an animated PNG that repeats without end.
fn animated_png(movie: &Path, frames: &[PathBuf], rate: f64) -> Result<()> {
    let rasters = frames.iter().map(|path| Raster::open(path));
    let mut rasters = rasters.collect::<Result<Vec<_>>>()?.into_iter();
    let Some(first) = rasters.next() else {
        return Err(Diagnostic::error("a movie needs a frame"));
    };
    let (over, under) = delay(rate);
    write_whole(movie, |file| {
        let mut encoder = png::Encoder::new(file, first.width, first.height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_animated(frames.len() as u32, 0)?;
        encoder.set_frame_delay(over, under)?;
        let mut writer = encoder.write_header().map_err(io_error)?;
        for raster in std::iter::once(first).chain(rasters) {
            writer
                .write_image_data(&levels(&raster))
                .map_err(io_error)?;
        }
        writer.finish().map_err(io_error)
    })
}

/// Returns the time of a frame in seconds as the nearest fraction of two 16-bit numbers, which is
/// what an animated PNG has.
fn delay(rate: f64) -> (u16, u16) {
    let off = |(over, under): &(u16, u16)| (f64::from(*under) / f64::from(*over) - rate).abs();
    let under = |over: u16| (f64::from(over) * rate).round().clamp(1.0, 65_535.0) as u16;
    let fractions = (1..=u16::MAX).map(|over| (over, under(over)));
    let nearest = fractions.min_by(|a, b| off(a).total_cmp(&off(b)));
    nearest.unwrap_or((1, 24))
}

/// Unwraps an I/O error, such as a full disk, from the encoder's error.
fn io_error(error: png::EncodingError) -> std::io::Error {
    match error {
        png::EncodingError::IoError(error) => error,
        other => other.into(),
    }
}

/// Returns red, green and blue in 8 bits.
fn levels(raster: &Raster) -> Vec<u8> {
    match &raster.samples {
        Samples::U8(levels) if raster.channels == 3 => levels.clone(),
        _ => (0..raster.pixels())
            .flat_map(|i| raster.color(i))
            .map(|v| (255.0 * v.clamp(0.0, 1.0)).round() as u8)
            .collect(),
    }
}

/// Returns whether ffmpeg can be run.
pub(crate) fn has_ffmpeg() -> bool {
    let run = std::process::Command::new("ffmpeg")
        .arg("-version")
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null())
        .status();
    run.is_ok_and(|s| s.success())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_delay_of_a_frame_is_the_nearest_fraction() {
        for (rate, fraction) in [
            (24.0, (1, 24)),
            (23.976, (125, 2997)),
            (0.001, (1000, 1)),
            (1000.0, (1, 1000)),
            (119.88, (25, 2997)),
        ] {
            assert_eq!(delay(rate), fraction, "{rate}");
        }
    }

    #[test]
    fn an_animated_png_has_its_frames_and_its_rate() {
        let folder = std::env::temp_dir().join(format!("ivcam-film-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let paths: Vec<PathBuf> = (0..3).map(|i| folder.join(format!("{i}.png"))).collect();
        for (i, path) in paths.iter().enumerate() {
            image::RgbImage::from_pixel(4, 2, image::Rgb([i as u8 * 100; 3]))
                .save(path)
                .unwrap();
        }
        let film = folder.join("film.png");
        animated_png(&film, &paths, 24.0).unwrap();
        let file = std::io::BufReader::new(std::fs::File::open(&film).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let frames = reader.info().animation_control.unwrap().num_frames;
        let mut pixels = vec![0; 4 * 2 * 3];
        let mut seen = Vec::new();
        for _ in 0..frames {
            reader.next_frame(&mut pixels).unwrap();
            seen.push(pixels[0]);
            assert_eq!(reader.info().frame_control.unwrap().delay_den, 24);
        }
        assert_eq!(seen, [0, 100, 200]);
        std::fs::remove_dir_all(folder).unwrap();
    }
}
