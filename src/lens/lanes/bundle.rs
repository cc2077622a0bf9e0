//! A bundle of rays, component by component.

use glam::DVec3;

use crate::lens::trace::ray::{LensRay, Loss, LossKind};
use crate::math::lanes::{LANES, Lane};

/// A bundle of rays, component by component. Directions must be of unit length.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(crate) struct Bundle {
    pub x: Lane,
    pub y: Lane,
    pub z: Lane,
    pub dx: Lane,
    pub dy: Lane,
    pub dz: Lane,
    /// 0 for a ray that is not lost, else a code: see [`Bundle::loss`]. It is a float, which vectors of
    /// every width can compare.
    pub(super) lost: Lane,
    /// Without apertures: the square of the largest share of a semi-diameter used so far, and
    /// the surface it is used at.
    pub(super) fill: Lane,
    limit: [u64; LANES],
}

/// The fills of a bundle, and the number of the surface or edge that limits each.
pub(crate) struct Fills {
    pub fill: Lane,
    pub limit: [u64; LANES],
}

impl Default for Bundle {
    /// All lanes empty: rays already lost.
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

pub(super) const MISSED: u64 = 1;
pub(super) const BLOCKED: u64 = 2;
pub(super) const REFLECTED: u64 = 3;
/// A lane that never held a ray.
pub(super) const EMPTY: f64 = -1.0;

impl Bundle {
    /// Puts a ray, with a direction of unit length, into a lane.
    pub(crate) fn set(&mut self, lane: usize, ray: &LensRay) {
        self.put(lane, ray);
        self.lost[lane] = 0.0;
        self.fill[lane] = 0.0;
    }

    /// The fills of a bundle that was traced without apertures; infinite for a ray that is lost for
    /// another reason.
    pub(super) fn fills(&self) -> Fills {
        let lost = |lane: usize| self.lost[lane] != 0.0;
        let by = |lane: usize| {
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
            limit: std::array::from_fn(|lane| by(lane) >> 2),
        }
    }

    /// Starts the rays in all lanes, whose directions must be of unit length.
    #[inline(always)]
    pub(crate) fn start(&mut self) {
        self.lost = [0.0; LANES];
        self.fill = [0.0; LANES];
    }

    pub(super) fn put(&mut self, lane: usize, ray: &LensRay) {
        [self.x[lane], self.y[lane], self.z[lane]] = ray.origin.to_array();
        [self.dx[lane], self.dy[lane], self.dz[lane]] = ray.direction.to_array();
    }

    /// Keeps the largest fill of a lane that is on its way.
    #[inline(always)]
    pub(super) fn note_fill(&mut self, lane: usize, fill: f64, number: u64) {
        let more = (fill > self.fill[lane]) & (self.lost[lane] == 0.0);
        self.fill[lane] = if more { fill } else { self.fill[lane] };
        self.limit[lane] = if more { number } else { self.limit[lane] };
    }

    /// Empties a lane.
    pub(crate) fn clear(&mut self, lane: usize) {
        self.lost[lane] = EMPTY;
    }

    pub(crate) fn ray(&self, lane: usize) -> LensRay {
        LensRay {
            origin: DVec3::new(self.x[lane], self.y[lane], self.z[lane]),
            direction: DVec3::new(self.dx[lane], self.dy[lane], self.dz[lane]),
        }
    }

    /// The lanes that hold a ray that was not lost: bits.
    pub(crate) fn through(&self) -> u32 {
        let lanes = self.lost.iter().enumerate();
        lanes.fold(0, |all, (lane, lost)| all | u32::from(*lost == 0.0) << lane)
    }

    /// Whether the lane holds a ray that was not lost.
    pub(crate) fn passed(&self, lane: usize) -> bool {
        self.lost[lane] == 0.0
    }

    /// Why the ray of a lane was lost; none if it was not, or if the lane is empty.
    pub(crate) fn loss(&self, lane: usize) -> Option<Loss> {
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
