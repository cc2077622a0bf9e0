//! Many rays at once: what they meet, and whether light gets through.
//!
//! Rays of one course go through the tree as packets; the answers are those of one ray by itself,
//! bit by bit.

use glam::Vec3;

use super::wide::{Others, PACKET, Packet, bits, course};
use super::{Hit, PreparedRay, Ray, RenderScene};
use crate::math::lanes::{Lanewise, widely};

/// Rays in a bundle, at most.
pub const BUNDLE: usize = 32;

/// A number of every ray of a bundle.
pub type Side = [f32; BUNDLE];

/// A point or direction of every ray, axis by axis.
pub type Sides = [Side; 3];

/// A bundle of rays side by side.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct RayLanes {
    pub origin: Sides,
    /// Need not be of length 1; distances are in its lengths.
    pub direction: Sides,
    pub t_max: Side,
    /// Which lanes hold a ray: bits. The others' numbers mean nothing.
    pub mask: u32,
}

impl Default for RayLanes {
    fn default() -> Self {
        Self {
            origin: [[0.0; BUNDLE]; 3],
            direction: [[1.0; BUNDLE]; 3],
            t_max: [f32::INFINITY; BUNDLE],
            mask: 0,
        }
    }
}

impl RayLanes {
    pub fn ray(&self, lane: usize) -> Ray {
        Ray {
            t_max: self.t_max[lane],
            ..Ray::new(of_lane(&self.origin, lane), of_lane(&self.direction, lane))
        }
    }

    /// Takes a ray that begins at once.
    pub fn set(&mut self, lane: usize, ray: &Ray) {
        for axis in 0..3 {
            self.origin[axis][lane] = ray.origin[axis];
            self.direction[axis][lane] = ray.direction[axis];
        }
        self.t_max[lane] = ray.t_max;
        self.mask |= 1 << lane;
    }
}

/// The point or direction of one ray.
#[inline(always)]
pub fn of_lane(all: &Sides, lane: usize) -> Vec3 {
    Vec3::new(all[0][lane], all[1][lane], all[2][lane])
}

/// What the rays of a bundle meet, side by side.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct HitLanes {
    pub t: Side,
    pub u: Side,
    pub v: Side,
    pub primitive: [u32; BUNDLE],
    /// Which rays meet something: bits.
    pub mask: u32,
}

impl Default for HitLanes {
    fn default() -> Self {
        Self {
            t: [0.0; BUNDLE],
            u: [0.0; BUNDLE],
            v: [0.0; BUNDLE],
            primitive: [0; BUNDLE],
            mask: 0,
        }
    }
}

impl HitLanes {
    pub fn hit(&self, lane: usize) -> Option<Hit> {
        (self.mask >> lane & 1 == 1).then(|| Hit {
            t: self.t[lane],
            primitive: self.primitive[lane],
            u: self.u[lane],
            v: self.v[lane],
        })
    }

    fn set(&mut self, lane: usize, hit: Option<Hit>) {
        self.mask &= !(1 << lane);
        if let Some(hit) = hit {
            (self.t[lane], self.u[lane], self.v[lane]) = (hit.t, hit.u, hit.v);
            self.primitive[lane] = hit.primitive;
            self.mask |= 1 << lane;
        }
    }
}

impl Others for RenderScene {
    fn meet(&self, ray: &PreparedRay, primitive: u32, t_min: f32, t_max: f32) -> Option<f32> {
        RenderScene::meet(self, ray, primitive, t_min, t_max).map(|hit| hit.t)
    }
}

/// Shares the rays of a bundle out into packets of one course. `packet` gets the numbers of its
/// rays.
pub fn packets(rays: &[Ray], mut packet: impl FnMut(&[u8])) {
    let mut courses = [0; BUNDLE];
    for (course_of, ray) in courses.iter_mut().zip(rays) {
        *course_of = course(ray);
    }
    let count = rays.len().min(BUNDLE);
    // Most bundles are of one course.
    if courses[..count].iter().all(|course| *course == courses[0]) {
        const NUMBERS: [u8; BUNDLE] = numbers();
        packet(&NUMBERS[..count]);
        return;
    }
    let mut left = ((1u64 << count) - 1) as u32;
    while left != 0 {
        let first = courses[left.trailing_zeros() as usize];
        let (mut numbers, mut count) = ([0; PACKET], 0);
        for i in bits(left) {
            if courses[i] == first {
                numbers[count] = i as u8;
                count += 1;
                left &= !(1 << i);
            }
        }
        packet(&numbers[..count]);
    }
}

const fn numbers() -> [u8; BUNDLE] {
    let mut numbers = [0; BUNDLE];
    let mut i = 0;
    while i < BUNDLE {
        numbers[i] = i as u8;
        i += 1;
    }
    numbers
}

/// Whether all rays that a bundle holds are of one course: see [`course`].
struct OneCourse<'a>(&'a RayLanes);

impl Lanewise for OneCourse<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<const FUSED: bool>(self) -> bool {
        let Self(rays) = self;
        let [x, y, z] = &rays.direction;
        let mut courses = [0u32; BUNDLE];
        for i in 0..BUNDLE {
            let [a, b, c] = [x[i].abs(), y[i].abs(), z[i].abs()];
            let axis = if b > c { 8 } else { 16 };
            let axis = if (a > b) & (a > c) { 0 } else { axis };
            let negative = |d: f32, bit: u32| if d < 0.0 { bit } else { 0 };
            courses[i] = axis | negative(x[i], 1) | negative(y[i], 2) | negative(z[i], 4);
        }
        let first = courses[rays.mask.trailing_zeros() as usize & (BUNDLE - 1)];
        let mut differ = 0;
        for (i, course) in courses.iter().enumerate() {
            differ |= if rays.mask >> i & 1 == 1 {
                course ^ first
            } else {
                0
            };
        }
        differ == 0
    }
}

/// Has `work` done on packets of the rays of a bundle. It gets a packet and the lanes that its
/// rays are from.
fn in_packets(rays: &RayLanes, mut work: impl FnMut(&mut Packet, Lanes<'_>)) {
    let mut packet = Packet::empty();
    if rays.mask != 0 && widely(OneCourse(rays)) {
        packet.load(rays);
        work(&mut packet, Lanes::All);
        return;
    }
    let mut gathered = [Ray::new(Vec3::ZERO, Vec3::Z); BUNDLE];
    let mut from = [0; BUNDLE];
    let mut count = 0;
    for lane in bits(rays.mask) {
        gathered[count] = rays.ray(lane);
        from[count] = lane as u8;
        count += 1;
    }
    packets(&gathered[..count], |numbers| {
        packet.fill(numbers.iter().map(|&i| &gathered[usize::from(i)]));
        let mut lanes = [0; PACKET];
        for (lane, &number) in lanes.iter_mut().zip(numbers) {
            *lane = from[usize::from(number)];
        }
        work(&mut packet, Lanes::Of(&lanes[..numbers.len()]));
    });
}

/// The lanes of a bundle that are in a packet.
#[derive(Clone, Copy)]
enum Lanes<'a> {
    All,
    Of(&'a [u8]),
}

impl Lanes<'_> {
    /// Bits of a packet as bits of the bundle.
    fn spread(self, packet: u32) -> u32 {
        match self {
            Self::All => packet,
            Self::Of(lanes) => bits(packet).fold(0, |mask, i| mask | 1 << lanes[i]),
        }
    }
}

impl RenderScene {
    /// [`RenderScene::hit`] for a bundle of rays.
    pub fn hits(&self, rays: &RayLanes, hits: &mut HitLanes) {
        hits.mask = 0;
        if self.annotated || !Packet::is_worth_while() {
            bits(rays.mask).for_each(|lane| hits.set(lane, self.hit(&rays.ray(lane))));
            return;
        }
        let mut doubtful = 0;
        in_packets(rays, |packet, lanes| {
            self.tree().meet_packet::<false>(packet, self);
            packet.write(hits, lanes);
            hits.mask |= lanes.spread(packet.found);
            doubtful |= lanes.spread(packet.found & packet.close);
        });
        if self.special {
            for lane in bits(hits.mask & !doubtful) {
                let seen = |hit: Hit| self.is_seen(&rays.ray(lane), &hit);
                doubtful |= u32::from(!hits.hit(lane).is_none_or(seen)) << lane;
            }
        }
        bits(doubtful).for_each(|lane| hits.set(lane, self.hit(&rays.ray(lane))));
    }

    /// [`RenderScene::transmittance`] for a bundle of rays, each up to its own `t_max`.
    pub fn transmittances(&self, rays: &RayLanes, through: &mut Side) {
        if !Packet::is_worth_while() {
            for lane in bits(rays.mask) {
                through[lane] = self.transmittance(&rays.ray(lane), rays.t_max[lane]);
            }
            return;
        }
        let (mut met, mut unsure) = (0, 0);
        in_packets(rays, |packet, lanes| {
            self.tree().meet_packet::<true>(packet, self);
            met |= lanes.spread(packet.found);
            if !self.solid {
                let primitives = packet.hits().primitive;
                let open = |lane: &usize| !self.stops_light(primitives[*lane]);
                let open = bits(packet.found).filter(open);
                unsure |= lanes.spread(open.fold(0, |all, lane| all | 1 << lane));
            }
        });
        for (lane, through) in through.iter_mut().enumerate() {
            *through = if met >> lane & 1 == 1 { 0.0 } else { 1.0 };
        }
        // What was met lets some light through, and there may be more behind it.
        for lane in bits(unsure) {
            through[lane] = self.transmittance(&rays.ray(lane), rays.t_max[lane]);
        }
    }
}

impl Packet {
    /// Writes what its rays have met to their lanes.
    fn write(&self, hits: &mut HitLanes, lanes: Lanes<'_>) {
        let found = self.hits();
        match lanes {
            Lanes::All => {
                (hits.t, hits.u, hits.v) = (*found.t, *found.u, *found.v);
                hits.primitive = *found.primitive;
            }
            Lanes::Of(lanes) => {
                for (i, lane) in lanes.iter().map(|lane| usize::from(*lane)).enumerate() {
                    (hits.t[lane], hits.u[lane]) = (found.t[i], found.u[i]);
                    (hits.v[lane], hits.primitive[lane]) = (found.v[i], found.primitive[i]);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::iv::Document;
    use crate::scene::CompileOptions;

    #[test]
    fn a_bundle_meets_what_its_rays_meet() {
        let text = "#Inventor V2.1 ascii\nSphere { }\nTranslation { translation 1 .4 .5 }\n\
             Cube { width .5 }\nTranslation { translation -2 -1 0 } Cone { }\n\
             Coordinate3 { point [ -1 -1 2, 3 -1 2, 3 2 2.5, -1 2 2 ] }\n\
             IndexedFaceSet { coordIndex [ 0, 1, 2, -1, 0, 2, 3, -1, 0, 1, 2, -1 ] }\n";
        for hints in [
            "",
            "ShapeHints { vertexOrdering CLOCKWISE shapeType SOLID }\n",
            "Separator { Material { transparency .4 } Cube { width 4 depth 1 } }\n",
        ] {
            let text = text.replacen('\n', &format!("\n{hints}"), 1);
            let document = Document::read_headerless("bundle.iv", text.into_bytes()).unwrap();
            let scene = RenderScene::compile(&document, &CompileOptions::default()).unwrap();
            let mut state = 1u64;
            let mut unit = move || {
                state = crate::sampling::mix(state);
                (state >> 40) as f32 / (1u64 << 24) as f32 - 0.5
            };
            let (mut met, mut blocked) = (0, 0);
            for count in (0..=BUNDLE).cycle().take(400) {
                let mut any = || Vec3::new(unit(), unit(), unit());
                let (eye, aim) = (8.0 * any(), 3.0 * any());
                let ray = |at: Vec3| Ray {
                    t_max: 1.0,
                    ..Ray::new(eye + 0.01 * at, aim + at - eye)
                };
                // Lanes without a ray hold what is none.
                let mut rays = RayLanes::default();
                rays.origin[0] = [f32::NAN; BUNDLE];
                let every = 1 + count % 3;
                (0..count).for_each(|i| rays.set(i * every % BUNDLE, &ray(any())));
                let mut hits = HitLanes::default();
                let mut through = [0.5; BUNDLE];
                scene.hits(&rays, &mut hits);
                scene.transmittances(&rays, &mut through);
                assert_eq!(hits.mask & !rays.mask, 0);
                for i in bits(rays.mask) {
                    let ray = rays.ray(i);
                    assert_eq!(hits.hit(i), scene.hit(&ray), "{ray:?}");
                    assert_eq!(through[i], scene.transmittance(&ray, 1.0), "{ray:?}");
                    met += usize::from(hits.hit(i).is_some());
                    blocked += usize::from(through[i] == 0.0);
                }
            }
            assert!(met > 1000 && blocked > 1000, "{met} {blocked}");
        }
    }
}
