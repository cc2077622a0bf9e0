//! Rays into the scene: a single ray, a packet, and a batch of packets.

use glam::DVec3;
use ivcam_base::math::lanes::{LANES, Lane, Lanes, Vec3Lanes, bits};

use super::tint::MatrixLanes;
use crate::bvh::RayPacket;

/// Meters in a millimeter.
pub(super) const METERS_FROM_MM: f64 = 1e-3;

/// A packet with at least this many rays keeps its empty lanes. The rays of a sparser one are moved
/// to consecutive lanes. No search is recorded: a larger value copies more rays, and a smaller one
/// traces more empty lanes.
const COMPACT_BELOW: u32 = 24;

/// A ray into the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraRay {
    /// A point of the ray, in meters from the scene's origin.
    pub origin: DVec3,
    /// The direction in the scene.
    pub direction: DVec3,
    /// The factor of the radiance along the ray. The mean of the product over all samples,
    /// including lost ones, is the exposure; that of radiance 1 on the axis is 1.
    pub weight: f64,
}

/// Rays that leave a lens, one in each lane, in meters from the scene's origin.
#[derive(Clone, Debug, Default)]
pub(crate) struct ExitRays {
    /// The rays, with a mask of the lanes in use.
    pub rays: RayPacket,
    /// The factor of the radiance along each ray, as [`CameraRay::weight`] defines it.
    pub weights: Lane,
    /// The number of each ray's sample.
    pub samples: Lanes<u32>,
    /// The film's response to each ray relative to its weight, if coatings tint the light.
    pub tint: Option<Box<MatrixLanes>>,
}

impl ExitRays {
    /// The origin and the direction of one lane.
    #[inline(always)]
    pub(crate) fn ray(&self, lane: usize) -> ([f32; 3], [f32; 3]) {
        let lane_of = |v: &Vec3Lanes| [v[0][lane], v[1][lane], v[2][lane]];
        (lane_of(&self.rays.origin), lane_of(&self.rays.direction))
    }

    /// Sets the origin and the direction of one lane, and its weight.
    #[inline(always)]
    fn set(&mut self, lane: usize, (origin, direction): ([f32; 3], [f32; 3]), weight: f64) {
        for axis in 0..3 {
            self.rays.origin[axis][lane] = origin[axis];
            self.rays.direction[axis][lane] = direction[axis];
        }
        self.weights[lane] = weight;
    }
}

/// A factor of the radiance along a ray, at one wavelength.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ColorFactor {
    /// The number of the ray's lane in the batch.
    pub number: u32,
    /// The number of the wavelength among those of all hero sets.
    pub line: u32,
    /// The factor of the wavelength's color.
    pub factor: f64,
}

/// A batch of rays into the scene, in packets, each with the number of its sample.
#[derive(Clone, Debug, Default)]
pub(crate) struct CameraRays {
    packets: Vec<ExitRays>,
    /// The number of lanes in use, with or without a ray.
    len: usize,
    /// What is added to the factors of the radiances along some rays. A ray of another wavelength
    /// has the weight 0.
    pub colors: Vec<ColorFactor>,
    /// The number of samples whose first ray got through the lens.
    pub passed: usize,
}

impl CameraRays {
    /// Whether no lane is in use.
    pub(crate) fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The packets in use.
    pub(crate) fn packets(&self) -> &[ExitRays] {
        &self.packets[..self.len.div_ceil(LANES)]
    }

    /// Removes all rays and keeps the memory.
    pub(super) fn clear(&mut self) {
        self.len = 0;
        self.colors.clear();
        self.passed = 0;
    }

    /// Makes room for the rays of samples, each in the lane of the sample's number, without a ray.
    pub(super) fn reserve(&mut self, samples: usize) {
        for number in 0..samples.div_ceil(LANES) {
            let packet = self.packet(number);
            packet.rays.mask = 0;
            packet.samples = std::array::from_fn(|lane| (number * LANES + lane) as u32);
        }
        self.len = samples;
    }

    /// Sets the ray of a sample for which there is room.
    #[inline(always)]
    pub(super) fn set(&mut self, sample: usize, ray: ([f32; 3], [f32; 3]), weight: f64) {
        let (to, lane) = (&mut self.packets[sample / LANES], sample % LANES);
        to.set(lane, ray, weight);
        to.rays.mask |= 1 << lane;
    }

    /// The packet of a lane of the batch, and its lane there.
    #[inline(always)]
    pub(crate) fn lane(&self, number: u32) -> (&ExitRays, usize) {
        let number = number as usize;
        (&self.packets[number / LANES], number % LANES)
    }

    /// Appends the ray of a sample.
    pub(super) fn push(&mut self, sample: usize, ray: &CameraRay) {
        let (o, d) = (ray.origin.as_vec3(), ray.direction.as_vec3());
        self.put(sample as u32, (o.to_array(), d.to_array()), ray.weight);
        self.passed += 1;
    }

    /// Appends a ray at one wavelength, by the number among those of all hero sets.
    #[inline(always)]
    pub(super) fn push_colored(
        &mut self,
        sample: u32,
        ray: ([f32; 3], [f32; 3]),
        line: u32,
        factor: f64,
    ) {
        self.colors.push(ColorFactor {
            number: self.len as u32,
            line,
            factor,
        });
        self.put(sample, ray, 0.0);
    }

    /// Appends the ray of a sample, whose radiance has a weight as its factor.
    #[inline(always)]
    pub(super) fn put(&mut self, sample: u32, ray: ([f32; 3], [f32; 3]), weight: f64) {
        let lane = self.len % LANES;
        let to = self.packet(self.len / LANES);
        to.set(lane, ray, weight);
        to.rays.mask = (to.rays.mask & ((1 << lane) - 1)) | 1 << lane;
        to.samples[lane] = sample;
        self.len += 1;
    }

    /// The packet of a number, which is at most the number of packets.
    fn packet(&mut self, number: usize) -> &mut ExitRays {
        if number == self.packets.len() {
            self.packets.push(ExitRays::default());
        }
        &mut self.packets[number]
    }

    /// The first packet without rays. After it has been filled, [`Self::accept`] or
    /// [`Self::append_filled`] must be called.
    pub(super) fn next_packet(&mut self) -> &mut ExitRays {
        self.packet(self.len.div_ceil(LANES))
    }

    /// Adds the packet that was filled, whose lanes belong to the samples from number `sample` on.
    pub(super) fn accept(&mut self, sample: usize) {
        let next = self.len.div_ceil(LANES);
        let packet = self.packet(next);
        let (passed, first) = (packet.rays.mask.count_ones(), sample as u32);
        packet.samples = std::array::from_fn(|lane| first + lane as u32);
        self.passed += passed as usize;
        if passed < COMPACT_BELOW {
            self.append_filled(|lane| first + lane as u32);
        } else {
            self.len = (next + 1) * LANES;
        }
    }

    /// Appends the rays of the packet that was filled to consecutive lanes. They are not counted in
    /// `passed`. `sample` returns the sample of a lane.
    pub(super) fn append_filled(&mut self, sample: impl Fn(usize) -> u32) {
        let filled = self.len.div_ceil(LANES);
        let live = self.packet(filled).rays.mask;
        // A ray moves to its own lane or to one before it, so none is overwritten.
        for lane in bits(live) {
            let from = &self.packets[filled];
            let (ray, weight) = (from.ray(lane), from.weights[lane]);
            let tint = from.tint.as_ref();
            let tint = tint.map(|tint| tint.each_ref().map(|all| all[lane]));
            self.put(sample(lane), ray, weight);
            if let Some(tint) = tint {
                let last = self.len - 1;
                let to = self.packets[last / LANES].tint.get_or_insert_default();
                for (entries, entry) in to.iter_mut().zip(tint) {
                    entries[last % LANES] = entry;
                }
            }
        }
    }
}
