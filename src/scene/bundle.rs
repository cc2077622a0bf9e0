//! Many rays at once: what they meet, and whether light gets through.
//!
//! Rays of one course go through the tree as packets; the answers are those of one ray by itself,
//! bit by bit.

use super::wide::{Others, PACKET, Packet, bits, course};
use super::{Hit, PreparedRay, Ray, RenderScene};

/// Rays in a bundle, at most.
pub const BUNDLE: usize = 32;

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
        NUMBERS[..count].chunks(PACKET).for_each(packet);
        return;
    }
    let mut left = ((1u64 << count) - 1) as u32;
    while left != 0 {
        let first = courses[left.trailing_zeros() as usize];
        let (mut numbers, mut count) = ([0; PACKET], 0);
        for i in bits(left) {
            if courses[i] == first && count < PACKET {
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

impl RenderScene {
    /// [`RenderScene::hit`] for up to [`BUNDLE`] rays.
    pub fn hits(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        if self.annotated || !Packet::is_worth_while() {
            for (hit, ray) in hits.iter_mut().zip(rays) {
                *hit = self.hit(ray);
            }
            return;
        }
        let mut packet = Packet::empty();
        packets(rays, |numbers| {
            packet.fill(numbers.iter().map(|&i| &rays[usize::from(i)]));
            self.tree().meet_packet::<false>(&mut packet, self);
            for (lane, &i) in numbers.iter().enumerate() {
                let i = usize::from(i);
                let hit = packet.hit(lane);
                let hit = hit.map(|(t, primitive, u, v)| Hit { t, primitive, u, v });
                let sure = packet.close >> lane & 1 == 0 && rays[i].plane_end <= 0.0;
                hits[i] = match hit {
                    Some(hit) if sure && (!self.special || self.is_seen(&rays[i], &hit)) => {
                        Some(hit)
                    }
                    Some(_) => self.hit(&rays[i]),
                    None => None,
                };
            }
        });
    }

    /// [`RenderScene::transmittance`] for up to [`BUNDLE`] rays, each up to its own `t_max`.
    pub fn transmittances(&self, rays: &[Ray], through: &mut [f32]) {
        if !self.solid || !Packet::is_worth_while() {
            for (through, ray) in through.iter_mut().zip(rays) {
                *through = self.transmittance(ray, ray.t_max);
            }
            return;
        }
        let mut packet = Packet::empty();
        packets(rays, |numbers| {
            packet.fill(numbers.iter().map(|&i| &rays[usize::from(i)]));
            self.tree().meet_packet::<true>(&mut packet, self);
            for (lane, &i) in numbers.iter().enumerate() {
                let blocked = packet.found >> lane & 1 == 1;
                through[usize::from(i)] = f32::from(u8::from(!blocked));
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

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
                let rays: Vec<Ray> = (0..count).map(|_| ray(any())).collect();
                let mut hits = [None; BUNDLE];
                let mut through = [0.0; BUNDLE];
                scene.hits(&rays, &mut hits);
                scene.transmittances(&rays, &mut through);
                for (i, ray) in rays.iter().enumerate() {
                    assert_eq!(hits[i], scene.hit(ray), "{ray:?}");
                    assert_eq!(through[i], scene.transmittance(ray, 1.0), "{ray:?}");
                    met += usize::from(hits[i].is_some());
                    blocked += usize::from(through[i] == 0.0);
                }
            }
            assert!(met > 1000 && blocked > 1000, "{met} {blocked}");
        }
    }
}
