//! A bundle of rays, stored component by component.

use glam::{DAffine3, DVec3};
use ivcam_base::math::lanes::{LANES, Lane};

use crate::lens::trace::ray::LensRay;
use crate::lens::trace::ray::{Loss, LossKind};

/// A bundle of rays in lens space, stored component by component. Directions must be of unit
/// length.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub struct Bundle {
    /// The x coordinates of the origins, in millimeters.
    pub x: Lane,
    /// The y coordinates of the origins, in millimeters.
    pub y: Lane,
    /// The z coordinates of the origins, in millimeters.
    pub z: Lane,
    /// The x components of the directions.
    pub dx: Lane,
    /// The y components of the directions.
    pub dy: Lane,
    /// The z components of the directions.
    pub dz: Lane,
    /// 0 for a ray that is not lost, else a code that [`Bundle::loss`] decodes. It is a float
    /// because vectors of every width can compare floats.
    pub(super) lost: Lane,
    /// The square of the fill so far, if the bundle is traced without apertures.
    pub(super) fill: Lane,
    /// The number of the surface or edge at which the fill occurs.
    limit: [u64; LANES],
}

/// The fills of a bundle, and the number of the surface or edge that limits each.
pub(crate) struct Fills {
    /// The largest ratio of a ray's height at a surface to the semi-diameter; below 1 it gets
    /// through.
    pub fill: Lane,
    /// The number of the surface, plus the number of an iris's edge times 2^30.
    pub limit: [u64; LANES],
}

impl Fills {
    /// The fills of rays that are all lost.
    pub(super) const LOST: Self = Self {
        fill: [f64::INFINITY; LANES],
        limit: [0; LANES],
    };
}

impl Default for Bundle {
    /// A bundle whose lanes are all empty: they count as lost rays.
    fn default() -> Self {
        let zero = [0.0; LANES];
        Self {
            x: zero,
            y: zero,
            z: zero,
            dx: zero,
            dy: zero,
            dz: [1.0; LANES],
            lost: [EMPTY; LANES],
            fill: zero,
            limit: [0; LANES],
        }
    }
}

/// The code in the two lowest bits for a ray that missed the surface.
pub(super) const MISSED: u64 = 1;
/// The code in the two lowest bits for a ray that hit the surface outside its aperture.
pub(super) const BLOCKED: u64 = 2;
/// The code in the two lowest bits for a ray that was totally reflected.
pub(super) const REFLECTED: u64 = 3;
/// The code of a lane without a ray.
pub(super) const EMPTY: f64 = -1.0;

impl Bundle {
    /// Puts a ray, with a direction of unit length, into a lane.
    pub fn set(&mut self, lane: usize, ray: &LensRay) {
        self.put(lane, ray);
        self.lost[lane] = 0.0;
        self.fill[lane] = 0.0;
    }

    /// The fills of a bundle that was traced without apertures. The fill of a lost ray is infinite.
    pub(super) fn fills(&self) -> Fills {
        let lost = |lane: usize| self.lost[lane] != 0.0;
        let limit = |lane: usize| {
            if lost(lane) {
                self.lost[lane] as u64
            } else {
                self.limit[lane]
            }
        };
        Fills {
            fill: std::array::from_fn(|lane| match lost(lane) {
                true => f64::INFINITY,
                false => self.fill[lane].sqrt(),
            }),
            limit: std::array::from_fn(|lane| limit(lane) >> 2),
        }
    }

    /// Marks all lanes as holding a ray. Their directions must be of unit length.
    #[inline(always)]
    pub fn start(&mut self) {
        self.lost = [0.0; LANES];
        self.fill = [0.0; LANES];
    }

    /// Sets the ray of a lane without changing whether it is lost.
    pub(super) fn put(&mut self, lane: usize, ray: &LensRay) {
        [self.x[lane], self.y[lane], self.z[lane]] = ray.origin.to_array();
        [self.dx[lane], self.dy[lane], self.dz[lane]] = ray.direction.to_array();
    }

    /// Keeps the larger squared fill of a lane whose ray is not lost, with the number of its
    /// surface.
    #[inline(always)]
    pub(super) fn note_fill(&mut self, lane: usize, fill: f64, number: u64) {
        let more = (fill > self.fill[lane]) & (self.lost[lane] == 0.0);
        self.fill[lane] = if more { fill } else { self.fill[lane] };
        self.limit[lane] = if more { number } else { self.limit[lane] };
    }

    /// Maps the origins and directions of all rays. It is no part of the kernel, because few lenses
    /// have decentered surfaces.
    #[cold]
    #[inline(never)]
    pub(super) fn map(&mut self, map: &DAffine3) {
        for lane in 0..LANES {
            let LensRay { origin, direction } = self.ray(lane);
            let (origin, direction) = (
                map.transform_point3(origin),
                map.transform_vector3(direction),
            );
            self.put(lane, &LensRay { origin, direction });
        }
    }

    /// Empties a lane.
    pub fn clear(&mut self, lane: usize) {
        self.lost[lane] = EMPTY;
    }

    /// The ray of a lane.
    pub fn ray(&self, lane: usize) -> LensRay {
        LensRay::new(
            DVec3::new(self.x[lane], self.y[lane], self.z[lane]),
            DVec3::new(self.dx[lane], self.dy[lane], self.dz[lane]),
        )
    }

    /// A mask of the lanes whose rays were not lost.
    pub fn through(&self) -> u32 {
        let lanes = self.lost.iter().enumerate();
        lanes.fold(0, |all, (lane, lost)| all | u32::from(*lost == 0.0) << lane)
    }

    /// Whether a lane holds a ray that was not lost.
    pub fn passed(&self, lane: usize) -> bool {
        self.lost[lane] == 0.0
    }

    /// The reason why the ray of a lane was lost; none if it was not, or if the lane is empty.
    pub fn loss(&self, lane: usize) -> Option<Loss> {
        if self.lost[lane] == EMPTY {
            return None;
        }
        let code = self.lost[lane] as u64;
        let kind = match code & 3 {
            MISSED => LossKind::Missed,
            BLOCKED => LossKind::Blocked,
            REFLECTED => LossKind::TotalReflection,
            _ => return None,
        };
        Some(Loss {
            kind,
            surface: (code >> 2) as usize,
        })
    }
}
