//! Compares two pictures: registration, tone matching, then measures.

use ivcam_base::diag::{Diagnostic, Result, counted};
use serde::Serialize;

use crate::align::{self, Alignment};
use crate::edges::{self, EdgeDistance};
use crate::flip;
use crate::metric::{self, Mask};
use crate::plane::Plate;
use crate::tone::{self, Matching, Tone};
use crate::warp;

/// The method that maps the old picture to the new one's pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Registration {
    /// No change; the sizes must be equal.
    None,
    /// Scaling to the new picture's size; the aspects must be equal.
    Resize,
    /// The shift, scale and rotation that are found by alignment.
    Align,
}

/// The options of a comparison.
#[derive(Clone, Debug)]
pub struct Options {
    /// The mapping of the old picture to the new one's pixels.
    pub registration: Registration,
    /// The tone curves that are fitted to the old picture.
    pub matching: Matching,
    /// The pixels of the new picture that count; `None` is all.
    pub mask: Option<Mask>,
    /// The viewing resolution for FLIP, in pixels per degree.
    pub pixels_per_degree: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            registration: Registration::None,
            matching: Matching::Picture,
            mask: None,
            pixels_per_degree: flip::PIXELS_PER_DEGREE,
        }
    }
}

/// The measures of a comparison. For equal pictures, PSNR is infinite, SSIM is 1, and the others
/// are 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Measures {
    /// Mean square error over all channels.
    pub mse: f64,
    /// Peak signal-to-noise ratio in decibels; `null` in JSON if the pictures are equal.
    pub psnr: f64,
    /// Mean structural similarity.
    pub ssim: f64,
    /// Mean FLIP error.
    pub flip: f64,
    /// The distance of edges; `None` if one of the pictures has none.
    pub edges: Option<EdgeDistance>,
    /// `mse` before tones were matched.
    pub unmatched_mse: f64,
    /// `psnr` before tones were matched.
    pub unmatched_psnr: f64,
}

/// The result of a comparison, with the pictures that were compared.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// Pixels across the new picture.
    pub width: usize,
    /// Pixels down the new picture.
    pub height: usize,
    /// The number of pixels that counted.
    pub pixels: usize,
    /// The number of selected pixels that did not count, since a value of one of the pictures is
    /// infinite or not a number.
    pub not_finite: usize,
    /// The alignment that was found, if one was requested.
    pub alignment: Option<Alignment>,
    /// The tone curves applied to the old picture's red, green and blue.
    pub tones: [Tone; 3],
    /// The measures.
    pub measures: Measures,
    /// The new picture.
    #[serde(skip)]
    pub new: Plate,
    /// The old picture on the new one's pixels, with matched tones.
    #[serde(skip)]
    pub old: Plate,
    /// The pixels that counted.
    #[serde(skip)]
    pub mask: Mask,
}

/// A measure that `--limit` accepts.
pub struct Metric {
    /// The name on the command line.
    pub name: &'static str,
    /// Returns the value of the measure.
    pub get: fn(&Measures) -> f64,
    /// Whether a larger value is a better match.
    pub more_is_better: bool,
}

/// The measures that a limit can be set on.
pub const METRICS: [Metric; 9] = [
    metric("mse", |m| m.mse, false),
    metric("psnr", |m| m.psnr, true),
    metric("ssim", |m| m.ssim, true),
    metric("flip", |m| m.flip, false),
    metric("edge", |m| m.edges.map_or(f64::NAN, |e| e.mean), false),
    metric("edge95", |m| m.edges.map_or(f64::NAN, |e| e.p95), false),
    metric(
        "edge-match",
        |m| m.edges.map_or(f64::NAN, |e| e.matched),
        true,
    ),
    metric("unmatched-mse", |m| m.unmatched_mse, false),
    metric("unmatched-psnr", |m| m.unmatched_psnr, true),
];

const fn metric(name: &'static str, get: fn(&Measures) -> f64, more_is_better: bool) -> Metric {
    Metric {
        name,
        get,
        more_is_better,
    }
}

impl Metric {
    /// Returns the measure of a name, in upper or lower case.
    pub fn named(name: &str) -> Option<&'static Self> {
        METRICS.iter().find(|m| m.name.eq_ignore_ascii_case(name))
    }

    /// Returns whether a value of the measure is within a limit. NaN, the value of a measure that
    /// does not exist, is not.
    pub fn holds(&self, value: f64, limit: f64) -> bool {
        if self.more_is_better {
            value >= limit
        } else {
            value <= limit
        }
    }
}

/// A limit on a measure.
#[derive(Clone, Copy)]
pub struct MetricLimit {
    /// The measure.
    pub metric: &'static Metric,
    /// The worst value that is accepted.
    pub value: f64,
}

/// A limit that is exceeded, and by which value.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExceededLimit {
    /// The measure's name.
    pub metric: &'static str,
    /// The worst value that is accepted.
    pub limit: f64,
    /// The value, NaN (`null` in JSON) if the measure does not exist.
    pub value: f64,
}

/// Returns the limits that the values of the measures exceed.
pub fn exceeded(limits: &[MetricLimit], value: impl Fn(&Metric) -> f64) -> Vec<ExceededLimit> {
    let checked = limits.iter().map(|limit| (limit, value(limit.metric)));
    checked
        .filter(|(limit, value)| !limit.metric.holds(*value, limit.value))
        .map(|(limit, value)| ExceededLimit {
            metric: limit.metric.name,
            limit: limit.value,
            value,
        })
        .collect()
}

/// Compares two pictures on the new one's pixels.
///
/// # Errors
/// Fails if sizes differ without a registration, the pictures cannot be aligned, an old picture
/// that is resampled has values that are not finite, or no pixel counts.
pub fn compare(new: &Plate, old: &Plate, options: &Options) -> Result<Comparison> {
    let (width, height) = (new.width, new.height);
    let (old, alignment, shared) = register(new, old, options.registration)?;
    let mut mask = options.mask.clone().unwrap_or(Mask::all(width, height));
    mask.check(width, height)?;
    mask = mask.and(&shared);
    let selected = mask.pixels();
    for finite in [&new.finite, &old.finite].into_iter().flatten() {
        mask = mask.and(&Mask {
            width,
            height,
            counts: finite.clone(),
        });
    }
    if mask.pixels() == 0 {
        return Err(Diagnostic::error(
            "the pictures have no pixel in common that counts",
        ));
    }
    let tones = tone::fit(new, &old, &mask, options.matching);
    let mut matched = old.clone();
    // The new picture's levels are clipped at black and white, so the old one's are too; an EXR's
    // are clipped at its brightest value.
    let brightest = new.channels.iter().flat_map(|c| c.values.iter());
    let white = brightest.fold(1.0_f32, |a, &b| a.max(b));
    for (channel, tone) in matched.channels.iter_mut().zip(tones) {
        let clipped = |v: f32| {
            let v = tone.apply(v);
            if tone == Tone::IDENTITY {
                v
            } else {
                v.clamp(0.0, white)
            }
        };
        *channel = channel.map(clipped);
    }
    let measures = measure(new, &old, &matched, &mask, options.pixels_per_degree);
    Ok(Comparison {
        width,
        height,
        pixels: mask.pixels(),
        not_finite: selected - mask.pixels(),
        alignment,
        tones,
        measures,
        new: new.clone(),
        old: matched,
        mask,
    })
}

/// Maps the old picture to the new one's pixels; the mask has the pixels that it covers.
fn register(
    new: &Plate,
    old: &Plate,
    registration: Registration,
) -> Result<(Plate, Option<Alignment>, Mask)> {
    let (width, height) = (new.width, new.height);
    let everywhere = Mask::all(width, height);
    let is_same_size = (old.width, old.height) == (width, height);
    let stays = is_same_size && registration != Registration::Align;
    if let Some(finite) = old.finite.as_ref().filter(|_| !stays) {
        let number = finite.iter().filter(|is_finite| !**is_finite).count();
        let pixels = counted(number, "pixel");
        let text = format!("the old picture has {pixels} of values that are not finite");
        let help = "only a picture of the new one's size can have such pixels, without `--align`";
        return Err(Diagnostic::unsupported(text).with_help(help));
    }
    match registration {
        Registration::Align => {
            let aligned = align::align(new, old)?;
            let (old, shared) = warp::resample(&aligned.old, aligned.warp, width, height);
            Ok((old, Some(aligned.alignment), shared))
        }
        _ if is_same_size => Ok((old.clone(), None, everywhere)),
        Registration::Resize if same_aspect(new, old) => {
            Ok((old.map(|p| p.resized(width, height)), None, everywhere))
        }
        _ => {
            let help = if same_aspect(new, old) {
                "`--resize` stretches the old picture to the new one's size; `--align` also finds \
                 shift, scale and rotation"
            } else {
                "their aspects differ too: `--align` finds the shift, scale and rotation between \
                 them"
            };
            Err(Diagnostic::error(format!(
                "the new picture is {width}x{height}, the old one {}x{}",
                old.width, old.height
            ))
            .with_help(help))
        }
    }
}

/// Returns whether scaling one to the other distorts by at most a pixel.
fn same_aspect(new: &Plate, old: &Plate) -> bool {
    let height = new.width as f64 * old.height as f64 / old.width as f64;
    (height - new.height as f64).abs() <= 1.0
}

fn measure(
    new: &Plate,
    old: &Plate,
    matched: &Plate,
    mask: &Mask,
    pixels_per_degree: f64,
) -> Measures {
    let mse = metric::mse(new, matched, mask);
    let unmatched_mse = metric::mse(new, old, mask);
    // SSIM's authors average over the windows within the picture.
    let interior = mask.eroded(metric::SSIM_RADIUS);
    let windows = if interior.pixels() > 0 {
        &interior
    } else {
        mask
    };
    // The old picture has the new one's tones, or is compared as if it had them.
    let is_light = new.is_light;
    let [new, matched] = [new, matched].map(|plate| mask.extended(plate));
    let [a, b] = [&new, &matched].map(|p| edges::EdgeMap::of(&p.luma()).within(mask));
    Measures {
        mse,
        psnr: metric::psnr(mse),
        ssim: windows.mean(&metric::ssim(&new, &matched)),
        flip: mask.mean(&flip::flip(&new, &matched, is_light, pixels_per_degree)),
        // The outside creates edges at the border, so those there need no counterpart.
        edges: edges::distance(&a, &b, &mask.eroded(2)),
        unmatched_mse,
        unmatched_psnr: metric::psnr(unmatched_mse),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns stripes and checks in integer levels. The old picture has grain and a box that the
    /// new one lacks.
    fn picture(old: bool) -> Plate {
        let level = |x: usize, y: usize, c: usize| {
            let grain = (x * x + 3 * y * y + x * y * (c + 1)) % 7;
            let foreign = (10..20).contains(&x) && (12..30).contains(&y);
            let plain = 60 + x * 2 + (x / 8 + y / 6 + c) % 3 * 40;
            let level = match (old, foreign) {
                (true, true) => [230, 40, 90][c],
                (true, false) => plain + grain,
                _ => plain,
            };
            level.min(255) as f32 / 255.0
        };
        Plate::from_planes(
            [0, 1, 2].map(|c| crate::plane::Plane::from_fn(64, 48, |x, y| level(x, y, c))),
        )
    }

    #[test]
    fn pixels_that_are_not_finite_do_not_count() {
        let (mut new, old) = (picture(false), picture(true));
        let mut finite = vec![true; 64 * 48];
        finite[..32].fill(false);
        new.finite = Some(finite);
        let found = compare(&new, &old, &Options::default()).unwrap();
        assert_eq!((found.pixels, found.not_finite), (64 * 48 - 32, 32));
        let aligned = Options {
            registration: Registration::Align,
            ..Options::default()
        };
        let error = compare(&old, &new, &aligned).unwrap_err();
        assert!(error.message.contains("32 pixels"), "{}", error.message);
    }

    /// The values are from flip-evaluator 1.7 (the authors' program, for displays) and from
    /// scikit-image 0.26 on the brightness 0.299 R + 0.587 G + 0.114 B.
    #[test]
    fn mse_ssim_and_flip_are_those_of_the_authors_programs() {
        let options = Options {
            matching: Matching::None,
            ..Options::default()
        };
        let m = compare(&picture(false), &picture(true), &options)
            .unwrap()
            .measures;
        assert!((m.mse - 0.007_081_916_6).abs() < 1e-8, "{m:?}");
        assert!((m.ssim - 0.906_137_42).abs() < 1e-5, "{m:?}");
        assert!((m.flip - 0.144_454_20).abs() < 1e-5, "{m:?}");
        let map = flip::flip(
            &picture(false),
            &picture(true),
            false,
            flip::PIXELS_PER_DEGREE,
        );
        for ((x, y), value) in [
            ((15, 20), 0.929_449_7),
            ((40, 5), 0.089_828_35),
            ((10, 12), 0.532_113_25),
        ] {
            assert!((map.at(x, y) - value).abs() < 1e-4, "{}", map.at(x, y));
        }
    }

    /// The old pictures differ outside of the crop, and one of the masks has a hole.
    #[test]
    fn pixels_that_do_not_count_change_no_measure_and_a_crop_has_those_of_the_cropped_pictures() {
        let part = |plate: &Plate| {
            plate.map(|p| crate::plane::Plane::from_fn(40, 30, |x, y| p.at(x + 7, y + 9)))
        };
        let mut crop = Mask::all(64, 48);
        for (i, counts) in crop.counts.iter_mut().enumerate() {
            *counts = (7..47).contains(&(i % 64)) && (9..39).contains(&(i / 64));
        }
        let mut hole = crop.clone();
        hole.counts[20 * 64 + 20..20 * 64 + 30].fill(false);
        let measured = |new: &Plate, old: &Plate, mask: Option<&Mask>| {
            let options = Options {
                mask: mask.cloned(),
                ..Options::default()
            };
            compare(new, old, &options).unwrap().measures
        };
        let (new, old) = (picture(false), picture(true));
        for mask in [&crop, &hole] {
            let outside = old.map(|p| {
                crate::plane::Plane::from_fn(64, 48, |x, y| match mask.counts[y * 64 + x] {
                    true => p.at(x, y),
                    false => ((x * 3 + y) % 5) as f32 / 5.0,
                })
            });
            let [a, b] = [&old, &outside].map(|old| measured(&new, old, Some(mask)));
            assert_eq!(a, b);
        }
        let [a, b] = [
            measured(&new, &old, Some(&crop)),
            measured(&part(&new), &part(&old), None),
        ];
        assert!((a.ssim - b.ssim).abs() < 1e-6, "{a:?} {b:?}");
        assert!((a.flip - b.flip).abs() < 1e-6, "{a:?} {b:?}");
        let [a, b] = [a, b].map(|m| m.edges.unwrap());
        assert!((a.mean - b.mean).abs() < 0.1, "{a:?} {b:?}");
    }

    #[test]
    fn equal_pictures_are_equal_in_every_measure() {
        let one = picture(true);
        let m = compare(&one, &one, &Options::default()).unwrap().measures;
        assert_eq!((m.mse, m.flip, m.psnr), (0.0, 0.0, f64::INFINITY));
        assert!((m.ssim - 1.0).abs() < 1e-6);
        assert_eq!(m.edges.unwrap().mean, 0.0);
        for metric in &METRICS {
            let perfect = (metric.get)(&m);
            assert!(metric.holds(perfect, perfect), "{}", metric.name);
        }
    }

    #[test]
    fn other_sizes_a_black_mask_and_a_mask_of_another_size_are_refused() {
        let one = picture(false);
        let half = one.map(|p| p.resized(32, 24));
        let refused = |old: &Plate, options: Options| {
            let error = compare(&one, old, &options).unwrap_err();
            format!("{} {}", error.message, error.help.unwrap_or_default())
        };
        assert!(refused(&half, Options::default()).contains("--resize"));
        let narrow = one.map(|p| p.resized(20, 48));
        assert!(refused(&narrow, Options::default()).contains("--align"));
        let mut mask = Mask::all(64, 48);
        mask.counts.fill(false);
        let black = Options {
            mask: Some(mask),
            ..Options::default()
        };
        assert!(refused(&one, black).contains("no pixel"));
        let small = Options {
            mask: Some(Mask::all(8, 8)),
            ..Options::default()
        };
        assert!(refused(&one, small).contains("8x8"));
        let resize = Options {
            registration: Registration::Resize,
            ..Options::default()
        };
        assert!(compare(&one, &half, &resize).is_ok());
    }

    #[test]
    fn another_gamma_and_gain_are_an_error_only_before_matching() {
        let new = picture(false);
        let old = new.map(|p| p.map(|v| libm::powf((v - 0.05) / 0.95, 1.7)));
        let m = compare(&new, &old, &Options::default()).unwrap().measures;
        assert!(m.psnr > 70.0 && m.unmatched_psnr < 20.0, "{m:?}");
    }

    #[test]
    fn light_brighter_than_white_is_matched_too() {
        let new = picture(false).map(|p| p.map(|v| 3.0 * v));
        let old = new.map(|p| p.map(|v| 0.5 * v));
        let m = compare(&new, &old, &Options::default()).unwrap().measures;
        assert!(m.psnr > 60.0 && m.unmatched_psnr < 10.0, "{m:?}");
    }
}
