//! Synthetic scans: a picture turned, scaled, shifted, resampled, put on paper, blurred, given
//! grain and compressed, with the place of every pixel known.

use glam::DVec2;
use image::codecs::jpeg::JpegEncoder;
use image::{ImageFormat, Rgb, RgbImage};
use ivcam::compare::{Plane, Plate};
use ivcam_optics::sampling::{mix, unit};

/// How pixels are made from a larger picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Resampler {
    /// The mean over a pixel's area.
    Area,
    /// Lanczos's kernel of three lobes.
    Lanczos,
    /// The nearest pixel.
    Nearest,
}

/// What surrounds the photograph in a scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Border {
    /// Nothing: the scan is a part of the photograph.
    None,
    /// Paper, unevenly lit.
    Paper,
    /// Gray mat with a dark line around the photograph.
    Mat,
    /// The black bed of a scanner, then paper.
    Bed,
    /// Paper with lines of words below the photograph, and a stamp over its corner.
    Caption,
}

impl Border {
    pub(super) const ALL: [Self; 5] =
        [Self::None, Self::Paper, Self::Mat, Self::Bed, Self::Caption];
}

impl Resampler {
    pub(super) const ALL: [Self; 3] = [Self::Area, Self::Lanczos, Self::Nearest];
}

/// A map from the old picture to the new one, both in pixels from their centers: a clockwise turn,
/// pixels of the new picture in one of the old, and the old picture's center.
#[derive(Clone, Copy, Debug)]
pub(super) struct ScanPlace {
    /// Radians.
    pub turn: f64,
    pub scale: f64,
    pub shift: DVec2,
}

impl ScanPlace {
    pub(super) fn apply(self, p: DVec2) -> DVec2 {
        self.scale * DVec2::from_angle(self.turn).rotate(p) + self.shift
    }

    pub(super) fn inverse(self, p: DVec2) -> DVec2 {
        DVec2::from_angle(-self.turn).rotate(p - self.shift) / self.scale
    }
}

/// One scan of a picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scan {
    pub place: ScanPlace,
    /// Pixels across and down.
    pub size: (usize, usize),
    pub resampler: Resampler,
    pub border: Border,
    pub gamma: f64,
    pub gain: f64,
    /// The level that black becomes.
    pub black: f64,
    /// Whether the tone curve comes after the blur, as a scanner's, instead of before it.
    pub is_curved_last: bool,
    /// The standard deviation of noise of single pixels.
    pub noise: f64,
    /// The standard deviation of grain of two pixels.
    pub grain: f64,
    /// The standard deviation of the blur, in pixels.
    pub blur: f64,
    /// The quality of the JPEG, or none.
    pub jpeg: Option<u8>,
}

/// Reproducible random numbers.
pub(super) struct ScanRandom(pub u64);

impl ScanRandom {
    /// Returns a number from 0 to 1.
    pub(super) fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        unit(mix(self.0))
    }

    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    pub(super) fn below(&mut self, count: usize) -> usize {
        ((self.uniform() * count as f64) as usize).min(count - 1)
    }

    /// Returns a number of mean 0 and variance 1, nearly normally distributed.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

impl Scan {
    /// Draws a scan of a picture of `new` pixels. A scan without a border stays within the picture.
    pub(super) fn random(
        new: (usize, usize),
        border: Border,
        resampler: Resampler,
        random: &mut ScanRandom,
    ) -> Self {
        let new = DVec2::new(new.0 as f64, new.1 as f64);
        let scale = libm::exp2(random.between(-0.6, 0.6));
        let turn = random.between(-3.0, 3.0).to_radians();
        let (mut size, mut shift) = (0.88 * new / scale, DVec2::ZERO);
        if border != Border::None {
            let side = |r: &mut ScanRandom| new.y / scale * r.between(0.04, 0.14);
            let [left, right, top, mut bottom] = [0; 4].map(|_| side(random));
            if border == Border::Caption {
                bottom += 0.2 * new.y / scale;
            }
            size = new / scale + DVec2::new(left + right, top + bottom);
            // The scan's center is beyond the photograph's by half of the borders' difference.
            shift = DVec2::from_angle(turn)
                .rotate(0.5 * scale * DVec2::new(right - left, bottom - top));
        }
        let off = DVec2::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0));
        shift += 0.01 * new * off;
        Self {
            place: ScanPlace { turn, scale, shift },
            size: (size.x.round() as usize, size.y.round() as usize),
            resampler,
            border,
            gamma: libm::exp2(random.between(-0.6, 0.6)),
            gain: random.between(0.75, 1.0),
            black: random.between(0.0, 0.06),
            is_curved_last: random.uniform() < 0.5,
            noise: random.between(0.0, 0.02),
            grain: random.between(0.0, 0.02),
            blur: random.between(0.0, 1.0),
            jpeg: (random.uniform() < 0.75).then(|| random.between(50.0, 95.0) as u8),
        }
    }

    /// Makes the scan from a source that is `fine` times as large as the new picture.
    pub(super) fn make(&self, source: &Plate, fine: f64, random: &mut ScanRandom) -> Plate {
        let frame = 0.5 * DVec2::new(source.width as f64, source.height as f64) / fine;
        let marks = ScanMarks::new(self, frame, random);
        let grains = self.grain_plane(random);
        let sample = |channel: &Plane, p: DVec2| -> f64 {
            let place = self.place.apply(p);
            if place.x.abs() > frame.x || place.y.abs() > frame.y {
                return marks.border(p, place, frame);
            }
            let at = (place + frame) * fine;
            let level = match self.resampler {
                Resampler::Area | Resampler::Nearest => {
                    f64::from(channel.near(at.x.floor() as isize, at.y.floor() as isize))
                }
                Resampler::Lanczos => lanczos(channel, at, (fine * self.place.scale).max(1.0)),
            };
            marks.stamped(p, level)
        };
        let parts = match self.resampler {
            Resampler::Area => 6,
            Resampler::Lanczos | Resampler::Nearest => 1,
        };
        let center = 0.5 * DVec2::new(self.size.0 as f64, self.size.1 as f64);
        let channel = |c: usize| {
            let tone = |v: f32| {
                let curved = libm::pow(f64::from(v.clamp(0.0, 1.0)), self.gamma);
                (self.black + (self.gain - self.black) * curved) as f32
            };
            let mut channel = source.channels[c].clone();
            if !self.is_curved_last {
                channel = channel.map(tone);
            }
            let plane = Plane::from_fn(self.size.0, self.size.1, |x, y| {
                let mut sum = 0.0;
                for i in 0..parts * parts {
                    let part = DVec2::new((i % parts) as f64, (i / parts) as f64) + 0.5;
                    let p = DVec2::new(x as f64, y as f64) + part / parts as f64 - center;
                    sum += sample(&channel, p);
                }
                (sum / (parts * parts) as f64) as f32
            });
            let plane = if self.blur > 0.2 {
                plane.blurred(self.blur)
            } else {
                plane
            };
            let plane = if self.is_curved_last {
                plane.map(tone)
            } else {
                plane
            };
            plane.zip(&grains, |v, g| v + g)
        };
        let mut channels = [0, 1, 2].map(channel);
        for v in channels.iter_mut().flat_map(|c| &mut c.values) {
            let noisy = f64::from(*v) + self.noise * random.normal();
            *v = ((255.0 * noisy.clamp(0.0, 1.0)).round() / 255.0) as f32;
        }
        compressed(Plate::from_planes(channels), self.jpeg)
    }

    fn grain_plane(&self, random: &mut ScanRandom) -> Plane {
        let count = self.size.0 * self.size.1;
        let plane = Plane {
            width: self.size.0,
            height: self.size.1,
            values: (0..count).map(|_| random.normal() as f32).collect(),
        };
        // A blur by .8 pixels divides the standard deviation by 2·√π·.8.
        let strength = self.grain * 2.0 * std::f64::consts::PI.sqrt() * 0.8;
        plane.blurred(0.8).map(|v| (strength * f64::from(v)) as f32)
    }
}

/// The words and the stamp of a scan, and the light on its paper.
struct ScanMarks {
    border: Border,
    slope: DVec2,
    words: Vec<[f64; 4]>,
    stamp: Option<(DVec2, f64)>,
}

impl ScanMarks {
    fn new(scan: &Scan, frame: DVec2, random: &mut ScanRandom) -> Self {
        let half = 0.5 * DVec2::new(scan.size.0 as f64, scan.size.1 as f64);
        let slope = DVec2::new(random.between(-0.04, 0.04), random.between(-0.04, 0.04)) / half;
        let mut marks = Self {
            border: scan.border,
            slope,
            words: Vec::new(),
            stamp: None,
        };
        if scan.border == Border::Caption {
            let corner = scan.place.inverse(frame);
            let room = half.y - corner.y;
            for line in 0..3 {
                let y = corner.y + room * (0.3 + 0.2 * f64::from(line));
                let mut x = -0.8 * half.x;
                while x < 0.7 * half.x {
                    let wide = random.between(0.02, 0.1) * half.x;
                    marks.words.push([x, y, x + wide, y + 0.08 * room]);
                    x += wide + 0.03 * half.x;
                }
            }
            marks.stamp = Some((scan.place.inverse(0.85 * frame), 0.14 * half.y));
        }
        marks
    }

    /// Returns the level at a point outside the photograph.
    fn border(&self, p: DVec2, place: DVec2, frame: DVec2) -> f64 {
        let beyond = (place.abs() - frame).max_element() / frame.y;
        let light = self.slope.dot(p);
        match self.border {
            Border::None => 0.0,
            Border::Paper => 0.9 + light,
            Border::Mat if beyond < 0.012 => 0.15,
            Border::Mat => 0.62 + light,
            Border::Bed if beyond > 0.05 => 0.03,
            Border::Bed => 0.9 + light,
            Border::Caption => {
                let inside =
                    |w: &[f64; 4]| (w[0]..w[2]).contains(&p.x) && (w[1]..w[3]).contains(&p.y);
                if self.words.iter().any(inside) {
                    0.2
                } else {
                    self.stamped(p, 0.9 + light)
                }
            }
        }
    }

    /// Returns the level with the ring of the stamp over it.
    fn stamped(&self, p: DVec2, level: f64) -> f64 {
        let on =
            |&(center, radius): &(DVec2, f64)| (0.7..1.0).contains(&(p.distance(center) / radius));
        if self.stamp.as_ref().is_some_and(on) {
            0.4 * level
        } else {
            level
        }
    }
}

/// Returns a picture reduced by a whole number, each pixel the mean of a square.
pub(super) fn reduced(source: &Plate, by: usize) -> Plate {
    let (width, height) = (source.width / by, source.height / by);
    source.map(|plane| {
        Plane::from_fn(width, height, |x, y| {
            let square = (0..by * by).map(|i| plane.at(by * x + i % by, by * y + i / by));
            square.sum::<f32>() / (by * by) as f32
        })
    })
}

/// Returns the part of a picture whose size is a multiple of `by`.
pub(super) fn divisible(source: &Plate, by: usize) -> Plate {
    let (width, height) = (source.width / by * by, source.height / by * by);
    source.map(|plane| Plane::from_fn(width, height, |x, y| plane.at(x, y)))
}

/// Returns the value at a position by Lanczos's kernel, `wide` pixels a lobe.
fn lanczos(plane: &Plane, at: DVec2, wide: f64) -> f64 {
    let kernel = |t: f64| {
        let x = std::f64::consts::PI * t;
        if x.abs() < 1e-9 {
            1.0
        } else if t.abs() >= 3.0 {
            0.0
        } else {
            3.0 * libm::sin(x) * libm::sin(x / 3.0) / (x * x)
        }
    };
    let taps = |center: f64| {
        let from = (center - 3.0 * wide - 0.5).ceil() as isize;
        let to = (center + 3.0 * wide - 0.5).floor() as isize;
        (from..=to).map(move |i| (i, kernel((i as f64 + 0.5 - center) / wide)))
    };
    let (mut sum, mut whole) = (0.0, 0.0);
    for (y, wy) in taps(at.y) {
        for (x, wx) in taps(at.x) {
            sum += wx * wy * f64::from(plane.near(x, y));
            whole += wx * wy;
        }
    }
    sum / whole
}

/// Returns the picture after it was written as a JPEG and read again.
fn compressed(plate: Plate, quality: Option<u8>) -> Plate {
    let Some(quality) = quality else { return plate };
    let byte = |v: f32| (255.0 * v).round() as u8;
    let picture = RgbImage::from_fn(plate.width as u32, plate.height as u32, |x, y| {
        Rgb(plate.color(y as usize * plate.width + x as usize).map(byte))
    });
    let mut bytes = Vec::new();
    let written = picture.write_with_encoder(JpegEncoder::new_with_quality(&mut bytes, quality));
    let read = image::load_from_memory_with_format(&bytes, ImageFormat::Jpeg);
    let (Ok(()), Ok(read)) = (written, read) else {
        return plate; // The encoder accepts every picture of 8 bits.
    };
    let read = read.into_rgb8();
    Plate::from_planes([0, 1, 2].map(|c| {
        Plane::from_fn(plate.width, plate.height, |x, y| {
            f32::from(read.get_pixel(x as u32, y as u32)[c]) / 255.0
        })
    }))
}
