//! Places on the globe: Coin's `GeoOrigin`, `GeoSeparator` and `GeoCoordinate`.
//!
//! A place has a frame whose x points east, y north, and z away from the center of the earth. The
//! scene is in the frame of the last `GeoOrigin`, in meters. The earth is the ellipsoid of WGS 84.

use glam::{DMat4, DVec3, DVec4};

use super::state::{Coordinates, State};
use crate::grammar::{geo_coordinate, geo_origin, geo_separator};
use crate::iv::NodeRef;

/// The semi-major axis of the ellipsoid of WGS 84 in meters, and its flattening.
const AXIS: f64 = 6_378_137.0;
const FLATTENING: f64 = 1.0 / 298.257_223_563;

/// What the three numbers of a place are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GeoSystem {
    /// Meters from the center of the earth: x to longitude 0, z to the north pole.
    Geocentric,
    /// Latitude and longitude in degrees, and meters above the ellipsoid.
    Geodetic,
    /// Easting and northing of a zone of the universal transverse Mercator projection, and meters
    /// above the ellipsoid.
    Utm {
        /// The zone, from 1 to 60.
        zone: u8,
        /// Whether northings are those of the southern hemisphere.
        south: bool,
    },
}

impl GeoSystem {
    /// Returns the system that a field `geoSystem` names. Returns `None` for one that is not known,
    /// and for other ellipsoids.
    pub fn of(words: &[String]) -> Option<Self> {
        let (first, rest) = words.split_first()?;
        let is_other_ellipsoid = |word: &String| {
            word.len() == 2 && word != "WE" && word.bytes().all(|b| b.is_ascii_uppercase())
        };
        if rest.iter().any(is_other_ellipsoid) {
            return None;
        }
        match first.as_str() {
            "GC" | "GCC" => Some(Self::Geocentric),
            "GD" | "GDC" => Some(Self::Geodetic),
            "UTM" => {
                let zone = |word: &String| word.strip_prefix(['Z', 'z'])?.parse().ok();
                let zone = rest.iter().find_map(zone)?;
                let south = rest.iter().any(|word| word == "S");
                (1..=60)
                    .contains(&zone)
                    .then_some(Self::Utm { zone, south })
            }
            _ => None,
        }
    }

    /// Returns a place in meters from the center of the earth.
    fn geocentric(self, place: DVec3) -> DVec3 {
        match self {
            Self::Geocentric => place,
            Self::Geodetic => on_ellipsoid(place.x.to_radians(), place.y.to_radians(), place.z),
            Self::Utm { zone, south } => {
                let northing = if south { place.y - 1e7 } else { place.y };
                let (latitude, from_middle) = unprojected(place.x - 5e5, northing);
                let middle = (6.0 * f64::from(zone) - 183.0).to_radians();
                on_ellipsoid(latitude, middle + from_middle, place.z)
            }
        }
    }

    /// Returns the matrix from the frame of a place to the earth's.
    fn frame(self, place: DVec3) -> DMat4 {
        let at = self.geocentric(place);
        let up = at.normalize_or(DVec3::Z);
        let east = DVec3::Z.cross(up).normalize_or(DVec3::Y);
        let north = up.cross(east);
        let column = |v: DVec3| v.extend(0.0);
        DMat4::from_cols(column(east), column(north), column(up), at.extend(1.0))
    }
}

/// Returns the place of a latitude and a longitude in radians, and a height in meters.
fn on_ellipsoid(latitude: f64, longitude: f64, height: f64) -> DVec3 {
    let squared_eccentricity = FLATTENING * (2.0 - FLATTENING);
    let (sin, cos) = libm::sincos(latitude);
    let radius = AXIS / (1.0 - squared_eccentricity * sin * sin).sqrt();
    let (east, ahead) = libm::sincos(longitude);
    let across = (radius + height) * cos;
    let up = (radius * (1.0 - squared_eccentricity) + height) * sin;
    DVec3::new(across * ahead, across * east, up)
}

/// Returns the latitude and the longitude from the middle of the zone, in radians, of meters east
/// of the middle and north of the equator: Krüger's series (Karney, "Transverse Mercator with an
/// accuracy of a few nanometers", J. Geodesy 85, 2011) up to the fourth power of the third
/// flattening, which is exact to micrometers in a zone.
fn unprojected(easting: f64, northing: f64) -> (f64, f64) {
    const SCALE: f64 = 0.9996;
    let n = FLATTENING / (2.0 - FLATTENING);
    let powers = DVec4::new(n, n * n, n * n * n, n * n * n * n);
    let series = |a: f64, b: f64, c: f64, d: f64| DVec4::new(a, b, c, d).dot(powers);
    let radius = AXIS / (1.0 + n) * (1.0 + powers.y / 4.0 + powers.w / 64.0);
    let (xi, eta) = (northing / (SCALE * radius), easting / (SCALE * radius));
    let (mut north, mut east) = (xi, eta);
    let terms = [
        series(1.0 / 2.0, -2.0 / 3.0, 37.0 / 96.0, -1.0 / 360.0),
        series(0.0, 1.0 / 48.0, 1.0 / 15.0, -437.0 / 1440.0),
        series(0.0, 0.0, 17.0 / 480.0, -37.0 / 840.0),
        series(0.0, 0.0, 0.0, 4397.0 / 161_280.0),
    ];
    for (term, multiple) in terms.into_iter().zip([2.0, 4.0, 6.0, 8.0]) {
        let (sin, cos) = libm::sincos(multiple * xi);
        north -= term * sin * libm::cosh(multiple * eta);
        east -= term * cos * libm::sinh(multiple * eta);
    }
    let conformal = libm::asin(libm::sin(north) / libm::cosh(east));
    let terms = [
        series(2.0, -2.0 / 3.0, -2.0, 116.0 / 45.0),
        series(0.0, 7.0 / 3.0, -8.0 / 5.0, -227.0 / 45.0),
        series(0.0, 0.0, 56.0 / 15.0, -136.0 / 35.0),
        series(0.0, 0.0, 0.0, 4279.0 / 630.0),
    ];
    let more = terms.into_iter().zip([2.0, 4.0, 6.0, 8.0]);
    let latitude = more.fold(conformal, |sum, (term, multiple)| {
        sum + term * libm::sin(multiple * conformal)
    });
    (latitude, libm::atan2(libm::sinh(east), libm::cos(north)))
}

/// The place that is the scene's origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GeoOrigin {
    system: GeoSystem,
    place: DVec3,
    /// Whether the scene has the axes of the projection (`FLAT`).
    flat: bool,
    scene_from_earth: DMat4,
}

impl GeoOrigin {
    fn new(system: GeoSystem, place: DVec3, flat: bool) -> Self {
        Self {
            system,
            place,
            flat,
            scene_from_earth: system.frame(place).inverse(),
        }
    }

    /// Returns the matrix from the frame of a place to the scene.
    fn frame(&self, system: GeoSystem, place: DVec3) -> DMat4 {
        match self.flat && system == self.system {
            true => DMat4::from_translation(place - self.place),
            false => self.scene_from_earth * system.frame(place),
        }
    }
}

/// Points of a `GeoCoordinate`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GeoPoints<'a> {
    /// Three numbers for each point.
    numbers: &'a [f64],
    system: GeoSystem,
    origin: GeoOrigin,
}

impl GeoPoints<'_> {
    /// The number of points.
    pub(super) fn len(&self) -> usize {
        self.numbers.len() / 3
    }

    /// Returns a point in the scene, in meters.
    pub(super) fn get(&self, index: usize) -> Option<DVec3> {
        let place = triple(self.numbers, index)?;
        Some(self.origin.frame(self.system, place).w_axis.truncate())
    }

    /// Whether both are the same list of the document.
    pub(super) fn is_like(&self, other: &Self) -> bool {
        std::ptr::eq(self.numbers, other.numbers)
            && (self.system, self.origin) == (other.system, other.origin)
    }
}

/// Returns a point of a list of numbers.
fn triple(numbers: &[f64], index: usize) -> Option<DVec3> {
    let first = index.checked_mul(3)?;
    numbers
        .get(first..first.checked_add(3)?)
        .map(DVec3::from_slice)
}

/// Applies a `GeoOrigin`.
pub(super) fn origin<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    let words = node.get(geo_origin::GEO_SYSTEM);
    let place = triple(node.get(geo_origin::GEO_COORDS), 0);
    if let (Some(system), Some(place)) = (GeoSystem::of(words), place) {
        let flat = words.iter().any(|word| word == "FLAT");
        state.geo_origin = Some(GeoOrigin::new(system, place, flat));
    }
}

/// Applies a `GeoCoordinate`. Without a `GeoOrigin` its first point is the scene's origin.
pub(super) fn coordinate<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    let numbers = node.get(geo_coordinate::POINT);
    let system = GeoSystem::of(node.get(geo_coordinate::GEO_SYSTEM));
    if let (Some(system), Some(first)) = (system, triple(numbers, 0)) {
        let own = || GeoOrigin::new(system, first, false);
        state.coordinates = Coordinates::Geo(GeoPoints {
            numbers,
            system,
            origin: state.geo_origin.unwrap_or_else(own),
        });
    }
}

/// Returns the matrix of a `GeoSeparator` to the scene; that of its own frame without a
/// `GeoOrigin`.
pub(super) fn separator(state: &State<'_>, node: NodeRef<'_>) -> DMat4 {
    let system = GeoSystem::of(node.get(geo_separator::GEO_SYSTEM));
    let place = triple(node.get(geo_separator::GEO_COORDS), 0);
    match (state.geo_origin, system, place) {
        (Some(origin), Some(system), Some(place)) => origin.frame(system, place),
        _ => DMat4::IDENTITY,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn system(words: &[&str]) -> Option<GeoSystem> {
        GeoSystem::of(&words.iter().map(|w| (*w).to_owned()).collect::<Vec<_>>())
    }

    #[test]
    fn systems_that_are_not_known_are_none() {
        let south = GeoSystem::Utm {
            zone: 10,
            south: true,
        };
        assert_eq!(system(&["GD", "WE"]), Some(GeoSystem::Geodetic));
        assert_eq!(system(&["UTM", "Z10", "S"]), Some(south));
        for words in [&["GD", "AA"][..], &["UTM"], &["UTM", "Z61"], &["XY"], &[]] {
            assert_eq!(system(words), None, "{words:?}");
        }
    }

    /// The quarter of a meridian is 10,001,965.729 m long and its half 4,984,944.378 m (WGS 84).
    /// The last place is that of the Eiffel tower by both systems, known to some meters.
    #[test]
    fn northings_are_the_scaled_lengths_of_the_meridian() {
        for (length, degrees) in [(0.0, 0.0), (4_984_944.378, 45.0), (10_001_965.729, 90.0)] {
            let (latitude, longitude) = unprojected(0.0, 0.9996 * length);
            assert!((latitude.to_degrees() - degrees).abs() < 1e-8, "{degrees}");
            assert!(longitude.abs() < 1e-12 || degrees == 90.0);
        }
        let utm = GeoSystem::Utm {
            zone: 31,
            south: false,
        };
        let tower = utm.geocentric(DVec3::new(448_252.0, 5_411_933.0, 0.0));
        let by_angles = GeoSystem::Geodetic.geocentric(DVec3::new(48.8582, 2.2945, 0.0));
        assert!((tower - by_angles).length() < 10.0);
    }

    #[test]
    fn the_frame_of_a_place_points_east_north_and_up() {
        let equator = GeoSystem::Geodetic.frame(DVec3::new(0.0, 90.0, 10.0));
        let axes = [
            equator.x_axis,
            equator.y_axis,
            equator.z_axis,
            equator.w_axis,
        ];
        let expected = [-DVec3::X, DVec3::Z, DVec3::Y, DVec3::Y * (AXIS + 10.0)];
        for (axis, expected) in axes.into_iter().zip(expected) {
            assert!((axis.truncate() - expected).length() < 1e-8);
        }
        let pole = GeoSystem::Geodetic.geocentric(DVec3::new(90.0, 0.0, 0.0));
        assert!((pole - DVec3::Z * AXIS * (1.0 - FLATTENING)).length() < 1e-8);
    }
}
