//! Pictures and inlined scenes in place of the suite's own, so that right colors are known.

use image::{ImageBuffer, Luma, LumaA, PixelWithColorType, Rgb, Rgba};

use super::folder::Folder;

/// The pixels along the side of a stand-in picture.
const SIDE: u32 = 64;

/// The levels of a picture's lower left, lower right, upper left and upper right quarter.
type Quarters<T> = [T; 4];

/// The suite's logo, in color: red, green; blue, yellow.
const COLORS: Quarters<Rgb<u8>> = [
    Rgb([255, 0, 0]),
    Rgb([0, 255, 0]),
    Rgb([0, 0, 255]),
    Rgb([255, 255, 0]),
];
/// The logo in gray.
const GRAYS: Quarters<Luma<u8>> = [Luma([255]), Luma([192]), Luma([128]), Luma([64])];
/// The logo in gray whose left half is transparent.
const CLEAR_GRAYS: Quarters<LumaA<u8>> = [
    LumaA([255, 0]),
    LumaA([255, 255]),
    LumaA([128, 0]),
    LumaA([128, 255]),
];
/// The logo in color whose left half is transparent.
const CLEAR_COLORS: Quarters<Rgba<u8>> = [
    Rgba([255, 0, 0, 0]),
    Rgba([0, 255, 0, 255]),
    Rgba([0, 0, 255, 0]),
    Rgba([255, 255, 0, 255]),
];

/// Pictures of one color: the faces of a cube, the sides of a panorama, and wood.
const PLAIN: [(&str, [u8; 3]); 14] = [
    ("front.jpg", [255, 0, 0]),
    ("right.jpg", [0, 255, 0]),
    ("rear.jpg", [0, 0, 255]),
    ("left.jpg", [255, 255, 0]),
    ("top.jpg", [0, 255, 255]),
    ("bottom.jpg", [255, 0, 255]),
    ("sky1.jpg", [40, 80, 200]),
    ("sky2.png", [200, 160, 40]),
    ("mt-humphreys.jpg", [200, 40, 40]),
    ("lostlakes.jpg", [40, 200, 40]),
    ("mt-huxley.jpg", [40, 40, 200]),
    ("mt-whitney.jpg", [200, 200, 40]),
    ("oak.jpg", [160, 110, 60]),
    ("bricks.jpg", [160, 60, 40]),
];

/// Inlined scenes: the levels of detail are boxes, each of its own color, and three balls in a row
/// are two in one scene, which inlines the third. They are VRML97 under both endings, as the first
/// line says.
const SCENES: [(&str, &str); 6] = [
    ("ref1", "1 0 0"),
    ("ref2", "0 1 0"),
    ("ref3", "0 0 1"),
    ("ref4", "1 1 0"),
    (
        "in1",
        "Transform { translation -3 0 0 children BALL(1 0 0) } Viewpoint { position 0 0 5 }",
    ),
    (
        "in2",
        "BALL(0 1 0) Transform { translation 3 0 0 children BALL(0 0 1) } Inline { url \"in1.wrl\" }",
    ),
];

/// Writes all stand-ins into a folder of scenes.
///
/// # Errors
/// A file cannot be written.
pub(super) fn write(folder: &Folder) -> Result<(), String> {
    for name in ["vts.jpg", "rgb.png"] {
        picture(folder, name, COLORS)?;
    }
    for name in ["greyscalecolor.jpg", "greyscalecolor.png"] {
        picture(folder, name, GRAYS)?;
    }
    for name in ["greyscale_trans.png", "greyscale_alpha.png"] {
        picture(folder, name, CLEAR_GRAYS)?;
    }
    picture(folder, "rgb_alpha.png", CLEAR_COLORS)?;
    for (name, color) in PLAIN {
        picture(folder, name, [Rgb(color); 4])?;
    }
    for (name, text) in SCENES {
        let shape = |color: &str, geometry: &str| {
            format!(
                "Shape {{ appearance Appearance {{ material Material {{ diffuseColor 0 0 0 \
                 emissiveColor {color} }} }} geometry {geometry} }}"
            )
        };
        let body = match text.split_once("BALL(") {
            None => shape(text, "Box { size 8 8 2 }"),
            Some(_) => balls(text, |color| shape(color, "Sphere { }")),
        };
        let text = format!("#VRML V2.0 utf8\n{body}\n");
        for ending in ["x3d", "wrl"] {
            folder.write(&format!("{name}.{ending}"), text.as_bytes())?;
        }
    }
    Ok(())
}

/// Replaces each `BALL(color)` by a shape.
fn balls(text: &str, shape: impl Fn(&str) -> String) -> String {
    let mut parts = text.split("BALL(");
    let mut all = parts.next().unwrap_or_default().to_string();
    for part in parts {
        let (color, rest) = part.split_once(')').unwrap_or((part, ""));
        all.push_str(&shape(color));
        all.push_str(rest);
    }
    all
}

/// Writes a picture of four quarters, as PNG whatever its name.
fn picture<P>(folder: &Folder, name: &str, quarters: Quarters<P>) -> Result<(), String>
where
    P: PixelWithColorType<Subpixel = u8> + Copy + 'static,
{
    let image = ImageBuffer::from_fn(SIDE, SIDE, |x, y| {
        let (right, upper) = (x >= SIDE / 2, y < SIDE / 2);
        quarters[usize::from(right) + 2 * usize::from(upper)]
    });
    let mut bytes = std::io::Cursor::new(Vec::new());
    image
        .write_to(&mut bytes, image::ImageFormat::Png)
        .map_err(|e| e.to_string())?;
    folder.write(name, bytes.get_ref())
}
